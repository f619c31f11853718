"""What a validation says, on the paper's own forces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from stemcal.files.rows import Rows
from stemcal.naming import Named, Naming
from stemcal.notes import Weight
from stemcal.stages.invert.certainty import Measured
from stemcal.stages.validate.result import (
    FurtherRow,
    ValidateResult,
)
from stemcal.text import validation
from stemcal.text.names import Names
from stemcal.text.notes import Remark
from stemcal.text.results import remarks_of

NAMES = Names(labels={"yield_stress": "Yield stress"})
ANGLE = Naming(None, (Named("angle", "Angle of repose", "θ", "deg"),))
MOIST = replace(ANGLE, condition=Named("moisture", "Moisture", "w", "%"))


def said(stage: ValidateResult, naming: Naming | None = None) -> dict[str, Remark]:
    stage = stage if naming is None else replace(stage, head=replace(stage.head, naming=naming))
    return {remark.kind: remark for remark in remarks_of(stage)}


def rows_with(stage: ValidateResult, **facts: Any) -> ValidateResult:
    """Return it with other facts of every comparison."""
    rows = [replace(row, compared=replace(row.compared, **facts)) for row in stage.rows]
    return replace(stage, rows=type(stage.rows)(rows))


def test_outcome_and_certainty(results: Any) -> None:
    assert validation.outcome(results.validation, NAMES) == [
        "Over 5 values of the stem diameter, simulated and measured maximum force differ by at most 7.8 %, 6.7 % on "
        "average."
    ]
    checked, formula, table = validation.certainty(results.validation, NAMES)
    assert checked == (
        "At 7, 9, 10 and 11 mm, not used for calibration, the error is at most 7.8 %; 4 of 4 are within 10 %."
    )
    assert formula == (
        "Without mechanics F = a·d^2.5 through 8 mm misses the other diameters by at most 7.3 %, the model by 7.8 %: "
        "it predicts the diameters no better than a formula."
    )
    assert table.endswith("It belongs to the levels of that table, not to this calibration.")


def test_a_small_error_is_not_none(results: Any) -> None:
    """As of a study whose answer is known."""
    small = replace(results.validation, max_abs_error_percent=0.0123, mean_abs_error_percent=0.0068)
    assert validation.outcome(small, NAMES)[0].endswith("differ by at most 0.01 %, 0.007 % on average.")
    one = rows_with(replace(small, rows=small.rows[:1]), error_percent=-0.0123)
    assert validation.outcome(one, Names(ANGLE))[0].endswith("differ by 0.01 % (angle of repose).")


def test_the_spec_says_what_counts_as_equal(results: Any) -> None:
    checked = validation.certainty(replace(results.validation, tolerance_percent=6.0), NAMES)[0]
    assert checked.endswith("1 of 4 are within 6 %.")


def test_a_single_condition_and_none(results: Any) -> None:
    one = replace(results.validation, rows=results.validation.rows[:1], formula_max_abs_error_percent=None, notes=())
    assert validation.certainty(one, NAMES) == [
        "At 7 mm, not used for calibration, the error is 7.8 %; up to 10 % counts as equal."
    ]
    assert validation.outcome(one, Names(ANGLE)) == ["Simulated and measured values differ by 7.8 % (angle of repose)."]
    fitted = rows_with(one, role="calibration")
    assert validation.certainty(fitted, NAMES) == [
        "Only what the parameters were fitted to could be compared: nothing checks the result."
    ]
    failed = rows_with(replace(one, max_abs_error_percent=None), simulated=None, error_percent=None)
    assert validation.outcome(failed, NAMES) == ["No run of the validation gave a response."]


def test_remarks_of_the_published_forces(results: Any) -> None:
    found = said(results.validation)
    weights = {kind: remark.weight for kind, remark in found.items() if not kind.startswith("error at")}
    assert weights == {
        "fitted": Weight.ASIDE,
        "growth": Weight.ASIDE,
        "beside_formula": Weight.USE,
        "error_trend": Weight.USE,
        "from_table": Weight.USE,
    }
    assert found["fitted"].sentence == "The parameters were fitted at 8 mm: an error there is not an independent check."
    assert found["growth"].sentence == "The measured force grows as d^2.59, the simulated as d^2.20."
    assert found["error_trend"].sentence.startswith("The error changes by +4.3 % per mm of diameter")


def test_a_machines_travel_is_compared_with_the_simulated(results: Any) -> None:
    """3 to 5 mm at the machine, 0.7 mm in the model."""

    def with_travel(*measured: float) -> ValidateResult:
        pairs = [FurtherRow.of(Measured(8.0, "travel", value), 0.7) for value in measured]
        rows = [replace(row, further=Rows([pair])) for row, pair in zip(results.validation.rows, pairs, strict=False)]
        return replace(results.validation, rows=Rows(rows))

    told = said(with_travel(3.0, 5.0))["travel_apart"]
    assert "maximum at 3.00 to 5.00 mm of travel, the simulated at 0.700 mm" in told.sentence
    assert "travel_apart" not in said(with_travel(0.75, 0.9)) and "travel_apart" not in said(results.validation)


def test_failed_runs_are_named_by_their_condition(results: Any) -> None:
    failed = rows_with(results.validation, simulated=None)
    assert said(failed)["failed"].sentence.startswith("There is no simulated maximum force at 7, 8, 9, 10 and 11 mm")
    assert said(failed, MOIST)["failed"].sentence.startswith(
        "There is no simulated angle of repose at moisture 7, 8, 9, 10 and 11 %"
    )
    assert said(failed, ANGLE)["failed"].sentence == "There is no simulated angle of repose: the run failed."
