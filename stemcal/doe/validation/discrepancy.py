"""What the model misses over the diameters: measured = ρ·simulated·exp(δ(d)), as one scale or as a smooth process.

A discrepancy after M. C. Kennedy and A. O'Hagan, J. R. Statist. Soc. B 63 (2001) 425–464, over the condition, in the
logarithms y = ln(measured/simulated) of the fitted diameters; the scatter of the laboratory is in it too.

    scale      y = ln ρ + ε, every diameter by itself
    process    y = β + Z(d) + ε with cov Z = σ²(1 − g)·exp(−½((d − d')/ℓ)²) and var ε = σ²g. The mean is integrated out,
               so is σ² (Student's t), ℓ and g over a grid by their likelihood: so few diameters fix neither

A force predicted at a diameter lies with 95 % within the interval; a fitted diameter is predicted from the others.

The forces were fitted before, and each direction of the parameters that they see takes a degree of freedom from what is
left: with q of them σ² has m − q, and one more force lies as far off as the fit of level and (q ≥ 2) growth lets it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, log, sqrt

import numpy as np

from stemcal.doe.regression.least_squares import Array, t_quantile
from stemcal.files.typed import absent

FEWEST = 3
# Lengths in units of the mean distance of two diameters, and shares of the variance that no neighbour tells.
_LENGTHS, _SHARES = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0), (0.02, 0.1, 0.3, 0.6, 0.9, 0.98)


@dataclass(frozen=True)
class Discrepancy:
    """The scale ρ of so many fitted diameters, and the standard deviation about it, percent.

    Where `smooth`, a process over the diameters predicts, not the scale alone.
    """

    scale: float
    sd_percent: float
    conditions: int
    smooth: bool = absent(False)


@dataclass(frozen=True)
class ScaledPrediction:
    """A force, or other response, predicted with the scale, and where a measured one lies with 95 %."""

    response: float
    interval: tuple[float, float]


def needed(seen: int) -> int:
    """Return how many fitted diameters it takes: left out one, the others have a degree of freedom."""
    return max(FEWEST, seen + 2)


def discrepancy(ratios: Mapping[float, float], seen: int = 1, smooth: bool = False) -> Discrepancy | None:
    """Return the scale of measured over simulated forces by diameter; None of too few.

    `seen` counts the directions of the parameters that were fitted to these forces, at least one.

    >>> found = discrepancy({7.0: 1.0, 8.0: 1.1, 9.0: 1.21})
    >>> round(found.scale, 6), round(found.sd_percent, 3)
    (1.1, 9.531)
    """
    if len(ratios) < needed(seen):
        return None
    logs = np.log(list(ratios.values()))
    spread = float(((logs - logs.mean()) ** 2).sum() / (logs.size - seen))
    return Discrepancy(exp(float(logs.mean())), 100.0 * sqrt(spread), logs.size, smooth)


def corrected(
    simulated: float,
    condition: float,
    ratios: Mapping[float, float],
    seen: int = 1,
    smooth: bool = False,
    level: float = 0.95,
) -> ScaledPrediction | None:
    """Return the prediction of a measured force by the ratios at other diameters; None of too few."""
    if len(ratios) < needed(seen) - 1:
        return None
    d, logs = np.array(list(ratios)), np.log(list(ratios.values()))
    low, middle, high = (_by_process if smooth else _by_scale)(d, logs, condition, seen, level)
    return ScaledPrediction(simulated * exp(middle), (simulated * exp(low), simulated * exp(high)))


def _fitted(d: Array | float, seen: int) -> Array:
    """Return what a fit before has taken out: the level, and where it saw two directions the growth too."""
    ln = np.log(np.atleast_1d(d))
    return np.column_stack([np.ones_like(ln), ln])[:, : min(seen, 2)]


def _by_scale(d: Array, logs: Array, at: float, seen: int, level: float) -> tuple[float, float, float]:
    x, new = _fitted(d, seen), _fitted(at, seen)[0]
    df, middle = logs.size - seen, float(logs.mean())
    spread = float(((logs - middle) ** 2).sum() / df)
    reach = t_quantile(level, df) * sqrt(spread * (1.0 + float(new @ np.linalg.inv(x.T @ x) @ new)))
    return middle - reach, middle, middle + reach


def _by_process(d: Array, logs: Array, at: float, seen: int, level: float) -> tuple[float, float, float]:
    """Return the quantiles of the mixture of Student's t over the grid of ℓ and g."""
    from scipy.optimize import brentq
    from scipy.special import logsumexp, stdtr

    df = float(logs.size - seen)
    step = float(np.ptp(d)) / max(d.size - 1, 1)
    known = np.array([_kriged(d, logs, at, seen, step * length, g) for length in _LENGTHS for g in _SHARES])
    weight = np.exp(known[:, 0] - logsumexp(known[:, 0]))
    middles, errors = known[:, 1], np.sqrt(known[:, 2])
    ends = float((middles - 1e3 * errors).min()), float((middles + 1e3 * errors).max())

    def quantile(share: float) -> float:
        return float(brentq(lambda y: float(weight @ stdtr(df, (y - middles) / errors)) - share, *ends))

    tail = 0.5 * (1.0 - level)
    return quantile(tail), float(weight @ middles), quantile(1.0 - tail)


def _kriged(d: Array, logs: Array, at: float, seen: int, length: float, g: float) -> tuple[float, float, float]:
    """Return the log likelihood of ℓ and g, and prediction and its variance at a diameter (universal kriging)."""
    k = (1.0 - g) * np.exp(-0.5 * ((d[:, None] - d) / length) ** 2) + g * np.eye(d.size)
    to = (1.0 - g) * np.exp(-0.5 * ((d - at) / length) ** 2)
    x, new = _fitted(d, seen), _fitted(at, seen)[0]
    inverse = np.linalg.inv(k)
    information = x.T @ inverse @ x
    beta = np.linalg.solve(information, x.T @ inverse @ logs)
    rest, missed = logs - x @ beta, new - x.T @ inverse @ to
    squares = max(float(rest @ inverse @ rest), np.finfo(float).tiny)
    size = np.linalg.slogdet(k)[1] + np.linalg.slogdet(information)[1]
    likelihood = -0.5 * (size + (d.size - x.shape[1]) * log(squares))
    variance = 1.0 - float(to @ inverse @ to) + float(missed @ np.linalg.solve(information, missed))
    return float(likelihood), float(new @ beta + to @ inverse @ rest), variance * squares / (d.size - seen)
