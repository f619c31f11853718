"""What a surface says, on the paper's own runs."""

from __future__ import annotations

from typing import Any

from stemcal.stages.design import FewSignificant, StrongestAsked
from stemcal.stages.surface.runs import EqualSeeds
from stemcal.text import surface
from stemcal.text.names import Names
from stemcal.text.notes import sentence
from stemcal.text.results import remarks_of

NAMES = Names(labels={"yield_stress": "Yield stress"})


def test_the_outcome_names_factors_runs_and_range(results: Any) -> None:
    assert surface.outcome(results.surface, NAMES) == [
        "A quadratic surface over Yield stress, failure_strain and strain_rate_c was fitted to 20 runs between 64 N "
        "and 175 N."
    ]


def test_certainty_gives_both_r2_and_the_lack_of_fit(results: Any) -> None:
    assert surface.certainty(results.surface, NAMES) == [
        "The surface explains 98.5 % of the variation between its runs (R² 0.985, predicted R² 0.922).",
        "It shows no lack of fit (p = 0.3189).",
    ]


def test_the_remarks_of_the_published_surface(results: Any) -> None:
    said = {remark.kind: remark.sentence for remark in remarks_of(results.surface)}
    assert said["verdict_on_one_run"].startswith("Without run 3 (112 N) lack of fit has p = 0.0173, with it p = 0.3189")
    assert said["unequal_repeats"].startswith("6 runs at the same levels gave 112 N to 124 N.")
    assert said["shape"].startswith("The stationary point (saddle) has")


def test_how_factors_were_chosen() -> None:
    assert sentence(StrongestAsked(("a", "b", "c"), ("b", "c"), ("d",)), NAMES) == (
        "As asked, the surface takes the strongest factors: a, b and c. Not significant among them: b and c. "
        "Significant, but left out: d."
    )
    assert "no factor significant" in sentence(FewSignificant((), ("a", "b")), NAMES)


def test_braces_of_a_placeholder_survive() -> None:
    assert "does not take {{seed}}" in sentence(EqualSeeds(), NAMES)
