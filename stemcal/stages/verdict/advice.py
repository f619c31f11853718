"""Remedies with numbers: wider ranges, more data, more runs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.region import extremes
from stemcal.formats import outwards, series
from stemcal.notes import Note, Remedy
from stemcal.stages.fitting import Surfaces
from stemcal.stages.result import StageResult
from stemcal.stages.verdict import words
from stemcal.study.model.study import Study
from stemcal.study.types.factor import Factor
from stemcal.vocabulary import DIAMETER, FIRST, Wording

# A range is widened by at most _WIDEST times its width; the target is passed by _BEYOND of the missing distance.
_WIDEST, _BEYOND = 20.0, 0.25
_CLOUD = 9
_MOST_AVERAGED = 100  # largest number of replicates in a spec


def formula_reason(result: StageResult) -> Iterator[Note]:
    """Yield a reason if a formula F = a·dᵇ predicts better than the model, by more than the scatter of the means."""
    prediction = result.prediction
    if prediction is not None and prediction.better == "formula":
        within = "Use the parameters only within the range of the measured diameters"
        remedy = Remedy(f"{within}, or add another kind of test (the `tests` section).")
        yield Note("no_better_than_formula", "warning", words.predicted(prediction, Wording(result.naming)), remedy)


def reach(surface: Surfaces) -> tuple[float, float]:
    """Return the lowest and highest response of a surface within ranges, design region and constraints."""
    low, high = (surface.fitted.predict(end) for end in extremes(surface.fitted, surface.region))
    return float(low[0]), float(high[0])


def to_reach(study: Study, surface: Surfaces, target: float) -> Remedy:
    """Return the remedy to widen the range of one factor so that the target is within reach.

    From its extreme point the surface is extrapolated as a plane, F = F* + g·(x − x*). The new range is the smallest
    for which the plane passes the target by a quarter of the missing distance, inside the design region of the new
    range.
    """
    end = extremes(surface.fitted, surface.region)[0 if target < reach(surface)[0] else 1]
    remedies = [
        (width, widened(factor, up, width))
        for factor in map(study.factor, surface.names)
        for up in (True, False)
        if (width := _least_width(surface, end, factor, up, target)) is not None
    ]
    if remedies:
        return min(remedies, key=lambda entry: entry[0])[1]
    fixed = ", loading and specimen" if study.naming.is_cutting else " and fixed values of the simulation"
    return Remedy(
        f"Check the units{fixed}: the target cannot be reached by widening the range of any single factor "
        f"({series(surface.names)})."
    )


def widened(factor: Factor, up: bool, width: float) -> Remedy:
    """Return the remedy to extend a range upwards or downwards by `width` times its width, as far as physics allows."""
    width = (width if up else min(width, _above_zero(factor))) * (factor.high - factor.low)
    end = factor.high + width if up else factor.low - width
    value, key = outwards(end, up), "high" if up else "low"
    written = f"{value:g} {factor.unit}".removesuffix(" 1")
    change = f"{'Raise' if up else 'Lower'} `{key}` of {factor.name} to {written}."
    return Remedy(change, f"factors: [{{name: {factor.name}, {key}: {value:g}}}]")


def _least_width(surface: Surfaces, end: Array, factor: Factor, up: bool, target: float) -> float | None:
    """Return the required extension of a range in units of its width; None if no reasonable extension is enough."""
    at_end, slope = float(surface.fitted.predict(end)[0]), surface.fitted.gradient(end)
    missing = target - at_end
    goal, side = missing * (1.0 + _BEYOND), 1.0 if missing > 0.0 else -1.0
    region, j = surface.region, surface.names.index(factor.name)
    low, high, inside = region.low, region.high, region.cloud(_CLOUD)

    def gained(width: float) -> float:
        """Return the largest change of the plane towards the target, in the design region of the wider range."""
        stretch, shift = np.ones(len(slope)), np.zeros(len(slope))
        stretch[j], shift[j] = 1.0 + width, (1.0 if up else -1.0) * 0.5 * width * (high[j] - low[j])
        return float(np.max(side * ((inside * stretch + shift - end) @ slope)))

    from scipy.optimize import brentq

    most, wanted = _WIDEST if up else min(_WIDEST, _above_zero(factor)), side * goal
    if most <= 0.0 or gained(most) < wanted:
        return None
    return 0.0 if gained(0.0) >= wanted else float(brentq(lambda width: gained(width) - wanted, 0.0, most))


def _above_zero(factor: Factor) -> float:
    """Return the largest extension of a range downwards: a positive limit stays above a tenth of its present value."""
    return _WIDEST if factor.low < 0.0 else 0.9 * factor.low / (factor.high - factor.low)


def from_the_edge(study: Study, surface: Surfaces, coded: Sequence[float]) -> Remedy:
    """Return the remedy to widen a range by half, so that a solution on the edge is inside."""
    region = surface.region
    place = np.asarray(coded) / np.where(np.asarray(coded) > 0.0, region.high, -region.low)
    order = np.argsort(-np.abs(place), kind="stable")
    for j in order:
        factor, up = study.factor(surface.names[j]), bool(coded[j] > 0.0)
        if up or _above_zero(factor) >= 0.5:
            return widened(factor, up, 0.5)
    return Remedy(f"Add another factor because the range of {surface.names[order[0]]} cannot be widened.")


def fit_all(study: Study, over: str, then: str = "") -> Remedy:
    """Return the remedy to fit all ``responses``, or all ``conditions``, together."""
    key = "responses" if over == "responses" else "diameters"
    edit = f"invert: {{{key}: all}}"
    many = key if study.naming.condition == DIAMETER else "conditions"
    what = "all measured responses" if over == "responses" else f"the responses at all measured {many}"
    unknown = []  # responses without any standard deviation, which cannot be fitted
    for named in study.naming.responses if over == "responses" else ():
        name = FIRST if named == study.naming.response else named.name
        scatters = [sd for mean, sd in (target.mean_of(name) for target in study.targets.means) if mean is not None]
        if scatters and all(sd is None for sd in scatters):
            unknown.append(named.noun)
    if unknown:
        first = f"Add the standard deviation (`sd`) of the {series(unknown)} to `targets`. Then fit {what} jointly"
        return Remedy(f"{first} (`{edit}`). {then}".rstrip())
    return Remedy(f"Fit {what} jointly (`{edit}`). {then}".rstrip(), edit)


def more_runs(surface: Surfaces) -> Remedy:
    """Return the remedy to use four times as many runs as coefficients, or twice the runs of the design."""
    count = max(4 * len(surface.coefficients), 2 * len(surface.design.runs))
    text = f"Use more runs: `rsm: {{design: latin-hypercube, runs: {count}}}`."
    return Remedy(text, f"rsm: {{design: latin-hypercube, runs: {count}, extra_runs: 0}}")


def measure_more(study: Study) -> Remedy:
    """Return the remedy for a study without a check by held-out values."""
    naming = study.naming
    if naming.condition is None:
        return Remedy("Measure under another condition, or measure a response that is not in `invert.responses`.")
    fewer = ", or remove one value from `invert.diameters`" if len(study.joint_targets) > 1 else ""
    return Remedy(f"Measure at another {naming.condition.long}{fewer}.")


def to_smooth(study: Study, surface: Surfaces, levels: Mapping[str, float] | None) -> Remedy:
    """Return the remedy for a poor quadratic: more runs, else half the ranges; and averaging of a rough response."""
    if len(surface.design.runs) < 4 * len(surface.coefficients) or levels is None:
        remedy = more_runs(surface)
    else:
        halves = {}
        for name in surface.names:
            factor = study.factor(name)
            quarter = 0.25 * (factor.high - factor.low)
            middle = min(max(levels[name], factor.low + quarter), factor.high - quarter)
            halves[name] = f"{middle - quarter:.4g}", f"{middle + quarter:.4g}"
        ranges = series(f"{name} {low} to {high}" for name, (low, high) in halves.items())
        text = f"Halve the factor ranges around the solution ({ranges}), or add `refine: {{}}`."
        edits = ", ".join(f"{{name: {name}, low: {low}, high: {high}}}" for name, (low, high) in halves.items())
        remedy = Remedy(text, f"factors: [{edits}]")
    by_mesh = study.kind.replicates == "mesh"
    if not (study.solver.repeats or by_mesh):
        return remedy
    replicates, over = min(max(5, 2 * study.solver.repeats), _MOST_AVERAGED), "mesh positions" if by_mesh else "seeds"
    average = f"If the response is not smooth, average over {over} with `replicates: {replicates}`."
    return replace(remedy, text=f"{remedy.text} {average}")
