"""What a calibration says: the values found, how well they are known, what they hold for, and its remarks."""

from __future__ import annotations

from collections.abc import Iterator

from stemcal.doe.calibration.inversion import FreeFactors, SecondSolution
from stemcal.doe.validation.null_model import FIXED_EXPONENT, NullModel
from stemcal.note import Note, Severity
from stemcal.notes import Weight
from stemcal.numbers import change, fixed, interval, short, significant, with_unit
from stemcal.stages.invert.result import (
    Certainty,
    FlatDirection,
    InvertResult,
    JointFitted,
    JointRow,
    MachineContradicted,
    MachineFound,
    PriorRow,
    PriorUnused,
)
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, states

KNOWN = "known"
"""The kind of the remarks that say how well the parameters are known."""


def outcome(stage: InvertResult, names: Names) -> list[str]:
    """Say which values were found and, of a joint fit, how far its surfaces miss each response."""
    values = [f"{names.factor(name)} = {significant(value)}" for name, value in stage.point.solution.items()]
    if stage.joint is None:
        template = "The surface meets the measured {target:response .6g} at {values:all}."
        return [names.say(template, target=stage.target, values=values)]
    joint, errors = stage.joint, dict[str, float]()
    for row in joint.rows:
        errors[row.response] = max(errors.get(row.response, 0.0), abs(row.error_percent))
    missed = [
        names.say("{error:fixed 1} % of the {response}", error=error, response=names.naming.named(name).long)
        for name, error in errors.items()
    ]
    fitted = "The joint fit to {count} measured values gives {values:all}."
    return [
        names.say(fitted, count=len(joint.rows) + len(joint.further), values=values),
        say("Largest error of its surfaces: {missed:all}.", missed=missed),
    ]


def certainty(stage: InvertResult, names: Names) -> list[str]:
    """Say how well the parameters are known, and what tells of it."""
    parts = [(known(part, stage, names), unseen_changes(part, stage, names)) for part in stage.known]
    if stage.joint is not None:
        formula = [] if stage.joint.null is None else [_without_mechanics(stage.joint.null, stage.joint)]
        return [
            *priors(stage, names),
            *(said for keeps, _ in parts for said in keeps),
            *_left_out(stage.joint, names),
            *formula,
        ]
    expected = stage.point.prediction_interval
    said = [*priors(stage, names), _prediction(expected, names)]
    if len(stage.point.solution) > 1:
        one = "One measured {response} cannot fix several parameters: other combinations meet it as well."
        said.append(names.say(one, response=names.response.long))
        said.append(say("The rule `{rule}` chose this one.", rule=stage.rule))
        said += [sentence for part in parts for each in part for sentence in each]
    return said


def _prediction(expected: tuple[float, float] | None, names: Names) -> str:
    if expected is None:
        return say("The surface has as many terms as runs, so the error of its predictions is unknown.")
    template = (
        "A simulation with the calibrated parameters should give {expected:responses} (95 % prediction interval)."
    )
    return names.say(template, expected=expected)


def source(part: Certainty, stage: InvertResult, names: Names) -> str:
    """Name the measurements that intervals come from, as a heading of two lines at most."""
    labels = {
        "joint": "joint fit",
        "single": "{response}\nat {condition:condition} alone",
        "unconditioned": "{response}\nalone",
    }
    return names.say(labels[_kind(part, names)], response=names.response.long, condition=stage.condition)


def _kind(part: Certainty, names: Names) -> str:
    return "unconditioned" if part.source == "single" and names.naming.condition is None else part.source


_KEEPS = {
    "joint": "The joint fit keeps {kept:all}.",
    "single": "The {response} at {condition:condition} alone keeps {kept:all}.",
    "unconditioned": "The {response} alone keeps {kept:all}.",
}
_LEAVES = {
    "joint": "The joint fit leaves {free:factors} free.",
    "single": "The {response} at {condition:condition} alone leaves {free:factors} free.",
    "unconditioned": "The {response} alone leaves {free:factors} free.",
}


def known(part: Certainty, stage: InvertResult, names: Names) -> list[str]:
    """Say which factors measurements fix, within which interval, which they leave free, and what that assumes."""
    between = "{factor:factor} between {low} and {high} ({share:.0f} % of its range)"
    kept = [
        names.say(
            between,
            factor=factor,
            low=significant(low),
            high=with_unit(significant(high), part.units[factor]),
            share=100.0 * part.share[factor],
        )
        for factor, (low, high) in part.intervals.items()
        if factor not in part.free
    ]
    kind, fields = _kind(part, names), {"response": names.response.long, "condition": stage.condition}
    said = [names.say(_KEEPS[kind], kept=kept, **fields)] if kept else []
    if part.free:
        said.append(names.say("It leaves {free:factors} free." if kept else _LEAVES[kind], free=part.free, **fields))
    return [*said, *assumption(part)]


