"""One set of parameters for several measured forces: weighted least squares, and what it is worth.

`leave_one_out` fits without one observation and predicts it; `best_worst_error` is the smallest largest error
that any point of the region gives: no fit can be better than that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stemcal.doe.calibration.levelset import squared_distance
from stemcal.doe.calibration.misfit import Misfit, best_fit
from stemcal.doe.calibration.ridge import least_under, settled
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.regression.least_squares import Array

_CLOUD, _STARTS = 11, 4


@dataclass(frozen=True, eq=False)
class JointFit:
    """The point of least misfit; errors are 100·(measured − predicted)/measured.

    `p_value` is the probability of a misfit as large by the known scatter alone; None where it is not known or
    nothing is left to tell. `flat` are unit vectors (coded) along which the data leave the point free.
    """

    coded: Array
    predicted: Array
    errors_percent: Array
    misfit: float
    df: int
    p_value: float | None
    flat: Array

    @property
    def max_abs_error_percent(self) -> float:
        """The largest error."""
        return float(np.abs(self.errors_percent).max())


def fit_jointly(misfit: Misfit, region: Region) -> JointFit:
    """Find the parameters that fit all observations best, inside the region.

    Where these leave a direction flat, a whole valley does as well: then the point of it nearest to the centre.
    """
    x, flat = settled(misfit, region)
    x = nearest_alike(misfit, region, x) if misfit.df < 0 else x
    least, df = rise_by_priors(misfit, x) if misfit.tests_priors else (misfit.value(x), misfit.df)
    return JointFit(
        coded=x,
        predicted=misfit.predict(x)[0],
        errors_percent=misfit.errors_percent(x),
        misfit=least,
        df=df,
        p_value=chance_of(misfit, x) if misfit.tests or misfit.tests_priors else None,
        flat=flat,
    )


def nearest_alike(misfit: Misfit, region: Region, x: Array) -> Array:
    """Return the point nearest to the centre at which the surfaces predict what they do at `x`, as likely by priors."""

    def of(z: Array) -> Array:
        return np.append(misfit.predict(z)[0] / misfit.measured, [prior.z(z[None])[0] for prior in misfit.priors])

    wanted = of(x)
    same = {
        "type": "eq",
        "fun": lambda z: of(z) - wanted,
        "jac": lambda z: np.vstack([misfit.slopes(z) / misfit.measured[:, None], misfit.told(z)]),
    }
    return least_under(squared_distance(), x, region, same)


def chance_of(misfit: Misfit, x: Array) -> float:
    """Return the probability of a misfit as large at the point of the least: χ², or F where variances were estimated.

    D = rᵀV⁻¹r is a quadratic form in the errors, E = tr(QΩ) on average, Q = V⁻¹ − V⁻¹J(JᵀV⁻¹J)⁻¹JᵀV⁻¹ and Ω each
    observation's own variance. D/E is taken for F with tr(QΩ)²/tr(QΩQΩ) degrees of freedom (G. E. P. Box, Ann. Math.
    Statist. 25 (1954) 290) over Satterthwaite's of E. With Ω = V these are D/df and df.
    """
    from scipy.special import chdtrc, fdtrc

    least = misfit.value(x)
    if misfit.tests_priors:
        rise, count = rise_by_priors(misfit, x)
        return float(fdtrc(count, misfit.scale_df, rise / count))
    if not np.isfinite(misfit.scale_df):
        return float(chdtrc(misfit.df, least))
    expected, form_df, df = misfit.moments(x)
    return float(fdtrc(form_df, df, least / expected))


def rise_by_priors(misfit: Misfit, x: Array) -> tuple[float, int]:
    """Return by how much priors raise the least misfit of data that gave their own scatter, and the number of priors.

    Without them it equals its degrees of freedom.
    """
    return max(misfit.value(x) - misfit.scale_df, 0.0), len(misfit.priors)


def leave_one_out(misfit: Misfit, region: Region, groups: Sequence[object] | None = None) -> list[float]:
    """Return the error at each observation, predicted by a fit to the others (empty for a single one).

    With `groups`, one label per observation, a fit leaves out all observations of a group.
    """
    labels = list(range(len(misfit.observations))) if groups is None else list(groups)
    if len(set(labels)) < 2:
        return []
    errors: dict[int, float] = {}
    for group in dict.fromkeys(labels):
        members = [i for i, label in enumerate(labels) if label == group]
        found = misfit.errors_percent(best_fit(misfit.without(*members), region))
        errors |= {i: float(found[i]) for i in members}
    return [errors[i] for i in range(len(labels))]


def best_worst_error(misfit: Misfit, region: Region) -> tuple[float, Array]:
    """Return the smallest largest |error| in the region, per cent, and the point of it.

    Minimises t over (x, t) with −t ≤ errorᵢ(x) ≤ t, from the best of the points that fill the region.
    """
    cloud = region.cloud(_CLOUD)
    worst = np.abs(100.0 * (misfit.measured - misfit.predict(cloud)) / misfit.measured).max(axis=1)
    order = np.argsort(worst, kind="stable")
    found = [(float(worst[order[0]]), cloud[order[0]])]
    found += [_pressed(misfit, region, cloud[i], float(worst[i])) for i in order[:_STARTS]]
    return min(found, key=lambda pair: pair[0])


def _pressed(misfit: Misfit, region: Region, start: Array, worst: float) -> tuple[float, Array]:
    """Press the largest error down from one start: SLSQP over (x, t)."""
    from scipy.optimize import minimize

    only_t = np.append(np.zeros(region.k), 1.0)
    result = minimize(
        lambda z: z[-1],
        np.append(start, worst),
        jac=lambda z: only_t,
        method="SLSQP",
        bounds=[*zip(*region.bounds(), strict=True), (0.0, None)],
        constraints=_rules(misfit, region),
    )
    x = region.nearest(np.asarray(result.x[:-1], dtype=float))
    return float(np.abs(misfit.errors_percent(x)).max()), x


def _rules(misfit: Misfit, region: Region) -> list[dict[str, Any]]:
    """Return t ± errorᵢ(x) ≥ 0, and |x| ≤ radius if there is one, as SLSQP takes them."""

    def room(z: Array) -> Array:
        errors = misfit.errors_percent(z[:-1])
        return np.concatenate([z[-1] + errors, z[-1] - errors])

    def slopes(z: Array) -> Array:
        slope = -100.0 * misfit.slopes(z[:-1]) / misfit.measured[:, None]
        return np.vstack([np.column_stack([sign * slope, np.ones(len(slope))]) for sign in (1.0, -1.0)])

    return [{"type": "ineq", "fun": room, "jac": slopes}, *region.rules(more=1)]
