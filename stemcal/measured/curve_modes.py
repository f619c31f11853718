"""Describe the shape of laboratory curves by scores of their leading principal components.

A curve of five hundred points is one measurement, not five hundred, because the errors of its points are correlated.
Therefore whole curves are compared. Each is smoothed and begins where it passes the preload. Its force F is evaluated
at G = 25 shares s of the travel u*, at which F reaches 95 % of its maximum F* (on a flat top, the travel at the maximum
itself is uncertain). With F̄ and ū as the means of F* and u* over the specimens:

    w = (F(s u*)/(F̄ √G), u*/ū),   s = 1/G … 1.

The scores describe how w differs between specimens. The number of points of a curve has no influence on w.

    1  travel without the deformation of a machine of stiffness k:   u − F/k
    2  deviation without the part explained by the maximum:   r = w − w̄ − b (F* − F̄),   b = cov(w, F*)/var(F*)
    3  scatter   S = rᵀr/(n − 1)
    4  S φ = λ φ, |φ| = 1: the leading components, which contain 99 % of the trace, q = 3 at most
    5  score   F̄ (1 + φᵀr), a force: its mean is F̄, and the variance of this mean is F̄² φᵀSφ/n

The scores of different components are uncorrelated with each other and with the maximum, so a fit treats them as 1 + q
separate responses, whose scatter is estimated from n specimens (`doe.calibration.likelihood`).

Source: T. W. Anderson, An Introduction to Multivariate Statistical Analysis, 3rd ed., Wiley 2003, sections 5.2, 11.3.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.arrays import Array
from stemcal.errors import UsageError
from stemcal.measured.shear_curves import PRELOAD, RISE, contact_begins

Curve = tuple[Array, Array]
"""Travel (mm) and force (N), row by row."""

FEWEST = 5
"""Least number of specimens from which the scatter is estimated."""
MOST = 3
_SHARES = np.arange(1, 26) / 25.0
_HELD = 0.99  # share of the scatter that the components contain
_TOP, _FALLEN = 0.95, 0.9  # shares of the maximum force at the travel u*, and at the break


@dataclass(frozen=True)
class CurveModes:
    """The leading components of the curves of n `specimens`, by which other curves are scored (module docstring).

    force, travel    means of the maximum force (N) and of u* (mm), the scales of w
    centre, spread   w̄, and the standard deviations over the specimens, (G + 1,)
    along_force      b, per N, (G + 1,)
    weights          φ, (modes, G + 1)
    scatter          standard deviation of each score over the specimens, N
    """

    force: float
    travel: float
    centre: tuple[float, ...]
    spread: tuple[float, ...]
    along_force: tuple[float, ...]
    weights: tuple[tuple[float, ...], ...]
    scatter: tuple[float, ...]
    specimens: int

    @property
    def band(self) -> tuple[Array, Array, Array]:
        """Travel (mm), mean force and its standard deviation over the specimens (N) at the shares of u*, (G,) each."""
        scale = self.force * np.sqrt(len(_SHARES))
        return _SHARES * self.travel, scale * np.array(self.centre[:-1]), scale * np.array(self.spread[:-1])

    def at_shares(self, travel: Array, force: Array) -> Array:
        """Return the force of a curve at the shares of its travel u*, (G,), N."""
        shape = _on_grid(*from_preload(travel, force), self.force, self.travel)
        return np.asarray(shape[:-1] * self.force * np.sqrt(len(_SHARES)))

    def scores(self, travel: Array, force: Array) -> list[float]:
        """Return the score of a curve for each component, N."""
        shape = _on_grid(*from_preload(travel, force), self.force, self.travel)
        r = shape - np.array(self.centre) - np.array(self.along_force) * (float(force.max()) - self.force)
        return [float(score) for score in self.force * (1.0 + np.array(self.weights) @ r)]


def _on_grid(travel: Array, force: Array, mean_force: float, mean_travel: float) -> Array:
    """Return w (see the module), (G + 1,), of a curve that begins at travel 0; `UsageError` if it has no rise."""
    top = _top(force)
    if top == 0:
        raise UsageError(
            "the curve cannot be compared because its first force value exceeds 95 % of the maximum; add the rows in "
            "which the force rises"
        )
    way = np.maximum.accumulate(travel[: top + 1])
    end = np.interp(_TOP * force.max(), force[top - 1 : top + 1], way[top - 1 :])
    up = np.interp(_SHARES * end, way, force[: top + 1])
    return np.append(up / (mean_force * np.sqrt(len(_SHARES))), end / mean_travel)


def modes_of(curves: Sequence[Curve], stiffness: float | None = None, most: int = MOST) -> CurveModes:
    """Return up to `most` components of at least `FEWEST` smoothed curves; `stiffness` of the machine in N/mm."""
    compliance = 0.0 if stiffness is None else 1.0 / stiffness
    curves = [from_preload(travel - compliance * (force - force[0]), force) for travel, force in curves]
    forces = np.array([float(force.max()) for _, force in curves])
    mean_force = float(forces.mean())
    mean_travel = float(np.mean([travel[_top(force)] for travel, force in curves]))
    w, n = np.array([_on_grid(*curve, mean_force, mean_travel) for curve in curves]), len(curves)
    centre, apart = w.mean(axis=0), forces - mean_force
    along_force = apart @ (w - centre) / float(apart @ apart) if apart.any() else np.zeros_like(centre)
    r = w - centre - np.outer(apart, along_force)
    scatter = r.T @ r / (n - 1)
    values, vectors = np.linalg.eigh(scatter)
    values, vectors = values[::-1], vectors[:, ::-1]
    held = np.cumsum(values) / values.sum()
    # the components and the maximum must be fewer than the n − 1 degrees of freedom of the scatter
    count = min(most, MOST, max(n - 3, 0), int(np.searchsorted(held, _HELD)) + 1)
    # the sign of φ is arbitrary; its largest component is made positive, so that equal curves have equal scores
    weights = np.array([phi * np.sign(phi[int(np.argmax(np.abs(phi)))]) for phi in vectors[:, :count].T])
    return CurveModes(
        mean_force,
        mean_travel,
        tuple(centre.tolist()),
        tuple(w.std(axis=0, ddof=1).tolist()),
        tuple(along_force.tolist()),
        tuple(tuple(phi.tolist()) for phi in weights),
        tuple((mean_force * np.sqrt(((weights @ scatter) * weights).sum(axis=1))).tolist()),
        n,
    )


def without_noise(travel: Array, force: Array) -> Curve:
    """Return a measured curve smoothed from contact to the break, so that noise does not raise its maximum.

    The force at each point is the value of a quadratic fitted to its neighbours (A. Savitzky and M. J. E. Golay, Anal.
    Chem. 36 (1964) 1627): on either side 2/25 of the points between contact and maximum. The part before contact is not
    smoothed, since the curve has a corner where contact begins.
    """
    from scipy.signal import savgol_filter

    begin = contact_begins(force, PRELOAD)
    # before contact, a sensor may indicate slightly more than zero
    begin = contact_begins(force, min(PRELOAD, float(np.median(force[: begin + 1]))))
    top = int(np.argmax(force))
    fallen = np.flatnonzero(force[top:] < _FALLEN * force[top])
    end = top + int(fallen[0]) if len(fallen) else len(force)
    half = 2 * (top - begin) // len(_SHARES)
    if half > 1 and end - begin > 2 * half:
        force = np.concatenate([force[:begin], savgol_filter(force[begin:end], 2 * half + 1, 2), force[end:]])
    return travel, force


def from_preload(travel: Array, force: Array) -> Curve:
    """Return a curve from the preload on; its first point is interpolated, or extrapolated by at most one step."""
    begin = contact_begins(force, PRELOAD)
    first, after = float(force[begin]), float(force[begin : begin + 2][-1])
    if not first < after or first > RISE * force.max():
        return travel[begin:] - travel[begin], force[begin:]
    start = travel[begin] + max((PRELOAD - first) / (after - first), -1.0) * (travel[begin + 1] - travel[begin])
    later = begin + int(first <= PRELOAD)
    return np.append(0.0, travel[later:] - start), np.append(PRELOAD, force[later:])


def _top(force: Array) -> int:
    return int(np.argmax(force >= _TOP * force.max()))