def assumption(part: Certainty) -> list[str]:
    """Say what intervals assume of the measured values; nothing where their scatter is estimated."""
    said = {
        "exact": "The measured value is treated as exact because no SD was given.",
        "known_sd": "The SD is treated as known because the number of specimens was not given.",
    }
    return [say(said[part.assumption])] if part.assumption else []


_UNSEEN = {
    "joint": "The joint fit does not see a change of {changes:all} (to first order).",
    "single": "The {response} at {condition:condition} does not see a change of {changes:all} (to first order).",
    "unconditioned": "The {response} does not see a change of {changes:all} (to first order).",
}


def unseen_changes(part: Certainty, stage: InvertResult, names: Names) -> list[str]:
    """Say what changes, together where it is several, without what was fitted changing."""
    fields = {"response": names.response.long, "condition": stage.condition}
    each = [
        [change(names.factor(name), size, part.units[name]) for name, size in found.items()]
        for found in part.unseen_changes
    ]
    return [names.say(_UNSEEN[_kind(part, names)], changes=changes, **fields) for changes in each]


def known_beforehand(prior: PriorRow) -> str:
    """Write the prior of a factor."""
    sd = with_unit(short(prior.sd), prior.unit)
    lognormal = "{mean} ± {sd}, lognormal"
    return say("{mean} ± {sd}" if prior.kind == "normal" else lognormal, mean=short(prior.mean), sd=sd)


def priors(stage: InvertResult, names: Names) -> list[str]:
    """Say what was known beforehand and entered the calibration."""
    entered = "Known beforehand: {factor:factor} {known} ({source})."
    return [
        names.say(entered, factor=prior.factor, known=known_beforehand(prior), source=prior.source)
        for prior in stage.priors
    ]


def valid_for(stage: InvertResult) -> list[str]:
    """Say what the values hold for."""
    settings = [f"{name} {value}" for name, value in (stage.belongs_to or {}).items()]
    return [say("These values hold for {settings:all}: cite them together.", settings=settings)] if settings else []


def assumptions(stage: InvertResult) -> list[str]:
    """Say what the 95 % ranges assume."""
    if stage.certainty is None:
        return []
    one_mesh = (
        "The intervals do not include the scatter over mesh positions; `replicates: 5` under `solver` includes it."
    )
    fixed = stage.belongs_to is not None and "replicates" not in stage.belongs_to
    return [*assumption(stage.certainty), *([say(one_mesh)] if fixed else [])]


def range_to_cite(stage: InvertResult, names: Names) -> list[str]:
    """Explain which range to cite, beside the points where the surface alone meets the target."""
    if stage.certainty is None or len(stage.point.solution) < 2 or stage.joint is not None:
        return []
    exact = [f"{names.factor(name)} {interval(stage.ranges[name])}" for name in stage.point.solution]
    return [
        say("Cite the 95 % range: all values that agree with the measurement, the other parameters free."),
        *assumption(stage.certainty),
        say("Free: half of the range or more."),
        names.say("The surface meets the target exactly at {exact:all}, its own error left out.", exact=exact),
    ]


def remarks(stage: InvertResult, names: Names) -> list[Remark]:
    """Return what a calibration says beside its tables."""
    return [*_of_numbers(stage, names), *(remark(note, names) for note in stage.notes)]


_AS_SEVERITY: dict[Weight, Severity] = {
    Weight.NUMBERS: "warning",
    Weight.USE: "warning",
    Weight.TRUST: "caution",
    Weight.ASIDE: "info",
}


def of_invert(stage: InvertResult) -> list[Note]:
    """Return the notes of an inversion."""
    found = remarks(stage, Names(stage.naming))
    return [Note(one.kind, _AS_SEVERITY[one.weight], one.sentence) for one in found]


def _of_numbers(stage: InvertResult, names: Names) -> Iterator[Remark]:
    yield from _of_one(stage, names) if stage.joint is None else _of_many(stage.joint, names)
    for part in stage.known:
        yield Remark(" ".join(known(part, stage, names)), Weight.TRUST, KNOWN)


