"""The outcome of a validation, what checks it independently, and its notes."""

from collections.abc import Iterable, Iterator

from stemcal.naming import Names
from stemcal.note import Note, Severity
from stemcal.numbers import interval, significant, tenths
from stemcal.stages.validate.result import ValidateResult
from stemcal.words import series

_TRAVEL_APART = 50.0  # percent of the measured travel: a larger difference is not the stem's alone


def outcome(stage: ValidateResult, names: Names) -> list[str]:
    """Return by how much simulation and measurement differ."""
    if stage.worst_percent is None:
        return ["No run of the validation gave a response."]
    if len(stage.rows) == 1:
        return [_single_outcome(stage, names)]
    responses = "responses" if names.naming.others else names.response.long
    worst, mean = tenths(stage.worst_percent), tenths(stage.mean_abs_error_percent)
    return [
        f"At {len(stage.rows)} values of the {names.condition.long}, the simulated and measured {responses} differ by "
        f"at most {worst} %, on average by {mean} %."
    ]


def _single_outcome(stage: ValidateResult, names: Names) -> str:
    (row,) = stage.rows
    errors = {names.response.long: row.compared.error_percent}
    errors |= {names.naming.named(one.response).long: one.error_percent for one in row.further if one.judged}
    each = [f"{tenths(None if error is None else abs(error))} % ({response})" for response, error in errors.items()]
    return f"Simulated and measured values differ by {series(each)}."


def certainty(stage: ValidateResult, names: Names) -> list[str]:
    """Return what checks the result independently, and whether a formula does as well."""
    tables = [note.text for note in stage.notes if note.kind == "from_table"]
    return [_independent(stage, names), *_beside_formula(stage, names), *tables]


def _independent(stage: ValidateResult, names: Names) -> str:
    errors = [abs(row.error_percent or 0.0) for row in stage.held_out]
    if not errors:
        return "Only fitted values were compared, so there is no independent check."
    places, within = names.conditions(row.condition for row in stage.held_out), f"{stage.tolerance_percent:g} %"
    if len(errors) == 1:
        agree = "agrees" if errors[0] <= stage.tolerance_percent else "does not agree"
        return f"At {places}, not used for calibration, the error is {tenths(errors[0])} %: it {agree} within {within}."
    good = sum(error <= stage.tolerance_percent for error in errors)
    return (
        f"At {places}, not used for calibration, the error is at most {tenths(max(errors))} %; {good} of {len(errors)} "
        f"are within {within}."
    )


def _beside_formula(stage: ValidateResult, names: Names) -> list[str]:
    """Compare the errors at held-out diameters with those of a formula through the fitted forces."""
    formula, model = stage.formula, stage.worst_held_out_percent
    if formula is None or model is None:
        return []
    only = "" if model < formula.worst_held_out_percent else "only "
    return [
        f"The empirical formula F = a·d^{formula.exponent:.3g} fitted at {names.conditions(stage.fitted)} predicts the "
        f"force at the other diameters to within {formula.worst_held_out_percent:.1f} %, the model {only}to within "
        f"{model:.1f} %."
    ]


# ---- notes


def notes_of(stage: ValidateResult) -> list[Note]:
    """Return what follows from the comparison: its independence, failed runs, growth, travel and a formula."""
    names = Names(stage.naming)
    severity: Severity = "warning" if stage.no_better_than_formula else "info"
    return [
        *_fitted(stage, names),
        *_failed(stage, names),
        *_growth(stage),
        *_travel(stage, names),
        *(Note("beside_formula", severity, text) for text in _beside_formula(stage, names)),
    ]


def _fitted(stage: ValidateResult, names: Names) -> Iterator[Note]:
    if stage.fitted:
        where = names.at(*stage.fitted) if names.placed else " to this response"
        text = f"The parameters were fitted{where}, so the error there is not an independent check."
        yield Note("fitted", "info", text)


def _failed(stage: ValidateResult, names: Names) -> Iterator[Note]:
    failed = [row.condition for row in stage.compared if row.simulated is None]
    if failed:
        text = f"There is no simulated {names.response.long}{names.at(*failed)}: the run failed."
        yield Note("failed", "warning", text)


def _growth(stage: ValidateResult) -> Iterator[Note]:
    lab, model = stage.measured_exponent, stage.simulated_exponent
    if lab is not None and model is not None:
        text = f"The measured force grows as d^{lab.value:.2f}, the simulated force as d^{model.value:.2f}."
        yield Note("growth", "info", text)


def _travel(stage: ValidateResult, names: Names) -> Iterator[Note]:
    """Compare the travel to the maximum, where a machine's was measured besides the forces of stems."""
    pairs = [one for row in stage.rows for one in row.further if one.response == "travel"]
    if not names.naming.is_cutting or all(abs(one.error_percent or 0.0) <= _TRAVEL_APART for one in pairs):
        return
    measured, simulated = _range(one.measured for one in pairs), _range(one.simulated for one in pairs)
    text = (
        f"The measured force has its maximum at {measured} mm of travel, the simulated force at {simulated} mm. A "
        "measured travel includes the compliance of the machine's frame and clamps and of the stem between preload "
        "and cut. Compare the forces; fit the travel only after that compliance is measured and subtracted."
    )
    yield Note("travel_apart", "caution", text)


def _range(values: Iterable[float]) -> str:
    values = sorted(values)
    low, high = values[0], values[-1]
    return significant(low, 3) if low == high else interval((low, high), 3)
