"""Would another scale of the response fit better? The power transformations of Box and Cox.

y(λ) = (y^λ − 1)/(λ·ẏ^(λ−1)), or ẏ·ln y for λ = 0, with ẏ the geometric mean; SSE(λ) is the residual of
the same terms fitted to it. λ̂ minimises SSE; the interval holds the λ with SSE(λ) ≤ SSE(λ̂)·(1 + t²/df).

Sources: G. E. P. Box and D. R. Cox, J. Roy. Stat. Soc. B 26 (1964), 211–252; the interval as in D. C.
Montgomery, Design and Analysis of Experiments, section 15.1.1.
"""

from dataclasses import dataclass

import numpy as np

from stemcal.doe.regression.least_squares import Array, t_quantile

_LOW, _HIGH, _STEPS = -3.0, 3.0, 121
_USUAL = (-1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
"""The powers people use."""


@dataclass(frozen=True)
class BoxCox:
    """Best power λ̂ with its 95 % interval (an end is None where it lies beyond −3 … 3), and the power advised."""

    best: float
    low: float | None
    high: float | None
    advised: float


def box_cox(matrix: Array, response: Array, level: float = 0.95) -> BoxCox | None:
    """Judge the scale of a response fitted on the columns of `matrix`.

    Returns None where the question has no sense: a response that is not positive throughout, no residual
    degree of freedom, a fit without residual.
    """
    n, p = matrix.shape
    if np.any(response <= 0.0) or n - p < 1 or np.ptp(response) == 0.0:
        return None
    from scipy.optimize import brentq, minimize_scalar

    basis = np.linalg.qr(matrix)[0]

    def sse(power: float) -> float:
        return _residual(basis, _transformed(response, power))

    total = float(np.sum((response - response.mean()) ** 2))
    grid = np.linspace(_LOW, _HIGH, _STEPS)
    values = np.array([sse(power) for power in grid])
    if values.min() <= 1e-12 * total:
        return None
    start = grid[int(np.argmin(values))]
    best = float(minimize_scalar(sse, bounds=(max(_LOW, start - 0.1), min(_HIGH, start + 0.1)), method="bounded").x)
    limit = sse(best) * (1.0 + t_quantile(level, n - p) ** 2 / (n - p))
    low, high = (
        float(brentq(lambda power: sse(power) - limit, best, end)) if sse(end) > limit else None
        for end in (_LOW, _HIGH)
    )
    return BoxCox(best, low, high, _advised(best, low, high))


def _transformed(y: Array, power: float) -> Array:
    mean = np.exp(np.mean(np.log(y)))
    if abs(power) < 1e-9:
        return np.asarray(mean * np.log(y))
    return np.asarray((y**power - 1.0) / (power * mean ** (power - 1.0)))


def _residual(basis: Array, z: Array) -> float:
    return float(np.sum((z - basis @ (basis.T @ z)) ** 2))


def _advised(best: float, low: float | None, high: float | None) -> float:
    """Return 1 where the interval holds it, else the usual power in the interval that is nearest to the best."""
    bottom, top = _LOW if low is None else low, _HIGH if high is None else high
    if bottom <= 1.0 <= top:
        return 1.0
    inside = [power for power in _USUAL if bottom <= power <= top]
    return min(inside or _USUAL, key=lambda power: abs(power - best))
