"""Remedies with numbers: wider ranges, more data, more runs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.search_region import extremes
from stemcal.formats import outwards, series, with_unit
from stemcal.notes import Remedy
from stemcal.stages.fitting import Surfaces, fitted_surfaces, measured_means
from stemcal.study.model.study import Study
from stemcal.study.types.factor import Factor
from stemcal.study.types.units import convert, fits, from_internal
from stemcal.vocabulary import DIAMETER, FIRST

_WIDEST = 20.0  # largest factor on a level; in a range with levels below zero, largest change in range widths
_INSIDE = 0.85  # share of the radius of the design region within which required levels are placed
_WEAK, _LEAST = 0.1, 1e-3  # share of the largest effect below which one is ignored; least simulated/measured
_CLOUD = 9
_MOST_AVERAGED = 100  # largest number of replicates in a spec


def reach(surface: Surfaces) -> tuple[float, float]:
    """Return the lowest and highest response of a surface inside the factor ranges and the design region."""
    low, high = (surface.fitted.predict(end) for end in extremes(surface.fitted, surface.region))
    return float(low[0]), float(high[0])


def to_reach(study: Study, surface: Surfaces, target: float) -> Remedy:
    """Return the remedy to widen the range of one factor to reach the target; others are at the extreme point."""
    end = extremes(surface.fitted, surface.region)[0 if target < reach(surface)[0] else 1]
    (effects,), (missing,) = _power_laws(study, surface, end)
    steps = missing / np.where(np.abs(effects) > 1e-9, effects, 1e-9)
    j = int(np.argmin(np.abs(steps)))
    remedy = _to_contain(study, surface, end, [step if i == j else 0.0 for i, step in enumerate(steps.tolist())])
    return remedy or widened(study, study.factor(surface.names[j]), bool(steps[j] > 0.0), 0.5)


def from_the_edge(study: Study, surface: Surfaces, coded: Sequence[float], joint: bool) -> Remedy:
    """Return the remedy to extend ranges so that a solution on the edge, or the levels of a `joint` fit, are inside.

    The levels of a joint fit are those at which the power laws reproduce all means best; directions with less than a
    tenth of the largest effect are not used. If these levels are inside, one range is widened by half.
    """
    x = np.asarray(coded)
    steps = np.linalg.lstsq(*_power_laws(study, surface, x), rcond=_WEAK)[0].tolist() if joint else [0.0] * len(x)
    j = int(np.argmax(np.abs(x / np.where(x > 0.0, surface.region.high, -surface.region.low))))
    remedy = _to_contain(study, surface, x, steps)
    return remedy or widened(study, study.factor(surface.names[j]), bool(x[j] > 0.0), 0.5)


def _power_laws(study: Study, surface: Surfaces, start: Array) -> tuple[Array, Array]:
    """Return the effect of each factor on each mean, (n, k), and the missing change of each mean at a point, (n,).

    Both are in logarithms of the response. Each response is described by a power law of the factors, which has the
    value of its surface at the point and is fitted to the surface elsewhere. Factors with levels below zero enter
    linearly. The law is nearly exact for the slope of a test, which is proportional to a modulus.
    """
    cloud = np.vstack([start, surface.region.cloud(_CLOUD)])
    each = zip(map(study.factor, surface.names), surface.scales.to_natural(cloud).T, strict=True)
    steps = np.stack([_scaled(factor, levels) for factor, levels in each], axis=1)
    means = zip(measured_means(study), fitted_surfaces(study, surface), strict=True)
    ratios = [np.log(np.maximum(fitted.predict(cloud) / mean.value, _LEAST)) for mean, fitted in means]
    laws = [np.linalg.lstsq(steps[1:] - steps[0], ratio[1:] - ratio[0], rcond=None)[0] for ratio in ratios]
    return np.array(laws), np.array([-ratio[0] for ratio in ratios])


def _scaled(factor: Factor, levels: Array) -> Array:
    return np.log(levels) if factor.low > 0.0 else levels / (factor.high - factor.low)


def _to_contain(study: Study, surface: Surfaces, start: Array, steps: Sequence[float]) -> Remedy | None:
    """Return the remedy for ranges that contain the levels some `steps` from a point; None if they already do."""
    region, limits = surface.region, list[tuple[Factor, Literal["low", "high"], float]]()
    # largest distance of a level from the middle of its range, in half widths
    most = _INSIDE * min(1.0, surface.radius / float(np.linalg.norm(np.maximum(region.high, -region.low))))
    for name, at, step in zip(surface.names, surface.scales.to_natural(start), steps, strict=True):
        factor = study.factor(name)
        end = float(np.clip(_scaled(factor, at) + step, -300.0, 300.0))
        level = np.exp(end) if factor.low > 0.0 else end * (factor.high - factor.low)
        lowest, highest = _plausible(study, factor)
        if step and not lowest <= level <= highest:
            ends = with_unit(f"{lowest:g} to {highest:g}", factor.unit)
            required = f"{name} = {with_unit(f'{level:.2g}', factor.unit)}, which is not plausible ({ends})"
            return Remedy(f"Check the units, the specimens and the loading: the measured values require {required}.")
        low, high, side = factor.low, factor.high, (level - factor.centre) / factor.half_range
        if step and side > most:
            high = (2.0 * level - low * (1.0 - most)) / (1.0 + most)
        elif step and side < -most:
            low = (2.0 * level - high * (1.0 - most)) / (1.0 + most)
            if factor.low >= 0.0 and low < (least := max(min(0.5 * level, factor.low), lowest)):
                low, high = least, min((2.0 * level - least * (1.0 + most)) / (1.0 - most), high)  # off centre
        limits += [(factor, "low", low)] if low < factor.low else []
        limits += [(factor, "high", high)] if high != factor.high else []
    return _limits(study, limits) if limits else None


def _plausible(study: Study, factor: Factor) -> tuple[float, float]:
    """Return the plausible range of a parameter in the unit of the factor; for other factors, a much wider range."""
    wider, place = _WIDEST * (factor.high - factor.low), study.places.get(factor.name)
    if place is None or not study.kind.simulates_stems or not fits(factor.unit, place.parameter.dimension):
        return (factor.low / _WIDEST if factor.low >= 0.0 else factor.low - wider), factor.high + wider
    low, high = (from_internal(convert(end, place.parameter.unit), factor.unit) for end in place.parameter.plausible)
    return min(low, factor.low), max(high, factor.high)


def widened(study: Study, factor: Factor, up: bool, width: float) -> Remedy:
    """Return the remedy to extend a range upwards or downwards by `width` times its width, if this is plausible."""
    by = width * (factor.high - factor.low)
    return _limits(study, [(factor, "high", factor.high + by) if up else (factor, "low", factor.low - by)])


def _limits(study: Study, limits: Sequence[tuple[Factor, Literal["low", "high"], float]]) -> Remedy:
    """Return the remedy to set limits of factor ranges; if one is not plausible, half-way to the plausible end."""
    texts, edits = [], dict[str, str]()
    for factor, key, limit in limits:
        old, end = getattr(factor, key), _plausible(study, factor)[key == "high"]
        value = outwards(limit if abs(limit - old) < abs(end - old) else 0.5 * (old + end), key == "high")
        if old == end:
            return Remedy(f"Add another factor because the range of {factor.name} cannot be widened.")
        way, written = "raise" if value > old else "lower", with_unit(f"{value:g}", factor.unit)
        texts.append(f"{way} `{key}` of {factor.name} to {written}")
        edits[factor.name] = f"{edits.get(factor.name, f'name: {factor.name}')}, {key}: {value:g}"
    text, rows = series(texts), ", ".join(f"{{{row}}}" for row in edits.values())
    return Remedy(f"{text[:1].upper()}{text[1:]}.", f"factors: [{rows}]")


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
    """Return the remedy to use more runs: four per coefficient, and at least twice those of the design."""
    count = max(4 * len(surface.coefficients), 2 * len(surface.design.runs))
    text = f"Use more runs: `rsm: {{design: latin-hypercube, runs: {count}}}`."
    return Remedy(text, f"rsm: {{design: latin-hypercube, runs: {count}, extra_runs: 0}}")


def measure_more(study: Study) -> Remedy:
    """Return the remedy for a study without held-out values: a further measurement."""
    naming = study.naming
    if naming.condition is None:
        return Remedy("Measure under another condition, or measure a response that is not in `invert.responses`.")
    fewer = ", or remove one value from `invert.diameters`" if len(study.joint_targets) > 1 else ""
    return Remedy(f"Measure at another {naming.condition.long}{fewer}.")


def to_smooth(study: Study, surface: Surfaces, levels: Mapping[str, float] | None) -> Remedy:
    """Return the remedy for a poor quadratic: more runs or smaller ranges, and averages over replicates if possible."""
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
