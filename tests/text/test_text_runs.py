"""What is said of single runs."""

from __future__ import annotations

import pytest

from stemcal.run_warnings import EnergyDrifts, ForceAfterBreak, RunWarning, StrokeTooShort
from stemcal.text.notes import sentence
from stemcal.text.runs import warned_of, warning_text


@pytest.mark.parametrize("kind", RunWarning.__subclasses__())
def test_every_kind_of_warning_has_a_sentence(kind: type[RunWarning]) -> None:
    assert sentence.dispatch(kind) is not sentence.dispatch(object)


@pytest.mark.parametrize(
    ("ending", "said"),
    [
        ("rising", "The force still rose at the end of the 1 mm stroke: the true maximum is larger."),
        (
            "regained",
            "A peak of 100.0 N at 0.5 mm was passed, the force fell to 70.0 N and regained 95.0 N within the 1 mm "
            "stroke: a larger maximum may follow.",
        ),
        (
            "falling",
            "A peak of 100.0 N at 0.5 mm was passed, but the force fell only to 95.0 N within the 1 mm stroke: a "
            "larger maximum may follow.",
        ),
    ],
)
def test_a_stroke_that_is_too_short(ending: str, said: str) -> None:
    warning = StrokeTooShort(ending, 100.0, 0.5, 70.0, 95.0, 1.0)
    assert warning_text(warning) == f"{said} Lengthen loading.duration."


def test_the_released_stem() -> None:
    assert warning_text(ForceAfterBreak(0.8321, 130.04, 120.0)) == (
        "After the break at 0.832 mm the force rose again, to 130.0 N, above the peak of 120.0 N: the released stem "
        "swings against the blade. That is not the force of cutting."
    )


def test_how_many_runs_are_warned() -> None:
    drift = "The energy balance drifts by 3.1 %. Lower solver.time_step_safety and solver.time_step."
    warnings = {"screen 2": EnergyDrifts(3.14), "rsm 1": EnergyDrifts(2.5)}
    assert warned_of(warnings, 12) == f"2 of 12 runs, first screen 2: {drift}"
    assert warned_of({"screen 1": EnergyDrifts(3.14)}, 1) == f"1 of 1 run, first screen 1: {drift}"
