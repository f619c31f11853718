"""The sentences of a surface, on the paper's own runs."""

from __future__ import annotations

from typing import Any

from stemcal.names import Names
from stemcal.stages.surface import words
from stemcal.stages.surface.result import SurfaceResult

NAMES = Names(labels={"yield_stress": "Yield stress"})


def test_the_outcome_names_factors_runs_and_range(results: Any) -> None:
    assert words.outcome(results.of(SurfaceResult), NAMES) == [
        "A quadratic surface over Yield stress, failure_strain and strain_rate_c was fitted to 20 runs between 64 N "
        "and 175 N."
    ]


def test_certainty_gives_both_r2_and_the_lack_of_fit(results: Any) -> None:
    assert words.certainty(results.of(SurfaceResult), NAMES) == [
        "The surface explains 98.5 % of the variation between its runs (R² 0.985, predicted R² 0.922).",
        "Its lack of fit is not significant (p = 0.3189).",
    ]


def test_the_notes_of_the_published_surface(results: Any) -> None:
    said = {note.kind: note.text for note in results.of(SurfaceResult).notes}
    assert "run 3 (112 N)" in said["verdict_on_one_run"] and "p = 0.0173" in said["verdict_on_one_run"]
    assert "6 runs" in said["unequal_repeats"] and "112 N to 124 N" in said["unequal_repeats"]
    assert "saddle" in said["shape"]
