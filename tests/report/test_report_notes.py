"""What notes weigh: each remark is known again by the template that made it, in a file as in memory."""

from __future__ import annotations

from importlib import import_module
from string import Formatter
from typing import Any

import pytest

from stemcal.remarks import Remark, Weight, weight_of
from stemcal.report.notes import notes_of, warned, weighed
from stemcal.runs.policy import censored_remarks
from stemcal.solvers.protocol import Answer
from stemcal.stages.base import STAGES
from stemcal.stages.verdict.rules import verdict_of

for stage in STAGES:
    import_module(stage.module)


def made(remark: Remark) -> str:
    """Return a remark's sentence with a number in every field."""
    return remark(**{field: 7 for _, field, _, _ in Formatter().parse(remark.template) if field})


@pytest.mark.parametrize("remark", Remark.declared, ids=lambda remark: remark.template[:60])
def test_a_sentence_is_known_by_the_remark_that_made_it_and_by_no_other(remark: Remark) -> None:
    assert [other for other in Remark.declared if other.says(made(remark))] == [remark]


def test_remarks_of_every_weight_are_declared() -> None:
    assert {remark.weight for remark in Remark.declared} == set(Weight)


def test_signs_of_patterns_in_a_template_stand_for_themselves() -> None:
    starred = Remark(Weight.USE, "[a] R² of {model}* is low?")
    try:
        assert starred.says(starred(model="x"))
        assert not starred.says("a R² of x* is low!")
    finally:
        Remark.declared.remove(starred)


@pytest.mark.parametrize("ended", ["rising", "regained", "falling", None])
def test_a_force_that_is_a_bound_weighs_most_however_the_stroke_ended(ended: str | None) -> None:
    details = {"stroke_was_enough": False, "stroke_end": ended}
    (sentence,) = censored_remarks([Answer("ok", 120.0, details=details)])
    assert weight_of(sentence) is Weight.NUMBERS


def test_what_no_remark_says_is_one_of_trust() -> None:
    assert weight_of("A new one.") is Weight.TRUST


def test_notes_of_a_study_stand_in_the_order_of_their_weights(replayed: Any, results: Any) -> None:
    notes = weighed(
        [*notes_of(results, verdict_of(*replayed, results)), *warned(["the energy balance drifts by 3.0 %"])]
    )
    assert [note.weight for note in notes] == sorted(note.weight for note in notes)
    assert notes[0].source == "runs"
    by = {note.sentence[:20]: note.weight for note in notes}
    assert by["Without run 3 (112) "] is by["The simulated forces"] is Weight.USE
    assert by["Run 4 (107) sways th"] is Weight.TRUST
    assert by["Measured force grows"] is by["8 mm is the calibrat"] is Weight.ASIDE
