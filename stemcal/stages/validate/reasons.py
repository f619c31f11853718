"""Reasons about the comparison with what was measured: targets missed, checks that fail, formulas that do as well."""

from collections.abc import Iterator

from stemcal.doe.comparison import FIXED_EXPONENT
from stemcal.note import Note, Remedy, Severity
from stemcal.stages.invert.result import InvertResult, JointFitted
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.evidence import Evidence
from stemcal.stages.verdict.words import miss

_WITHIN = (
    "Use the parameters only between the measured diameters, or add another kind of test (`tests`), which no such "
    "formula predicts."
)


def validation(evidence: Evidence) -> Iterator[Note]:
    """Yield what is off, failed or missing among the checks."""
    study = evidence.study
    if (checked := evidence.of(ValidateResult)) is None:
        return
    if checked.is_given:
        text = "The validation is read from a sheet, not simulated with these parameters."
        yield Note("validation_from_table", "warning", text, Remedy("Validate with a solver that runs simulations."))
        return
    held_out = [row for row in evidence.judged if not row.fitted]
    failed = tuple(row.condition for row in held_out if row.error_percent is None)
    if failed:
        names = evidence.names
        text = f"The validation has no {names.response.long}{names.at(*failed)}: the run failed."
        yield Note("validation_failed", "warning", text, Remedy("`stemcal run SPEC --retry` repeats failed runs."))
    off = [row for row in held_out if row.size > evidence.equivalent_percent]
    if off:
        worst = max(off, key=lambda row: row.size)
        left_out = worst.response not in (study.naming.response.name, *study.fitted_responses)
        until = "Until then use the result only where it agrees."
        remedy = advice.fit_all(study, "responses" if left_out else "conditions", until)
        if not left_out and advice.chose_conditions(study):  # no advice undoes an earlier one
            remedy = Remedy("Use the result only where it agrees, or add a factor that the error depends on.")
        severity: Severity = "error" if evidence.mostly_off else "warning"
        yield Note("validation", severity, f"{miss(worst, evidence.names)}.", remedy)
    if not held_out and not _left_out(evidence):
        yield Note("unchecked", "warning", "No independent measurement checks the result.", advice.measure_more(study))


def formula(evidence: Evidence) -> Iterator[Note]:
    """Yield a reservation where a formula predicts what was not fitted, or was left out in turn, at least as well."""
    checked, found = evidence.of(ValidateResult), evidence.of(InvertResult)
    if checked is None or checked.is_given:
        return
    joint, formula = found.joint if found is not None else None, checked.formula
    if formula is not None and checked.no_better_than_formula:
        held_out = f"{formula.worst_held_out_percent:.1f} %, the model within {checked.worst_held_out_percent:.1f} %"
        text = f"The formula F = a·d^{formula.exponent:.3g} predicts the held-out diameters within {held_out}."
    elif (
        not checked.held_out
        and joint is not None
        and joint.null is not None
        and joint.null.beaten_by(joint.max_abs_left_out_error_percent) is False
    ):
        text = _left_out_by_formula(joint)
    else:
        return
    yield Note("no_better_than_formula", "warning", text, Remedy(_WITHIN))


def _left_out(evidence: Evidence) -> bool:
    """Whether what is left out of a joint fit in turn is predicted within the percentage."""
    found = evidence.of(InvertResult)
    error = found.joint.max_abs_left_out_error_percent if found is not None and found.joint is not None else None
    return error is not None and error <= evidence.equivalent_percent


def _left_out_by_formula(joint: JointFitted) -> str:
    """Return that a formula predicts the diameters left out in turn as well as the joint fit."""
    null = joint.null
    assert null is not None
    laws = [
        (null.max_abs_left_out_error_percent, null.exponent),
        (null.fixed_max_abs_left_out_error_percent, FIXED_EXPONENT),
    ]
    error, exponent = min((error, b) for error, b in laws if error is not None and b is not None)
    return (
        f"The formula F = a·d^{exponent:.3g} predicts each diameter from the others within {error:.1f} %, the model "
        f"within {joint.max_abs_left_out_error_percent or 0.0:.1f} %."
    )


RULES = (validation, formula)
