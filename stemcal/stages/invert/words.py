"""The outcome of a calibration, how well its parameters are known, what they are valid for, and its notes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from stemcal.doe.calibration.observations import COARSEST, FINEST
from stemcal.doe.comparison import FIXED_EXPONENT, NullModel
from stemcal.naming import Names
from stemcal.note import Note
from stemcal.numbers import change, fixed, interval, short, signed_probability, significant, tenths, with_unit
from stemcal.stages.invert.result import Certainty, InvertResult, JointFitted, PriorRow
from stemcal.words import series


def outcome(stage: InvertResult, names: Names) -> list[str]:
    """Return which values were found and, of a joint fit, how far its surfaces miss each response."""
    values = series(f"{names.factor(name)} = {significant(value)}" for name, value in stage.point.solution.items())
    if stage.joint is None:
        return [f"The surface gives the measured {names.quantity(stage.target, '.6g')} at {values}."]
    joint, errors = stage.joint, dict[str, float]()
    for row in joint.rows:
        errors[row.response] = max(errors.get(row.response, 0.0), abs(row.error_percent))
    missed = series(f"{fixed(error, 1)} % of the {names.naming.named(name).long}" for name, error in errors.items())
    count = len(joint.rows) + len(joint.further)
    return [f"The joint fit to {count} measured values gives {values}.", f"Largest error of its surfaces: {missed}."]


def certainty(stage: InvertResult, names: Names) -> list[str]:
    """Return how well the parameters are known, and from what."""
    said = [_prior(prior, names) for prior in stage.priors]
    parts = [(known(part, stage, names), unseen_changes(part, stage, names)) for part in stage.known]
    if stage.joint is not None:
        formula = [] if stage.joint.null is None else [_without_mechanics(stage.joint.null, stage.joint)]
        return [*said, *(line for keeps, _ in parts for line in keeps), *_left_out(stage.joint, names), *formula]
    said.append(_prediction(stage, names))
    if len(stage.point.solution) > 1:
        said.append(
            f"One measured {names.response.long} cannot determine several parameters; other combinations fit equally "
            f"well. The reported solution is selected by the rule `{stage.rule}`."
        )
        said += [line for part in parts for lines in part for line in lines]
    return said


def _prior(prior: PriorRow, names: Names) -> str:
    value = f"{short(prior.mean)} ± {with_unit(short(prior.sd), prior.unit)}"
    return f"Prior of {names.factor(prior.factor)}: {value} ({prior.source})."


def _prediction(stage: InvertResult, names: Names) -> str:
    expected = stage.point.prediction_interval
    if expected is None:
        return "The surface has as many coefficients as runs, so the error of its predictions cannot be estimated."
    return (
        f"A simulation with the calibrated parameters should give {names.quantities(expected)} (95 % prediction "
        "interval)."
    )


def source(part: Certainty, stage: InvertResult, names: Names) -> str:
    """Name the measurements that intervals come from, as a heading of two lines at most."""
    if part.source == "joint":
        return "joint fit"
    return f"{names.response.long}\n{(names.at(stage.condition) + ' alone').strip()}"


def known(part: Certainty, stage: InvertResult, names: Names) -> list[str]:
    """Return the intervals of the factors, which are not determined, and what that assumes."""
    data = _data(part, stage, names)
    kept = [
        f"{names.factor(factor)} between {significant(low)} and {with_unit(significant(high), part.units[factor])} "
        f"({100.0 * part.share[factor]:.0f} % of its range)"
        for factor, (low, high) in part.intervals.items()
        if factor not in part.free
    ]
    said = [f"{data} determines {series(kept)}."] if kept else []
    if part.free:
        said.append(f"{data} does not determine {names.factors(part.free)}.")
    return [*said, *assumption(part)]


def _data(part: Certainty, stage: InvertResult, names: Names) -> str:
    return "The joint fit" if part.source == "joint" else f"The {names.response.long}{names.at(stage.condition)} alone"


def assumption(part: Certainty) -> list[str]:
    """Return what intervals assume of the measured values and the surfaces; nothing where both are estimated."""
    said = []
    if part.scatter == "surface":
        said.append("The measured value is treated as exact because no SD was given.")
    if part.known_sd:
        said.append("The SD is treated as known because the number of specimens was not given.")
    if not part.surface_error_known:
        said.append(
            "The surfaces have as many coefficients as runs, so their error is unknown: the intervals assume between "
            f"{100.0 * FINEST:g} and {100.0 * COARSEST:g} % of the response."
        )
    return said


def unseen_changes(part: Certainty, stage: InvertResult, names: Names) -> list[str]:
    """Return changes, of several factors together, along which nothing that was fitted changes."""
    each = [
        series(change(names.factor(name), size, part.units[name]) for name, size in found.items())
        for found in part.unseen_changes
    ]
    return [
        f"{_data(part, stage, names)} is insensitive, to first order, to the following change: {one}." for one in each
    ]


def valid_for(stage: InvertResult) -> list[str]:
    """Return the settings that the values are valid with."""
    settings = series(f"{name} {value}" for name, value in (stage.belongs_to or {}).items())
    return [f"Valid only with {settings}; report these settings with the values."] if settings else []


def assumptions(stage: InvertResult) -> list[str]:
    """Return what the 95 % ranges assume."""
    if stage.certainty is None:
        return []
    fixed_mesh = stage.belongs_to is not None and "replicates" not in stage.belongs_to
    mesh = "The intervals do not include the scatter over mesh positions; `replicates: 5` under `solver` includes it."
    return [*assumption(stage.certainty), *([mesh] if fixed_mesh else [])]


def range_to_cite(stage: InvertResult, names: Names) -> list[str]:
    """Explain which range to cite, next to the points where the surface alone meets the target."""
    if stage.certainty is None or len(stage.point.solution) < 2 or stage.joint is not None:
        return []
    exact = series(f"{names.factor(name)} {interval(stage.ranges[name])}" for name in stage.point.solution)
    return [
        "Report the 95 % interval: all values that agree with the measurement when the other parameters vary.",
        *assumption(stage.certainty),
        "Not determined: the interval covers at least half of the factor range.",
        f"Exact solutions of the surface, without the error of the surface: {exact}.",
    ]


def _left_out(joint: JointFitted, names: Names) -> list[str]:
    error, condition = joint.max_abs_left_out_error_percent, names.naming.condition
    if error is None:
        return []
    several = condition is not None and len({row.condition for row in joint.rows}) > 1
    tests = any(row.left_out_interval is not None for row in joint.rows)
    each = "test" if tests else condition.long if condition is not None and several else "response"
    return [f"When each {each} is left out in turn, the fit to the others predicts it to within {tenths(error)} %."]


def _without_mechanics(null: NullModel, joint: JointFitted) -> str:
    """Return the errors of formulas without mechanics, and whether the joint fit predicts left-out values better."""
    formulas = [(FIXED_EXPONENT, null.fixed_max_abs_error_percent, null.fixed_max_abs_left_out_error_percent)]
    if null.exponent is not None:
        formulas.insert(0, (round(null.exponent, 2), null.max_abs_error_percent, null.max_abs_left_out_error_percent))
    each = [f"F = a·d^{e:g} {fixed(error, 1)} % ({fixed(out, 1)} %)" for e, error, out in formulas]
    fitted, out = joint.max_abs_error_percent, joint.max_abs_left_out_error_percent
    judged = {
        None: "The predictions cannot be compared because no values were left out.",
        True: "For diameters left out in turn, the joint fit predicts better than a formula.",
        False: "For diameters left out in turn, the joint fit predicts no better than a formula.",
    }[null.beaten_by(out)]
    return (
        f"Largest errors for the same {null.conditions} forces (left out in turn): {series(each)}; joint fit "
        f"{fixed(fitted, 1)} % ({fixed(out, 1)} %). {judged}"
    )


# ---- notes


def notes_of(stage: InvertResult) -> list[Note]:
    """Return what limits a solution: other solutions, the region, a misfit, a formula."""
    names = Names(stage.naming)
    found = [*(_of_one(stage, names) if stage.joint is None else _of_many(stage.joint, names))]
    found += [Note("known", "caution", " ".join(known(part, stage, names))) for part in stage.known]
    return found


def _of_one(stage: InvertResult, names: Names) -> Iterator[Note]:
    point = stage.point
    if len(point.solution) > 1:
        text = (
            f"One measured {names.response.long} cannot determine {len(point.solution)} factors: the solution is one "
            "point of a whole set, and the ranges show how far that set extends."
        )
        yield Note("one_of_many", "caution", text)
    if not point.inside:
        text = (
            f"The solution is {point.coded_radius:.2f} coded units from the centre, outside the design region "
            f"(radius {stage.radius:.2f}): the surface is extrapolated there."
        )
        yield Note("solution_outside", "warning", text)


def _of_many(joint: JointFitted, names: Names) -> Iterator[Note]:
    error = tenths(joint.max_abs_error_percent)
    yield Note(
        "surfaces_miss", "info", f"The surfaces reproduce the {len(joint.rows)} measured values to within {error} %."
    )
    if joint.further:
        text = "Means of the same specimens are treated as independent."
        if names.naming.is_cutting and any(row.response == "work" for row in joint.further):
            text += " Work follows from force and travel, so fitting all three makes the intervals too narrow."
        yield Note("independent_means", "caution", text)
    for text in _left_out(joint, names):
        yield Note("left_out", "info", text)
    if joint.null is not None:
        beaten = joint.null.beaten_by(joint.max_abs_left_out_error_percent)
        severity = {None: "caution", True: "info", False: "warning"}
        yield Note("without_mechanics", severity[beaten], _without_mechanics(joint.null, joint))  # type: ignore[arg-type]
    if joint.scatter == "misfit":
        text = "No SD was given: all relative weights are equal, and the scatter is estimated from the misfit."
        yield Note("weights", "caution", text)
    if joint.p is not None and joint.p < 0.05:
        text = (
            f"The misfit is {(joint.misfit or 0.0) / joint.df:.1f} times that expected from the scatter "
            f"(p {signed_probability(joint.p)}): the model is inadequate, and the intervals are too narrow."
        )
        yield Note("misfit_too_large", "warning", text)


def of_level_set(free: tuple[str, ...], second: bool) -> Iterator[Note]:
    """Yield the factors that one target does not determine, and whether another solution is as near to the centre."""
    if free:
        yield Note("free_factors", "info", f"The target does not constrain {series(free)} within the design region.")
    if second:
        text = "A second solution is equally far from the centre; the one with the higher levels is reported."
        yield Note("second_solution", "info", text)


def prior_unused(factors: tuple[str, ...]) -> Note:
    """Return that factors with a prior are not varied."""
    text = f"The surface does not vary {series(factors)}: the prior is not used, and the middle of the range is kept."
    return Note("prior_unused", "caution", text)


def flat_direction(changes: Mapping[str, float], units: Mapping[str, str]) -> Note:
    """Return that a joint fit cannot separate factors; `changes` in their units go together."""
    together = series(change(name, size, units[name]) for name, size in changes.items())
    text = (
        f"The measured values cannot separate the parameters: changing {together} together leaves the fit almost "
        "unchanged. Of all points that fit about equally well, the one nearest to the centre is reported."
    )
    return Note("flat_direction", "warning", text)
