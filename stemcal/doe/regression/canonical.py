"""The shape of a fitted quadratic: stationary point, principal axes, ridge of steepest ascent.

ŷ = b₀ + bᵀx + xᵀBx. Sources: G. E. P. Box and K. B. Wilson (1951) for the canonical form; A. E. Hoerl, Chem.
Eng. Prog. 55 (1959), 69–78, and N. R. Draper, Technometrics 5 (1963), 469–479, for the ridge.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface

# An axis whose curvature is below this share of the largest is a ridge: the stationary point slides along it.
_RIDGE = 0.1

Kind = Literal["plane", "maximum", "minimum", "saddle"]
_SINGULAR, _ROUNDING = 1e-10, 1e-13


@dataclass(frozen=True, eq=False)
class Canonical:
    """Stationary point x_s = −½B⁻¹b and the eigenvalues of B, the largest first, with their axes as columns.

    `point` is None where B is singular: then there is no single stationary point. `ridge`: along some axis the surface
    is nearly level.
    """

    names: tuple[str, ...]
    point: Array | None
    predicted: float | None
    radius: float | None
    inside: bool
    eigenvalues: Array
    axes: Array
    kind: Kind
    ridge: bool


def quadratic_form(surface: Surface) -> tuple[float, Array, Array]:
    """Return b₀, b and the symmetric B of a surface."""
    k, beta = len(surface.names), surface.beta
    b_matrix = np.diag(beta[len(beta) - k :]).astype(float)
    for place, (i, j) in enumerate(combinations(range(k), 2)):
        b_matrix[i, j] = b_matrix[j, i] = 0.5 * beta[1 + k + place]
    return float(beta[0]), beta[1 : k + 1], b_matrix


def analyse_shape(surface: Surface) -> Canonical:
    """Find the stationary point and the principal axes of a surface."""
    _, b, b_matrix = quadratic_form(surface)
    values, axes = np.linalg.eigh(b_matrix)
    values, axes = values[::-1], axes[:, ::-1]
    axes = axes * np.where(axes[np.argmax(np.abs(axes), axis=0), range(len(b))] < 0.0, -1.0, 1.0)
    largest = float(np.abs(values).max())
    if largest <= _ROUNDING * float(np.abs(surface.beta).max()):
        values, largest = np.zeros(len(b)), 0.0
    if largest == 0.0 or np.abs(values).min() <= _SINGULAR * largest:
        return Canonical(surface.names, None, None, None, False, values, axes, *_kind(values, largest))
    point = np.asarray(-0.5 * np.linalg.solve(b_matrix, b), dtype=float)
    radius = float(np.linalg.norm(point))
    predicted = float(surface.predict(point)[0])
    inside = radius <= surface.design_radius * (1.0 + 1e-9)
    return Canonical(surface.names, point, predicted, radius, inside, values, axes, *_kind(values, largest))


def _kind(values: Array, largest: float) -> tuple[Kind, bool]:
    if largest == 0.0:
        return "plane", False
    firm = values[np.abs(values) >= _RIDGE * largest]
    shape: Kind = "maximum" if np.all(firm < 0.0) else "minimum" if np.all(firm > 0.0) else "saddle"
    return shape, firm.size < values.size


@dataclass(frozen=True, eq=False)
class RidgePoint:
    """The point of highest, or lowest, prediction at a distance from the centre."""

    radius: float
    coded: Array
    predicted: float
    standard_error: float | None


def ridge_path(surface: Surface, radii: ArrayLike, ascend: bool = True) -> list[RidgePoint]:
    """Follow the ridge of steepest ascent (or descent): the best point on each sphere about the centre.

    x(µ) = ½(µI − B)⁻¹b with µ above the largest eigenvalue of B, and µ such that ‖x‖ is the radius.
    """
    _, b, b_matrix = quadratic_form(surface)
    sign = 1.0 if ascend else -1.0
    points = [_on_sphere(sign * b, sign * b_matrix, float(radius)) for radius in np.atleast_1d(radii)]
    errors = surface.standard_error(np.array(points))
    return [
        RidgePoint(
            float(radius),
            point,
            float(surface.predict(point)[0]),
            float(error) if np.isfinite(error) else None,
        )
        for radius, point, error in zip(np.atleast_1d(radii), points, errors, strict=True)
    ]


def _on_sphere(b: Array, b_matrix: Array, radius: float) -> Array:
    """Maximise bᵀx + xᵀBx over ‖x‖ = radius."""
    if radius == 0.0:
        return np.zeros(len(b))
    values, axes = np.linalg.eigh(b_matrix)
    c, top = axes.T @ b, float(values[-1])
    scale = max(float(np.abs(values).max()), float(np.linalg.norm(b)) / radius, 1e-300)

    def length(mu: float) -> float:
        return float(np.linalg.norm(0.5 * c / (mu - values)))

    lowest = top + 1e-12 * scale
    if length(lowest) <= radius:  # the slope has no part along the top axis: go along it
        x = np.where(values < top - 1e-9 * scale, 0.5 * c / np.where(values < top, top - values, 1.0), 0.0)
        x[-1] = np.sqrt(max(radius**2 - float(x @ x), 0.0))
        return np.asarray(axes @ x)
    from scipy.optimize import brentq

    highest = top + float(np.linalg.norm(b)) / radius + scale
    mu = brentq(lambda value: length(value) - radius, lowest, highest, xtol=1e-15 * scale, rtol=1e-14)
    return np.asarray(axes @ (0.5 * c / (mu - values)))
