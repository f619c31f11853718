"""Canonical analysis of a fitted quadratic ŷ = b₀ + bᵀx + xᵀBx: stationary point and principal axes.

Source: G. E. P. Box and K. B. Wilson, J. R. Stat. Soc. B 13 (1951) 1–45.
"""

from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from stemcal.doe.coding import Coding
from stemcal.doe.regression.surface import Surface

_RIDGE = 0.1  # with less than this share of the largest curvature, an axis is a ridge: x_s is uncertain along it
_SINGULAR, _ROUNDING = 1e-10, 1e-13

Kind = Literal["plane", "maximum", "minimum", "saddle"]


@dataclass(frozen=True)
class CanonicalForm:
    """Stationary point x_s = −½B⁻¹b and principal axes of a surface; x_s is None if B is singular."""

    coded: dict[str, float] | None  # x_s in coded units
    natural: dict[str, float] | None
    predicted: float | None  # ŷ at x_s
    coded_radius: float | None
    inside: bool  # whether x_s is within the design region
    kind: Kind
    ridge: bool  # whether the surface is nearly constant along an axis
    eigenvalues: tuple[float, ...]  # eigenvalues of B, the largest first
    axes: tuple[dict[str, float], ...]  # unit vectors in coded units

    @property
    def called(self) -> str:
        """The shape of the surface in words."""
        kind = "saddle point" if self.kind == "saddle" else self.kind
        return f"{kind} with a ridge" if self.ridge and kind != "plane" else kind


def canonical_analysis(surface: Surface, coding: Coding) -> CanonicalForm:
    """Return the stationary point and the principal axes of a surface."""
    k, beta = len(surface.names), surface.beta
    b, b_matrix = beta[1 : k + 1], np.diag(beta[len(beta) - k :]).astype(float)
    for place, (i, j) in enumerate(combinations(range(k), 2)):
        b_matrix[i, j] = b_matrix[j, i] = 0.5 * beta[1 + k + place]
    values, axes = np.linalg.eigh(b_matrix)
    values, axes = values[::-1], axes[:, ::-1]
    # the sign of an eigenvector is arbitrary: make the largest component of each axis positive
    axes = axes * np.where(axes[np.argmax(np.abs(axes), axis=0), range(len(b))] < 0.0, -1.0, 1.0)
    largest = float(np.abs(values).max())
    if largest <= _ROUNDING * float(np.abs(surface.beta).max()):
        values, largest = np.zeros(len(b)), 0.0
    firm = values[np.abs(values) >= _RIDGE * largest]
    curved: Kind = "maximum" if np.all(firm < 0.0) else "minimum" if np.all(firm > 0.0) else "saddle"
    kind: Kind = "plane" if largest == 0.0 else curved
    ridge = largest > 0.0 and firm.size < values.size
    described = kind, ridge, tuple(values.tolist()), tuple(coding.by_name(axis) for axis in axes.T)
    if largest == 0.0 or np.abs(values).min() <= _SINGULAR * largest:
        return CanonicalForm(None, None, None, None, False, *described)
    point = np.asarray(-0.5 * np.linalg.solve(b_matrix, b), dtype=float)
    radius = float(np.linalg.norm(point))
    natural, predicted = coding.by_name(coding.to_natural(point)), float(surface.predict(point)[0])
    inside = radius <= surface.design_radius * (1.0 + 1e-9)
    return CanonicalForm(coding.by_name(point), natural, predicted, radius, inside, *described)
