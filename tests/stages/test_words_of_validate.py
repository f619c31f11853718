"""What a validation says, on the paper's own forces."""

from dataclasses import replace
from typing import Any

from stemcal.notes import Note
from stemcal.stages.validate.analysis import validate_notes
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.validate.showing import ValidateShowing
from stemcal.storage.rows import Rows
from stemcal.vocabulary import Variable, Vocabulary, Wording

outcome = ValidateShowing().outcome
ANGLE = Vocabulary(None, (Variable("angle", "Angle of repose", "θ", "deg"),))


def notes(stage: ValidateResult, naming: Vocabulary | None = None) -> dict[str, Note]:
    stage = stage if naming is None else replace(stage, head=replace(stage.head, naming=naming))
    return {note.kind: note for note in validate_notes(stage)}


def test_one_comparison_has_no_mean(results: Any) -> None:
    whole = results.of(ValidateResult)
    one = replace(whole, rows=whole.rows[:1], worst_percent=1.23)
    (said,) = outcome(one, Wording(ANGLE))
    assert said == "The simulated angle of repose differs from the measurement by at most 1.2 %."


def test_notes_of_the_published_forces(results: Any) -> None:
    assert {note.kind: note.severity for note in results.of(ValidateResult).notes} == {
        "fitted": "info",
        "growth": "info",
        "held_out": "info",
        "error_trend": "warning",
        "from_table": "warning",
    }
    found = notes(results.of(ValidateResult))
    assert "at a diameter of 8 mm" in found["fitted"].text
    assert "d^2.59" in found["growth"].text and "d^2.20" in found["growth"].text


def test_a_run_that_failed_is_no_prediction(results: Any) -> None:
    whole = results.of(ValidateResult)
    whole = replace(whole, notes=(), worst_held_out_percent=9.0)
    first, *others = whole.rows
    failed = replace(first, compared=replace(first.compared, simulated=None, error_percent=None))
    assert [row.condition for row in whole.held_out] == [7.0, 9.0, 10.0, 11.0]
    for rows, conditions in ((whole.rows, (7.0, 9.0, 10.0, 11.0)), (Rows([failed, *others]), (9.0, 10.0, 11.0))):
        found = replace(whole, rows=rows).prediction
        assert found is not None and found.conditions == conditions
