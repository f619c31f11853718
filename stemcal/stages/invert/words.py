"""Sentences of a calibration: outcome, validity of the parameters, notes."""

from collections.abc import Iterator, Mapping

from stemcal.doe.calibration.observations import COARSEST, FINEST
from stemcal.formats import change, fixed, interval, series, short, significant, with_unit
from stemcal.notes import Note
from stemcal.stages.invert.result import Certainty, InvertResult, JointFitted
from stemcal.stages.verdict.words import predicted_note
from stemcal.vocabulary import Wording


def outcome(stage: InvertResult, names: Wording) -> list[str]:
    """Return sentences with the calibrated values and, for a joint fit, the largest error of each response."""
    units, solution = stage.certainty.units, stage.point.solution
    values = series(f"{names.in_text(n)} = {with_unit(significant(at), units[n])}" for n, at in solution.items())
    if stage.joint is None:
        target = names.quantity(stage.target, ".6g")
        return [f"At {values}, the predicted {names.response.long} equals the measured value of {target}."]
    joint, errors = stage.joint, dict[str, float]()
    for row in joint.rows:
        errors[row.response] = max(errors.get(row.response, 0.0), abs(row.error_percent))
    missed = series(f"{fixed(error, 1)} % ({names.naming.named(name).long})" for name, error in errors.items())
    largest, verb = ("error", "is") if len(errors) == 1 else ("errors", "are")
    return [
        f"The joint fit to {len(joint.rows) + len(joint.further)} measured values gives {values}.",
        f"The largest {largest} of the response surfaces {verb} {missed}.",
    ]


def uncertainty(part: Certainty, stage: InvertResult, names: Wording) -> list[str]:
    """Return sentences on the intervals of the parameters, the undetermined factors, and the assumptions."""
    data = "joint fit" if part.source == "joint" else f"{names.response.long}{names.at(stage.condition)}"
    kept = [
        f"{names.in_text(factor)} to between {_ends(part, factor)} "
        f"({100.0 * part.share[factor]:.0f} % of the factor range)"
        for factor in part.intervals
        if factor not in part.free
    ]
    sentences = priors(stage, names)
    sentences += [f"The {data} constrains {series(kept)}."] if kept else []
    if part.free:
        sentences.append(f"The {data} does not determine {series(map(names.in_text, part.free), 'or')}.")
    for direction in part.unseen_changes:
        changes = (change(names.in_text(name), size, part.units[name]) for name, size in direction.items())
        sentences.append(f"To first order, the {data} hardly changes if {series(changes)}.")
    return [*sentences, *assumption(part)]


def priors(stage: InvertResult, names: Wording) -> list[str]:
    """Return a sentence for each prior, with its source."""
    return [
        f"The prior for {names.in_text(prior.factor)} is {with_unit(short(prior.mean), prior.unit)} with a standard "
        f"deviation of {with_unit(short(prior.sd), prior.unit)} ({prior.source})."
        for prior in stage.priors
    ]


def _ends(part: Certainty, factor: str) -> str:
    """Return the limits of an interval; ≤ or ≥ marks a limit of the factor range."""
    (low, high), (from_below, from_above) = part.intervals[factor], part.bounded[factor]
    ends = f"{'' if from_below else '≤ '}{significant(low)} and {'' if from_above else '≥ '}{significant(high)}"
    return with_unit(ends, part.units[factor])


def assumption(part: Certainty) -> list[str]:
    """Return sentences on the assumptions about measured values and surfaces; none if all errors are estimated."""
    sentences = []
    if part.scatter == "surface":
        sentences.append("If no standard deviation is given, the measured value is treated as exact.")
    if part.known_sd:
        sentences.append("If the number of specimens is not given, the standard deviation is treated as exact.")
    if not part.surface_error_known:
        sentences.append(
            "The error of the response surfaces cannot be estimated; the intervals assume an error between "
            f"{100.0 * FINEST:g} and {100.0 * COARSEST:g} % of the response."
        )
    return sentences


def valid_for(stage: InvertResult) -> list[str]:
    """Return a sentence on the settings of the simulation for which the parameters are valid."""
    settings = series(f"{name} {value}" for name, value in (stage.depends_on or {}).items())
    text = f"The parameters are valid only with {settings}. Always report the parameters together with these settings."
    return [text] if settings else []


def range_to_cite(stage: InvertResult, names: Wording) -> list[str]:
    """Return sentences on the interval to report and, for a single target, the ranges of the exact solutions."""
    if len(stage.point.solution) < 2 or stage.joint is not None:
        return []
    exact = series(
        f"{names.in_text(name, unit := stage.certainty.units[name])} {with_unit(interval(stage.ranges[name]), unit)}"
        for name in stage.point.solution
    )
    return [
        "Report the 95 % confidence interval of each parameter, that is, all values consistent with the measurement.",
        *assumption(stage.certainty),
        "If the error of the response surface is neglected, all parameter values that reproduce the target are within "
        f"these ranges: {exact}.",
    ]


def invert_notes(stage: InvertResult) -> list[Note]:
    """Return notes on a solution: other solutions, validity, comparison with a power law, intervals."""
    names = Wording(stage.naming)
    notes = _single_target_notes(stage, names) if stage.joint is None else _joint_fit_notes(stage.joint, names)
    predicted = [] if stage.prediction is None else [predicted_note("left_out", stage.prediction, names)]
    return [*notes, *predicted, Note("known", "caution", " ".join(uncertainty(stage.certainty, stage, names)))]


def _single_target_notes(stage: InvertResult, names: Wording) -> Iterator[Note]:
    point = stage.point
    if len(point.solution) > 1:
        text = (
            f"A single measured {names.response.long} cannot determine {len(point.solution)} parameters. The "
            f"`{stage.rule}` rule was used to select one of the parameter combinations that fit equally well."
        )
        yield Note("one_of_many", "caution", text)
    if not point.inside:
        text = (
            "The solution is outside the experimental region, so the response surface is extrapolated (coded distance "
            f"from the design centre: {point.coded_radius:.2f}, limit: {stage.radius:.2f})."
        )
        yield Note("solution_outside", "warning", text)


def _joint_fit_notes(joint: JointFitted, names: Wording) -> Iterator[Note]:
    if joint.further:
        text = "The means of different responses measured on the same specimens are treated as independent."
        if names.naming.is_cutting and any(row.response == "work" for row in joint.further):
            narrow = "a joint fit to all three responses yields intervals that are too narrow"
            text += f" Work depends on force and travel, so {narrow}."
        yield Note("independent_means", "caution", text)
    if joint.scatter == "misfit":
        text = (
            "Without standard deviations, the relative errors of all values are weighted equally, and the scatter is "
            "estimated from the misfit."
        )
        yield Note("weights", "caution", text)


def prior_unused(factors: tuple[str, ...]) -> Note:
    """Return the note on factors that have a prior but are not varied."""
    text = f"Priors are ignored for factors that are not varied in the response surface design: {series(factors)}."
    return Note("prior_unused", "caution", text)


def flat_direction(changes: Mapping[str, float], units: Mapping[str, str]) -> Note:
    """Return the note on factors that a joint fit cannot separate: `changes` (in `units`) leave the fit unchanged."""
    together = series(change(name, size, units[name]) for name, size in changes.items())
    text = (
        f"The measurements cannot separate the parameters: if {together}, the fit hardly changes. Of all points "
        "that fit almost equally well, the point nearest to the design centre is reported."
    )
    return Note("flat_direction", "warning", text)