def _of_one(stage: InvertResult, names: Names) -> Iterator[Remark]:
    point = stage.point
    if len(point.solution) > 1:
        one_of_many = (
            "One measured {response} cannot fix {factors} factors: the solution is one point of a whole set, and the "
            "ranges show how far each factor may move along it."
        )
        text = names.say(one_of_many, response=names.response.long, factors=len(point.solution))
        yield Remark(text, Weight.TRUST, "one_of_many")
    if not point.inside:
        outside = (
            "The solution lies {distance:.2f} coded units from the centre, outside the region that the design supports "
            "(radius {radius:.2f}): the surface extrapolates there."
        )
        text = say(outside, distance=point.coded_radius, radius=stage.radius)
        yield Remark(text, Weight.NUMBERS, "solution_outside")


def _of_many(joint: JointFitted, names: Names) -> Iterator[Remark]:
    missed = (
        "The surfaces miss the {count} measured values by at most {error:tenths} %; no point of the region brings the "
        "largest error below {best:tenths} %."
    )
    fields = {"error": joint.max_abs_error_percent, "best": joint.best_worst_error_percent}
    yield Remark(names.say(missed, count=len(joint.rows), **fields), Weight.USE, "surfaces_miss")
    for row in joint.further:
        yield Remark(_also_fitted(row, names), Weight.TRUST, "also_fitted")
    if joint.further:
        independent = "Means of the same specimens are treated as independent."
        yield Remark(say(independent), Weight.TRUST, "independent_means")
    if names.naming.is_cutting and any(row.response == "work" for row in joint.further):
        work = "The work follows from force and travel: fitted with both, it makes the intervals somewhat too narrow."
        yield Remark(say(work), Weight.TRUST, "dependent_work")
    if left_out := _left_out(joint, names):
        yield Remark(" ".join(left_out), Weight.USE, "left_out")
    if joint.null is not None:
        better = joint.null.beaten_by(joint.max_abs_left_out_error_percent)
        weight = Weight.TRUST if better is None else Weight.ASIDE if better else Weight.USE
        yield Remark(_without_mechanics(joint.null, joint), weight, "without_mechanics")
    yield Remark(say(_WEIGHTS[joint.scatter]), Weight.TRUST, "weights")
    if joint.p is not None and joint.p < 0.05:
        wrong = (
            "The misfit is {times:.1f} times what the known scatter explains (p {p:p}): the model is wrong "
            "somewhere, and the intervals are too narrow."
        )
        yield Remark(
            names.say(wrong, times=(joint.misfit or 0.0) / joint.df, p=joint.p), Weight.USE, "misfit_too_large"
        )


def _also_fitted(row: JointRow, names: Names) -> str:
    at = "Also fitted: {response} at {condition:condition}, measured {measured}, surface {predicted} ({error:+.1f} %)."
    plain = "Also fitted: {response}, measured {measured}, surface {predicted} ({error:+.1f} %)."
    named = names.naming.named(row.response)
    return names.say(
        plain if names.naming.condition is None else at,
        response=named.long,
        condition=row.condition,
        measured=names.beside_mean(named, row.measured, row.measured),
        predicted=names.beside_mean(named, row.predicted, row.measured),
        error=row.error_percent,
    )


def _left_out(joint: JointFitted, names: Names) -> list[str]:
    error, condition = joint.max_abs_left_out_error_percent, names.naming.condition
    if error is None:
        return []
    each = "With each {condition} left out in turn, the fit to the others misses it by at most {error:tenths} %."
    response = "With each response left out in turn, the fit to the others misses it by at most {error:tenths} %."
    test = "With each test left out in turn, the fit to the others misses it by at most {error:tenths} %."
    several = condition is not None and len({row.condition for row in joint.rows}) > 1
    tests = any(row.left_out_interval is not None for row in joint.rows)
    template = test if tests else each if several else response
    return [names.say(template, condition=condition.long if condition else "", error=error)]


