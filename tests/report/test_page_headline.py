"""The top box of the page: every reason in a line, in the order of the verdict."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import make_study

from stemcal.notes import Note
from stemcal.report.page import headline as module
from stemcal.report.page.headline import Card, headline, lead, question
from stemcal.report.page.page import _plots_of
from stemcal.stages.verdict.result import Verdict


def test_all_reasons_are_at_the_top_each_with_its_first_sentence() -> None:
    reasons = [Note(f"kind_{i}", "warning", f"Reason {i} is 1.5 %. More of {i}. And more.") for i in range(12)]
    assert lead(Verdict.of(reasons, None), "used") == [f"Reason {i} is 1.5 %." for i in range(12)]
    assert lead(Verdict.of([], None), "Within 10 %.") == ["Within 10 %."]
    assert lead(Verdict.of([], None), "") == []


def test_a_card_has_its_interval_only_where_there_is_one() -> None:
    assert str(Card("Yield stress", "18.4", "MPa", "15.3 to 20 MPa")).startswith("Yield stress = 18.4 MPa (95")
    assert str(Card("Exponent", "0.5", "", "")) == "Exponent = 0.5"


def test_cards_have_labels_and_intervals_of_a_calibrated_study(monkeypatch: pytest.MonkeyPatch) -> None:
    ranges = {"a": "1 to 2", "b": ""}
    monkeypatch.setattr(module, "cited_ranges", lambda _: ranges)
    factors = {"a": SimpleNamespace(label="First", unit="MPa"), "b": SimpleNamespace(label="", unit="1")}
    study: Any = SimpleNamespace(factor=factors.__getitem__)
    results: Any = SimpleNamespace(parameters={"a": 1.5, "b": 0.25, "c": 3.0})
    a, b = headline(results, study)
    assert (a.name, a.unit, a.range) == ("First", "MPa", "1 to 2 MPa")
    assert (b.name, b.value, b.range) == ("b", "0.2500", "")
    assert headline(results, study, holds=False)[0].range == ""


def test_a_figure_is_in_its_own_section() -> None:
    plots: Any = [
        SimpleNamespace(section=s, on_page=shown) for s, shown in (("rsm", True), ("runs", True), ("rsm", False))
    ]
    assert _plots_of("rsm", plots) == plots[:1] and _plots_of("runs", plots) == plots[1:2]


def test_the_question_of_a_cut_names_its_stems(tmp_path: Path) -> None:
    asked = question(make_study(tmp_path))
    assert asked == "Which parameter values reproduce the measured maximum force of stems with a diameter of 8 mm?"
