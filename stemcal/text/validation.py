"""What a validation says: its outcome, how sure it is, what formulas without mechanics reach, and its notes."""

from collections.abc import Iterable, Iterator

from stemcal.doe.validation.comparison import ErrorTrend
from stemcal.doe.validation.null_model import FIXED_EXPONENT
from stemcal.notes import Weight
from stemcal.numbers import interval, significant
from stemcal.stages.validate.result import FromTable, ValidateResult
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence, states

_TRAVEL_APART = 50.0  # percent of the measured travel: beyond it is not the stem's alone


def outcome(stage: ValidateResult, names: Names) -> list[str]:
    """Say by how much simulation and measurement differ."""
    if stage.max_abs_error_percent is None:
        return [say("No run of the validation gave a response.")]
    if len(stage.rows) == 1:
        return [_single_outcome(stage, names)]
    first = (
        "Over {count} values of the {condition}, simulated and measured {response} differ by at most {worst:tenths} "
        "%, {mean:tenths} % on average."
    )
    several = (
        "Over {count} values of the {condition}, simulated and measured responses differ by at most {worst:tenths} "
        "%, {mean:tenths} % on average."
    )
    said = names.say(
        several if names.naming.others else first,
        count=len(stage.rows),
        condition=names.condition.long,
        response=names.response.long,
        worst=stage.max_abs_error_percent,
        mean=stage.mean_abs_error_percent,
    )
    return [said]


def _single_outcome(stage: ValidateResult, names: Names) -> str:
    (row,) = stage.rows
    errors = {names.response.long: row.compared.error_percent}
    errors |= {names.naming.named(one.response).long: one.error_percent for one in row.further if one.judged}
    each = [
        names.say("{size:tenths} % ({response})", size=None if error is None else abs(error), response=response)
        for response, error in errors.items()
    ]
    return names.say("Simulated and measured values differ by {errors:all}.", errors=each)


def certainty(stage: ValidateResult, names: Names) -> list[str]:
    """Say what checks the result independently, and whether a formula does as well."""
    said = [*_independent(stage, names), *_elsewhere(stage, names)]
    tables = [note for note in stage.notes if isinstance(note, FromTable)]
    return [*said, *(sentence(note, names) for note in tables)]


def _independent(stage: ValidateResult, names: Names) -> Iterator[str]:
    errors = [abs(row.error_percent or 0.0) for row in stage.independent]
    if not errors:
        yield say("Only what the parameters were fitted to could be compared: nothing checks the result.")
        return
    yield names.say_number(
        "At {places:conditions}, not used for calibration, the error is {worst:tenths} %; up to {within:g} % counts "
        "as equal.",
        "At {places:conditions}, not used for calibration, the error is at most {worst:tenths} %; {good} of {count} "
        "are within {within:g} %.",
        len(errors),
        places=[row.condition for row in stage.independent],
        worst=max(errors),
        good=sum(error <= stage.tolerance_percent for error in errors),
        within=stage.tolerance_percent,
    )


def _elsewhere(stage: ValidateResult, names: Names) -> list[str]:
    """Say whether the model predicts other diameters better than one constant does."""
    formula, model = stage.formula_max_abs_error_percent, stage.max_abs_error_percent_independent
    if formula is None or model is None:
        return []
    better = (
        "Without mechanics F = a·d^{exponent:g} through {fitted:conditions} misses the other diameters by at most "
        "{formula:.1f} %, the model by {model:.1f} %: it predicts the diameters better than a formula."
    )
    no_better = (
        "Without mechanics F = a·d^{exponent:g} through {fitted:conditions} misses the other diameters by at most "
        "{formula:.1f} %, the model by {model:.1f} %: it predicts the diameters no better than a formula."
    )
    template = better if model < formula else no_better
    return [names.say(template, exponent=FIXED_EXPONENT, fitted=stage.fitted, formula=formula, model=model)]


def _travel(stage: ValidateResult, names: Names) -> Iterator[Remark]:
    """Compare the travel to the maximum, where a machine's was measured beside the forces of stems."""
    pairs = [one for row in stage.rows for one in row.further if one.response == "travel"]
    if not names.naming.is_cutting or all(abs(one.error_percent or 0.0) <= _TRAVEL_APART for one in pairs):
        return
    apart = (
        "The measured force has its maximum at {measured} mm of travel, the simulated at {simulated} mm. A machine's "
        "travel has the give of its frame and clamps in it, and that of the stem between preload and cut: compare the "
        "forces; fit the travel only once that give is measured and taken off."
    )
    measured, simulated = _from_to(one.measured for one in pairs), _from_to(one.simulated for one in pairs)
    yield Remark(names.say(apart, measured=measured, simulated=simulated), Weight.TRUST, "travel_apart")


def _from_to(values: Iterable[float]) -> str:
    values = sorted(values)
    low, high = values[0], values[-1]
    return significant(low, 3) if low == high else interval((low, high), 3)


def remarks(stage: ValidateResult, names: Names) -> list[Remark]:
    """Return what a validation says beside its tables."""
    formula_wins = (stage.formula_max_abs_error_percent or 0.0) <= (stage.max_abs_error_percent_independent or 0.0)
    elsewhere = Weight.USE if formula_wins else Weight.ASIDE
    return [
        *_fitted(stage, names),
        *_failed(stage, names),
        *_growth(stage),
        *_travel(stage, names),
        *(Remark(said, elsewhere, "beside_formula") for said in _elsewhere(stage, names)),
        *(remark(note, names) for note in stage.notes),
    ]


def _fitted(stage: ValidateResult, names: Names) -> Iterator[Remark]:
    if not stage.fitted:
        return
    nowhere = "The parameters were fitted to this response: its error is not an independent check."
    somewhere = "The parameters were fitted at {fitted:conditions}: an error there is not an independent check."
    said = names.say(somewhere if names.placed else nowhere, fitted=stage.fitted)
    yield Remark(said, Weight.ASIDE, "fitted")


def _failed(stage: ValidateResult, names: Names) -> Iterator[Remark]:
    failed = [row.condition for row in stage.compared if row.simulated is None]
    if failed:
        nowhere = "There is no simulated {response}: the run failed."
        somewhere = "There is no simulated {response} at {failed:conditions}: the run failed."
        said = names.say(somewhere if names.placed else nowhere, response=names.response.long, failed=failed)
        yield Remark(said, Weight.NUMBERS, "failed")


def _growth(stage: ValidateResult) -> Iterator[Remark]:
    lab, model = stage.measured_exponent, stage.simulated_exponent
    if lab is not None and model is not None:
        template = "The measured force grows as d^{measured:.2f}, the simulated as d^{simulated:.2f}."
        yield Remark(say(template, measured=lab.value, simulated=model.value), Weight.ASIDE, "growth")


states(
    ErrorTrend,
    "The error changes by {slope:+.1f} % per mm of diameter: it is a trend, which no common factor on the force "
    "removes.",
)
states(
    FromTable,
    "The simulated {names.response.long} is read from a table. It belongs to the levels of that table, not to this "
    "calibration.",
)