def _without_mechanics(null: NullModel, joint: JointFitted) -> str:
    """Say what formulas reach without mechanics, and whether the joint fit does better, by what was left out."""
    fields = {
        "count": null.conditions,
        "exponent": null.exponent,
        "error": fixed(null.max_abs_error_percent, 1),
        "left_out": fixed(null.max_abs_left_out_error_percent, 1),
        "fixed_exponent": FIXED_EXPONENT,
        "fixed_error": fixed(null.fixed_max_abs_error_percent, 1),
        "fixed_left_out": fixed(null.fixed_max_abs_left_out_error_percent, 1),
        "joint_error": fixed(joint.max_abs_error_percent, 1),
        "joint_left_out": fixed(joint.max_abs_left_out_error_percent, 1),
    }
    one = (
        "Without mechanics, F = a·d^{fixed_exponent:g} through the same {count} forces misses by at most {fixed_error} "
        "% (left out in turn {fixed_left_out} %), the joint fit by {joint_error} % ({joint_left_out} %)."
    )
    both = (
        "Without mechanics, F = a·d^{exponent:.2f} through the same {count} forces misses by at most {error} % (left "
        "out in turn {left_out} %), F = a·d^{fixed_exponent:g} by {fixed_error} % ({fixed_left_out} %), the joint fit "
        "by {joint_error} % ({joint_left_out} %)."
    )
    judged = {
        None: "Nothing is left out to compare them by.",
        True: "The joint fit predicts the diameters better than a formula.",
        False: "The joint fit predicts the diameters no better than a formula.",
    }
    errors = say(one if null.exponent is None else both, **fields)
    return f"{errors} {say(judged[null.beaten_by(joint.max_abs_left_out_error_percent)])}"


_WEIGHTS = {
    "measured": "Weights: the measured scatter, one coefficient of variation a response, and the error of the surface.",
    "pooled": "Weights: the measured scatter; means without an SD take the coefficient of variation of the others.",
    "misfit": "No SD was given: relative weights are equal, and the misfit of the fit itself gives the scatter.",
    "surface": "No SD was given: the measured values are treated as exact, and only the surface's own error counts.",
}


def _machine_told(note: MachineFound) -> str:
    """Return what is told of the machine: a range, or where no machine is too stiff what it is above at least."""
    return note.of if note.high is not None else "stiff" if note.low is not None else "too stiff"


def _given_range(note: MachineFound, names: Names) -> str:
    return "" if note.low is None or note.high is None else interval((note.low, note.high), 3)


states(
    MachineFound,
    {
        "stiffness": "With the fit to the curves the stiffness of the testing machine is {given} N/mm (95 %), by "
        "`machine` alone {stated:.4g} ± {sd:.3g} N/mm.",
        "stiff": "With the fit to the curves the stiffness of the testing machine is {low:significant 3} N/mm or more "
        "(95 %), by `machine` alone {stated:.4g} ± {sd:.3g} N/mm.",
        "too stiff": "The curves want a testing machine stiffer than a rigid one, by `machine` alone "
        "{stated:.4g} ± {sd:.3g} N/mm.",
        "toe": "With the fit to the curves contact begins {given} mm (95 %) later than the preload, by `toe_sd` alone "
        "0 ± {sd:.3g} mm.",
    },
    by=_machine_told,
    given=_given_range,
)
states(
    MachineContradicted,
    {
        "stiffness": "The curves say that the stiffness of the testing machine is {given} N/mm (95 %); `machine` "
        "allows {stated:.4g} ± {sd:.3g} N/mm. Check `machine` and the start of the sheets.",
        "stiff": "The curves say that the stiffness of the testing machine is {low:significant 3} N/mm or more "
        "(95 %); `machine` allows {stated:.4g} ± {sd:.3g} N/mm. Check `machine` and the start of the sheets.",
        "too stiff": "The curves want a testing machine stiffer than a rigid one; `machine` allows "
        "{stated:.4g} ± {sd:.3g} N/mm. Check `machine` and the start of the sheets.",
        "toe": "The curves say that contact begins {given} mm (95 %) later than the preload; `toe_sd` allows 0 "
        "± {sd:.3g} mm. Check `machine` and the start of the sheets.",
    },
    by=_machine_told,
    given=_given_range,
)
states(
    FreeFactors,
    "The target leaves {factors:factors} free over the whole region.",
)
states(
    SecondSolution,
    "A second solution lies equally far from the centre; the one given has the higher levels.",
)
states(
    PriorUnused,
    "The surface does not vary {factors:factors}: held in the middle of the range, whatever is known beforehand.",
)
states(
    FlatDirection,
    "The measured values do not separate the parameters: {together:all} together change the fit too little to tell. Of "
    "all points that fit about as well the one nearest to the centre of the ranges is taken.",
    together=lambda note, names: [
        change(names.factor(name), size, note.units[name]) for name, size in note.changes.items()
    ],
)
