"""Remedies with numbers: ranges that contain the target, settings that bring doubtful physics below its limits."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import floor, log10

import numpy as np

from stemcal.doe.regression.least_squares import Array
from stemcal.naming import DIAMETER, FIRST, Names
from stemcal.note import Remedy
from stemcal.stages.fitting import joint_surfaces, measured_means
from stemcal.stages.invert.options import InvertOptions
from stemcal.stages.invert.result import Certainty, JointFitted
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.verdict.physics import LIMITS, Doubt, DoubtKind
from stemcal.stages.verdict.trend import Fitted, Growing, Widened, remedies_of
from stemcal.study.model import PARAMETERS, Factor, Study
from stemcal.study.types.solver_kind import Explicit
from stemcal.words import series

# A range is widened by at most this multiple of its width, and beyond the target by this part of the missing distance.
_WIDEST, _BEYOND = 20.0, 0.25
_CLOUD = 9
_MOST_AVERAGED = 100  # replicates that a spec may ask for
# What has to fall below a limit is aimed at this part of it: runs of one study scatter about their mean.
_SAFELY = 0.5
# Finer elements are recommended up to this many times the time of a run.
_MOST_TIMES = 12.0


def reach(surface: SurfaceResult, study: Study) -> tuple[float, float]:
    """Return the least and the greatest response of a surface within ranges, design region and constraints."""
    from stemcal.doe.calibration.region import extremes

    low, high = (surface.fitted.predict(end) for end in extremes(surface.fitted, surface.region(study)))
    return float(low[0]), float(high[0])


def to_reach(study: Study, surface: SurfaceResult, target: float) -> Remedy:
    """Return by which factor alone, widened how far, the target would come within reach.

    The surface is continued from its extreme point as a plane, F = F* + g·(x − x*); the new range is the first for
    which the plane passes the target by a quarter of what was missing, inside the design region of the new range.
    """
    from stemcal.doe.calibration.region import extremes

    end = extremes(surface.fitted, surface.region(study))[0 if target < reach(surface, study)[0] else 1]
    found = [
        (width, _widened(factor, up, width))
        for factor in map(study.factor, surface.names)
        for up in (True, False)
        if (width := _least_width(study, surface, end, factor, up, target)) is not None
    ]
    if found:
        return min(found, key=lambda entry: entry[0])[1]
    fixed = "loading and specimen" if study.naming.is_cutting else "the fixed values of the simulation"
    return Remedy(f"Widening only one range ({series(surface.names)}) cannot include it; check the units and {fixed}.")


def _widened(factor: Factor, up: bool, width: float) -> Remedy:
    """Return the new end of a range that grows upwards or downwards by `width` times its own width."""
    end = factor.high + width * (factor.high - factor.low) if up else factor.low - width * (factor.high - factor.low)
    value, key = _outwards(end, up), "high" if up else "low"
    written = f"{value:g} {factor.unit}".removesuffix(" 1")
    change = f"{'Raise' if up else 'Lower'} `{key}` of {factor.name} to about {written}."
    return Remedy(change, f"factors: [{{name: {factor.name}, {key}: {value:g}}}]")


def _outwards(value: float, up: bool) -> float:
    """Round away from the range to two digits.

    >>> _outwards(44.2, True), _outwards(0.0373, False), _outwards(0.0, False)
    (45.0, 0.037, 0.0)
    """
    if value == 0.0:
        return 0.0
    step = 10.0 ** (floor(log10(abs(value))) - 1)
    return float(f"{(np.ceil if up else np.floor)(round(value / step, 6)) * step:.6g}")


def _least_width(
    study: Study, surface: SurfaceResult, end: Array, factor: Factor, up: bool, target: float
) -> float | None:
    """Return by how much of its width a range has to grow; None where no sensible width does."""
    at_end, slope = float(surface.fitted.predict(end)[0]), surface.fitted.gradient(end)
    missing = target - at_end
    goal, side = missing * (1.0 + _BEYOND), 1.0 if missing > 0.0 else -1.0
    region, j = surface.region(study), surface.names.index(factor.name)
    low, high, inside = region.low, region.high, region.cloud(_CLOUD)

    def gained(width: float) -> float:
        """What the plane gains within the design region of the new range, of which coded points are the old ones."""
        stretch, shift = np.ones(len(slope)), np.zeros(len(slope))
        stretch[j], shift[j] = 1.0 + width, (1.0 if up else -1.0) * 0.5 * width * (high[j] - low[j])
        return float(np.max(side * ((inside * stretch + shift - end) @ slope)))

    most = _WIDEST if up else min(_WIDEST, _above_zero(factor))
    return _first(lambda width: gained(width) >= side * goal, most)


def _above_zero(factor: Factor) -> float:
    """Return how far a range may grow downwards: what is positive stays above a tenth of its low end."""
    return _WIDEST if factor.low < 0.0 else 0.9 * factor.low / (factor.high - factor.low)


def _first(enough: Callable[[float], bool], most: float) -> float | None:
    """Return the least width that is enough, by halving."""
    if most <= 0.0 or not enough(most):
        return None
    low, high = 0.0, most
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def from_the_edge(study: Study, surface: SurfaceResult, coded: Sequence[float]) -> Remedy:
    """Return which range to widen by half, so that a solution on the edge of the region is inside."""
    region = surface.region(study)
    place = np.asarray(coded) / np.where(np.asarray(coded) > 0.0, region.high, -region.low)
    order = np.argsort(-np.abs(place), kind="stable")
    for j in order:
        factor, up = study.factor(surface.names[j]), bool(coded[j] > 0.0)
        if up or _above_zero(factor) >= 0.5:
            return _widened(factor, up, 0.5)
    end = surface.names[order[0]]
    return Remedy(f"Add another factor: {end} is at the end of its possible range.")


def to_identify(study: Study, known: Certainty) -> Remedy:
    """Return what would identify factors that the fit leaves free: other data, or a prior of the least certain one."""
    widest = max(known.not_identified or known.share, key=lambda name: known.share[name])
    measure = f"measure another response or another kind of test, or give {widest} a prior from the literature."
    left_out = [name for name in ("travel", "work", *study.own_further) if name not in study.fitted_responses]
    if any(study.calibration_target.mean_of(name)[0] is not None for name in left_out):
        return fit_all(study, "responses", f"If that is not enough, {measure}")
    if len(study.targets.means) > max(len(study.joint_targets), 1) and not chose_conditions(study):
        return fit_all(study, "conditions", f"If that is not enough, {measure}")
    return Remedy(measure[:1].upper() + measure[1:])


def for_trend(study: Study, surface: SurfaceResult, solution: Mapping[str, float]) -> Remedy:
    """Return the two changes that remove an error that follows the diameter best, with their predicted errors."""
    means = [(i, mean) for i, mean in enumerate(measured_means(study)) if mean.response == FIRST]
    every = joint_surfaces(study, surface)
    fitted = Fitted(
        np.array([mean.condition for _, mean in means]),
        np.array([mean.value for _, mean in means]),
        [every[i] for i, _ in means],
        surface.scales,
        replace(surface.region(study), radius=None),  # levels inside the ranges, corners included
        study.calibration_target.condition,
        np.asarray(surface.scales.to_coded([solution[name] for name in surface.names])),
    )
    may_grow = [name for name in surface.names if name in PARAMETERS and name not in study.material.growing()]
    found = remedies_of(fitted, may_grow)
    if not found:
        return Remedy(
            "No parameter of the surface can remove it within its range. Check wall thickness, gap and stroke; then "
            "vary another parameter."
        )
    each = [_for_trend(study, surface, one) for one in found]
    texts = [f"{text}: `{{{', '.join(edit)}}}`." for text, edit in each]
    second = [f"Or {text[:1].lower()}{text[1:]}" for text in texts[1:]]
    return Remedy(" ".join([texts[0], *second]), "\n".join(each[0][1]))


def _for_trend(study: Study, surface: SurfaceResult, found: Growing | Widened) -> tuple[str, list[str]]:
    """Return a change in words and as YAML, by section."""
    left = f"predicted largest error {found.worst_percent:.1f} %"
    if isinstance(found, Widened):
        factor, up = study.factor(found.factor), found.value > study.factor(found.factor).centre
        value, key = _outwards(found.value, up), "high" if up else "low"
        change = f"{'Raise' if up else 'Lower'} `{key}` of {found.factor} to {value:g} {factor.unit}".removesuffix(" 1")
        return f"{change} ({left})", [f"factors: [{{name: {found.factor}, {key}: {value:g}}}]"]
    at, name = study.calibration_target.condition, f"{found.factor}_growth"
    half = max(0.5, abs(found.exponent))
    low, high = (round(found.exponent + side * half, 2) for side in (-1, 1))
    edit = [
        f"factors: [{{name: {name}, low: {low:g}, high: {high:g}}}]",
        f"material: {{{found.factor}: {{at: {at:g} mm, exponent: {name}}}}}",
        "screen: {design: none}",
        f"rsm: {{factors: [{', '.join((*surface.names, name))}]}}",
    ]
    return f"Make {found.factor} grow with the diameter, exponent about {found.exponent:.2f} ({left})", edit


def fit_all(study: Study, over: str, then: str = "") -> Remedy:
    """Return the remedy to fit all ``responses``, or all ``conditions``, together."""
    key = "responses" if over == "responses" else "diameters"
    edit = f"invert: {{{key}: all}}"
    many = key if study.naming.condition == DIAMETER or over == "responses" else "conditions"
    return Remedy(f"`{edit}` fits all measured {many} together. {then}".rstrip(), edit)


def chose_conditions(study: Study) -> bool:
    """Whether the spec lists the conditions to fit: no advice undoes that choice."""
    return study.of(InvertOptions).conditions not in (None, "all")


def to_reconcile(study: Study, joint: JointFitted) -> Remedy:
    """Return the remedy for measurements that the model cannot reproduce together."""
    conditions = {row.condition for row in (*joint.rows, *joint.further)}
    apart = joint.contradiction
    if len(conditions) > 1 and apart is not None:
        name, at = study.naming.named(apart.response).long, Names(study.naming).at(apart.condition)
        return Remedy(
            f"Check the measured {name}{at} (its unit, specimens and machine) and measure it again. If it is "
            "confirmed, the model lacks a mechanism: add a factor that acts there."
        )
    if len(conditions) > 1:
        return Remedy("Check the measurements; if they are confirmed, the model lacks a mechanism: add a factor.")
    return Remedy(
        "Check these measurements; then add another factor or fit fewer responses (`invert.responses`): the model "
        "cannot reproduce all measurements together."
    )


def more_runs(study: Study, surface: SurfaceResult) -> Remedy:
    """Return four times as many runs as coefficients, spread over the ranges, where the design has fewer.

    If the design has them already, the remedy halves the ranges about the solution.
    """
    count = max(4 * len(surface.coefficients), 2 * len(surface.design.runs))
    text = f"Use more runs: `rsm: {{design: latin-hypercube, runs: {count}}}`."
    return Remedy(text, f"rsm: {{design: latin-hypercube, runs: {count}, extra_runs: 0}}")


def to_follow(study: Study, surface: SurfaceResult, levels: Mapping[str, float] | None) -> Remedy:
    """Return what makes a quadratic follow the response: more runs, then half the ranges about the solution."""
    few = len(surface.design.runs) < 4 * len(surface.coefficients)
    if few or levels is None:
        return more_runs(study, surface)
    edits = []
    for name in surface.names:
        factor = study.factor(name)
        quarter = 0.25 * (factor.high - factor.low)
        middle = min(max(levels[name], factor.low + quarter), factor.high - quarter)
        edits.append(f"{{name: {name}, low: {middle - quarter:.4g}, high: {middle + quarter:.4g}}}")
    return Remedy("Halve the ranges around the solution, or add `refine: {}`.", f"factors: [{', '.join(edits)}]")


def measure_more(study: Study) -> Remedy:
    """Return the remedy for a result that nothing checks."""
    naming = study.naming
    if naming.condition is None:
        return Remedy("Measure under another condition, or measure a response that is not in `invert.responses`.")
    other = f"Measure at another {naming.condition.long}"
    fewer = ", or leave one out of `invert.diameters`" if len(study.joint_targets) > 1 else ""
    return Remedy(f"{other}{fewer}.")


_INPUT: dict[DoubtKind, str] = {
    "inertia": "less mass scaling or a slower blade",
    "hourglass": "a finer mesh or fully integrated elements",
    "drift": "a smaller time step",
    "stroke": "a longer stroke",
}


def for_physics(study: Study, doubt: Doubt) -> Remedy:
    """Return what would bring a doubt below its limit."""
    solver = study.solver.explicit
    if solver is None:
        return Remedy(f"Correct the input of the solver: use {_INPUT[doubt.kind]}.")
    match doubt.kind:
        case "inertia":
            return _inertia(solver, doubt.worst or 0.0)
        case "hourglass":
            return _hourglass(solver, doubt.worst or 0.0)
        case "drift":
            return _half_the_step(solver)
        case "stroke":
            ((key, value),) = study.loading.longer(2.0).written.items()
            return Remedy(f"`{key}: {value}` under `loading` doubles the stroke.", _edit("loading", **{key: value}))


def _edit(section: str, **values: str) -> str:
    """Return keys of a section as a YAML fragment.

    >>> _edit("solver", mass_scaling="2000", time_step="17 us")
    'solver: {mass_scaling: 2000, time_step: 17 us}'
    """
    return f"{section}: {{{', '.join(f'{key}: {value}' for key, value in values.items())}}}"


def _in_solver(values: Mapping[str, str], effect: str) -> Remedy:
    """Return the remedy to set keys of the solver, whose effect follows them in the text."""
    keys = series(f"`{key}: {value}`" for key, value in values.items())
    return Remedy(f"{keys} under `solver` {effect}", _edit("solver", **values))


def _inertia(solver: Explicit, worst: float) -> Remedy:
    """Return mass scaling and time step at which the oscillation that the blade excites is well below the limit.

    A body of stiffness k and mass m that is struck at the speed V oscillates with the force V √(k m): the share falls
    with the root of the mass, and the mass that a time step asks for goes with its square.
    """
    limit = LIMITS["inertia"]
    swing = _SAFELY * limit / worst
    scaling = _outwards(max(solver.mass_scaling * swing**2, 1.0), False)
    values = {"mass_scaling": f"{scaling:g}", **_time_step(solver, swing)}
    times = _outwards(1.0 / swing, True)
    return _in_solver(
        values, f"reduces inertia below {limit:g} % in most runs, but takes about {times:g} times as long."
    )


def to_smooth(study: Study, surface: SurfaceResult, levels: Mapping[str, float] | None) -> Remedy:
    """Return how a rough response is averaged, or a curved one followed."""
    found = to_follow(study, surface, levels)
    by_mesh = study.kind.replicates == "mesh"
    if study.replicates or by_mesh:
        replicates = min(max(5, 2 * study.replicates), _MOST_AVERAGED)
        over = "mesh positions" if by_mesh else "seeds"
        return Remedy(
            f"{found.text} If the response is rough, `replicates: {replicates}` averages over {over}.", found.edit
        )
    return found


def _half_the_step(solver: Explicit) -> Remedy:
    """Return half the safety factor; a fixed time step, which adds mass, has to be halved as well."""
    safety = _outwards(0.5 * solver.time_step_safety, False)
    values = {"time_step_safety": f"{safety:g}", **_time_step(solver, 0.5)}
    return _in_solver(values, "halves the time step.")


def _time_step(solver: Explicit, part: float) -> dict[str, str]:
    """Return a part of the time step if it is fixed, rounded down."""
    if solver.time_step is None:
        return {}
    return {"time_step": f"{_outwards(1e6 * solver.time_step * part, False):g} us"}


def _hourglass(solver: Explicit, worst: float) -> Remedy:
    """Return elements so fine that hourglass energy, which falls at least with their size, is below the limit.

    Elements finer by a are a³ in number, and their steps 1/a as long; a fixed time step has to follow.
    """
    limit, size = LIMITS["hourglass"], solver.element_size
    finer = worst / limit
    if finer**4 > _MOST_TIMES:
        return Remedy(f"Use much finer elements or another mesh: {worst:.0f} % is {finer:.1f} times the limit.")
    new = f"d/{np.ceil(finer * size.divisor):g}" if size.divisor else f"{_outwards(size.mm / finer, False):g} mm"
    values = {"element_size": new, **_time_step(solver, 1.0 / finer)}
    return _in_solver(
        values, f"may reduce it below {limit:g} %, but takes about {_outwards(finer**4, True):g} times as long."
    )
