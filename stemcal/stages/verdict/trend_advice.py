"""Advice for an error that depends on the diameter, computed from the surfaces of a joint fit without further runs.

If a parameter θ grows as θ(d) = θ₀ (d/d₀)ⁿ, the force at each diameter is F_d(θ₀ (d/d₀)ⁿ) on the surface of this
diameter, as long as every level is inside the ranges.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.coding import Coding
from stemcal.doe.comparison import NORMAL
from stemcal.doe.regression.section import AnySurface
from stemcal.notes import Note, Remedy
from stemcal.power_law import PowerLaw, fit_power_law
from stemcal.stages.fitting import Surfaces, fitted_surfaces, measured_means
from stemcal.stages.verdict.verdict_rules import Evidence
from stemcal.study.model.study import Study
from stemcal.study.types.factor import PARAMETERS
from stemcal.study.types.units import fits
from stemcal.vocabulary import DIAMETER, FIRST, Wording

_LEAST_CHANGE = 0.03  # smallest relative change of measured/simulated force over the diameters that counts as a trend
_BETTER = 0.6  # advice must reduce the largest error to this share of the present one
_EXPONENTS = np.arange(-2.0, 2.001, 0.05)
_CLOUD = 8


@dataclass(frozen=True)
class Change:
    """Growth of a factor, θ = `value` (d/d₀)^`exponent`, and the largest error (%) that is predicted with it."""

    factor: str
    value: float
    worst_percent: float
    exponent: float


@dataclass(frozen=True, eq=False)
class Fitted:
    """The surfaces at the diameters (mm) with the measured forces; `at` is the diameter d₀, `solution` is coded."""

    diameters: Array
    measured: Array
    surfaces: Sequence[AnySurface]
    coding: Coding
    region: Region
    at: float
    solution: Array

    @property
    def predicted(self) -> Array:
        """Forces at the solution, (n,)."""
        return np.array([float(surface.predict(self.solution)[0]) for surface in self.surfaces])


def trend_of(
    diameters: Sequence[float],
    measured: Sequence[float],
    simulated: Sequence[float],
    scatter: Sequence[float | None] = (),
) -> PowerLaw | None:
    """Return the power law of measured over simulated force if its exponent is significant, else None.

    It is significant if its 95 % interval excludes 0. If the standard errors of the means are known (`scatter`, %), the
    interval that follows from them must exclude 0 as well. Failed runs are left out.

    >>> d = [7.0, 8.0, 9.0, 10.0, 11.0]
    >>> round(trend_of(d, [x**2.5 for x in d], [x**2.0 for x in d]).exponent, 6)
    0.5
    >>> trend_of(d, [x**2.0 for x in d], [x**2.0 for x in d]) is None
    True
    """
    errors = scatter or [None] * len(diameters)
    rows = [row for row in zip(diameters, measured, simulated, errors, strict=True) if row[1] > 0.0 and row[2] > 0.0]
    law = fit_power_law([row[0] for row in rows], [row[1] / row[2] for row in rows]) if len(rows) > 2 else None
    if law is None or law.exponent_interval is None:
        return None
    diameters = [row[0] for row in rows]
    x = np.log(diameters) - np.mean(np.log(diameters))
    known = np.array([0.01 * (row[3] or 0.0) for row in rows])
    within = NORMAL * float(np.linalg.norm(x * known) / (x @ x))  # half-width of the interval of b = Σ x ln r / Σ x²
    low, high = law.exponent_interval
    change = abs(law.exponent) * float(np.log(max(diameters) / min(diameters)))
    return law if low * high > 0.0 and abs(law.exponent) > within and change >= _LEAST_CHANGE else None


def trend_reason(
    evidence: Evidence,
    rows: Sequence[tuple[float, float, float, float | None]],
    worst_percent: float,
    remedy: Callable[[], Remedy],
) -> Iterator[Note]:
    """Yield a note if the error has a trend with a condition that is a length, such as the diameter.

    `rows` have the condition, the measured and the simulated value, and the standard error (%).
    """
    condition, response = evidence.study.naming.condition, evidence.study.naming.response.noun
    if len(rows) < 3 or condition is None or not fits(condition.unit, "length") or any(row[0] <= 0.0 for row in rows):
        return
    if (law := trend_of(*zip(*rows, strict=True))) is not None:
        how = "more steeply" if law.exponent > 0.0 else "less steeply"
        noun, symbol = ("diameter", "d") if condition == DIAMETER else (f"the {condition.noun}", condition.symbol)
        text = (
            f"The error depends on {noun} {symbol}: the measured {response} increases {how} than the simulated "
            f"{response}, by a factor of {symbol}^{abs(law.exponent):.2f}. The largest error of the simulation is "
            f"{worst_percent:.1f} %."
        )
        yield Note("trend", "error" if evidence.mostly_off else "warning", text, remedy())


def remedies_of(fitted: Fitted, may_grow: Sequence[str]) -> list[Change]:
    """Return the two best changes that reduce the largest error to `_BETTER` of its value, the better one first."""
    changes = [change for name in may_grow if (change := _growing(fitted, name)) is not None]
    most = _BETTER * _worst(fitted.predicted, fitted.measured)
    enough = [change for change in changes if change.worst_percent <= most]
    return sorted(enough, key=lambda change: change.worst_percent)[:2]


def _growing(fitted: Fitted, factor: str) -> Change | None:
    """Return the growth of a parameter that fits all forces best; None if the parameter has no positive levels."""
    from scipy.optimize import minimize

    j, centre, half = fitted.coding.names.index(factor), fitted.coding.centre, fitted.coding.half_step
    points = fitted.region.cloud(_CLOUD)
    points = points[centre[j] + half[j] * points[:, j] > 0.0]
    if not len(points):
        return None

    def placed(x: Array, n: float) -> Array:
        """Return the points at every diameter, (diameters, points, k), with θ (d/d₀)ⁿ instead of θ."""
        at = np.repeat(np.atleast_2d(x)[None], len(fitted.diameters), axis=0)
        level = (centre[j] + half[j] * at[:, :, j]) * (fitted.diameters[:, None] / fitted.at) ** n
        at[:, :, j] = (level - centre[j]) / half[j]
        return at

    def missed(x: Array, n: float) -> Array:
        """Return Σ (1 − F/F_measured)² of each point; infinite where a level leaves the region."""
        at = placed(x, n)
        inside = np.all([fitted.region.contains(part) for part in at], axis=0)
        return np.where(inside, np.sum((1.0 - _forces(fitted, at) / fitted.measured[:, None]) ** 2, axis=0), np.inf)

    each = np.array([missed(points, n) for n in _EXPONENTS])
    row, column = np.unravel_index(int(np.argmin(each)), each.shape)
    if not np.isfinite(each[row, column]):
        return None
    start = np.append(points[column], _EXPONENTS[row])
    steps = np.diag(np.append(-0.1 * np.sign(start[:-1] + 1e-9), 0.05))
    options = {"initial_simplex": np.vstack([start, start + steps]), "xatol": 1e-5, "fatol": 1e-12, "maxiter": 2000}
    best = minimize(lambda z: float(missed(z[:-1], z[-1])[0]), start, method="Nelder-Mead", options=options).x
    forces = _forces(fitted, placed(best[:-1], best[-1]))[:, 0]
    value, worst = float(centre[j] + half[j] * best[j]), _worst(forces, fitted.measured)
    return Change(factor, value, worst, float(best[-1]))


def _forces(fitted: Fitted, at: Array) -> Array:
    return np.array([surface.predict(part) for surface, part in zip(fitted.surfaces, at, strict=True)])


def _worst(forces: Array, measured: Array) -> float:
    return float(100.0 * np.max(np.abs(1.0 - forces / measured)))


def for_trend(study: Study, surface: Surfaces, solution: Mapping[str, float]) -> Remedy:
    """Return the remedy for a trend: the two parameters whose growth removes it best, otherwise things to check."""
    if not study.kind.simulates_stems:
        noun = Wording(study.naming).condition.noun
        return Remedy(
            f"Check which lengths and properties of the simulation change with the {noun}, or add a factor whose "
            f"effect depends on the {noun}."
        )
    means = [(i, mean) for i, mean in enumerate(measured_means(study)) if mean.response == FIRST]
    every = fitted_surfaces(study, surface)
    fitted = Fitted(
        np.array([mean.condition for _, mean in means]),
        np.array([mean.value for _, mean in means]),
        [every[i] for i, _ in means],
        surface.scales,
        replace(surface.region, radius=None),  # levels are limited only by the ranges
        study.calibration_target.condition,
        np.asarray(surface.scales.to_coded([solution[name] for name in surface.names])),
    )
    may_grow = [name for name in surface.names if name in PARAMETERS and name not in study.material.growing()]
    changes, others = remedies_of(fitted, may_grow), _other_stems(study, fitted)
    if not changes:
        return Remedy(
            "Check the wall thickness, the clearance of the supports and the stroke, or vary another parameter. The "
            f"trend cannot be removed by changing a single parameter of the response surface within its range.{others}"
        )
    texts, edits = zip(*(_as_text_and_edit(study, surface, change) for change in changes), strict=True)
    best, *second = texts
    second = [f"Alternatively, {text[0].lower()}{text[1:]}" for text in second]
    return Remedy(f"{' '.join([best, *second])}{others}", edits[0])


def _other_stems(study: Study, fitted: Fitted) -> str:
    """Return advice on fibres and skins, which change the exponent n of the simulated force F ~ dⁿ.

    Simulated for hollow stems of 7 to 11 mm: n = 2.0 (isotropic), 2.4 (yield stress ratio 3), 1.6 (skin of 0.5 mm), 2.5
    (skin of 0.5 mm·(d/8 mm)²).
    """
    if study.is_layered or not study.kind.has_layers:
        return ""
    missing = float(np.polyfit(np.log(fitted.diameters), np.log(fitted.measured / fitted.predicted), 1)[0])
    return (
        f" Compare with stems that do not grow: the exponent of the simulated force is {abs(missing):.2f} too "
        f"{'low' if missing > 0.0 else 'high'}. Fibres (`material: {{transverse: {{yield_stress: 0.33}}}}`) increase "
        "the exponent by about 0.4. A skin (`layers`) increases the exponent by about 0.5 if the thickness of the skin "
        "is proportional to d^2, and decreases it by about 0.4 if the thickness is constant. Measure the skin on "
        "sections."
    )


def _as_text_and_edit(study: Study, surface: Surfaces, change: Change) -> tuple[str, str]:
    """Return a change as a sentence and as YAML with one section per line."""
    at, name, half = study.calibration_target.condition, f"{change.factor}_growth", max(0.5, abs(change.exponent))
    low, high = (round(change.exponent + side * half, 2) for side in (-1, 1))
    edit = [
        f"factors: [{{name: {name}, low: {low:g}, high: {high:g}}}]",
        f"material: {{{change.factor}: {{at: {at:g} mm, exponent: {name}}}}}",
        "screen: {design: none}",
        f"rsm: {{factors: [{', '.join((*surface.names, name))}]}}",
    ]
    text = (
        f"Make {change.factor} proportional to the diameter raised to the power {change.exponent:.2f} (predicted "
        f"largest error: {change.worst_percent:.1f} %). Merge into the spec: `{{{', '.join(edit)}}}`."
    )
    return text, "\n".join(edit)
