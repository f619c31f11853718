"""What a validation says, on the paper's own forces."""

from dataclasses import replace
from typing import Any

from stemcal.naming import Named, Names, Naming
from stemcal.note import Note
from stemcal.stages.validate.analysis import notes_of
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.validate.showing import ValidateShowing

outcome = ValidateShowing().outcome
ANGLE = Naming(None, (Named("angle", "Angle of repose", "θ", "deg"),))


def notes(stage: ValidateResult, naming: Naming | None = None) -> dict[str, Note]:
    stage = stage if naming is None else replace(stage, head=replace(stage.head, naming=naming))
    return {note.kind: note for note in notes_of(stage)}


def rows_with(stage: ValidateResult, **facts: Any) -> ValidateResult:
    """Return it with other facts of every comparison."""
    rows = [replace(row, compared=replace(row.compared, **facts)) for row in stage.rows]
    return replace(stage, rows=type(stage.rows)(rows))


def test_a_small_error_is_not_zero(results: Any) -> None:
    """As of a study whose solution is known."""
    small = replace(results.of(ValidateResult), worst_percent=0.0123, mean_abs_error_percent=0.0068)
    assert "0.01 %" in outcome(small, Names())[0] and "0.007 %" in outcome(small, Names())[0]
    one = rows_with(replace(small, rows=small.rows[:1]), error_percent=-0.0123)
    assert "measured angle of repose is 0.01 %." in outcome(one, Names(ANGLE))[0]


def test_notes_of_the_published_forces(results: Any) -> None:
    assert {note.kind: note.severity for note in results.of(ValidateResult).notes} == {
        "fitted": "info",
        "growth": "info",
        "beside_formula": "warning",
        "error_trend": "warning",
        "from_table": "warning",
    }
    found = notes(results.of(ValidateResult))
    assert "at 8 mm" in found["fitted"].text
    assert "d^2.59" in found["growth"].text and "d^2.20" in found["growth"].text
