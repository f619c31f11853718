"""What the mesh does to the force: the same test on other meshes, at one diameter or several.

ln F of diameter i on mesh j is μᵢ + mⱼ + e_ij. The meshes are placements (the same elements elsewhere along the stem),
which are drawn from all places a mesh may have, and other element sizes, which are not:

    scatter of a mesh by itself    s² = Σ e²/((D − 1)(M − 1)) over D diameters and all M meshes
    what a placement does to       MS = D·Σ (mⱼ − m̄)²/(P − 1) over P placements estimates s² + D·c², so the variance
    all diameters alike            of the common part is c² = (MS − s²)/D, zero where that is negative
    what a size does to            a factor exp(m_size − m_own), told with its standard error but no scatter: the
    all diameters alike            calibrated values belong to the element size

With one diameter the parts cannot be told apart: the variance over the placements is all there is. Logarithms, so
that relative deviations of all diameters can be compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression.least_squares import Array, t_quantile
from stemcal.errors import UsageError


@dataclass(frozen=True)
class MeshScatter:
    """Relative variances of one force by the place of the mesh, and by how many degrees of freedom they are known.

    `common` is the part that all diameters share; `mean_factor` is the mean over the placements over the force of the
    study's own mesh; `placements` counts them, `conditions` where they were simulated.
    """

    own: float
    own_df: float
    common: float
    common_df: float
    mean_factor: float
    placements: int
    conditions: int = 1

    @property
    def variance(self) -> float:
        """Relative variance of one force on a mesh at any place."""
        return self.own + self.common

    @property
    def sd_percent(self) -> float:
        """Relative standard deviation of one force on a mesh at any place, percent."""
        return 100.0 * sqrt(self.variance)

    @property
    def df(self) -> float:
        """Degrees of freedom behind the whole variance, Satterthwaite's."""
        parts = [(self.own, self.own_df), (self.common, self.common_df)]
        doubt = sum(variance**2 / df for variance, df in parts if variance > 0.0)
        return self.variance**2 / doubt if doubt > 0.0 else np.inf

    def interval(self, response: float, level: float = 0.95) -> tuple[float, float]:
        """Return what holds that share of forces with the mesh at another place; `response` is on the study's own."""
        middle = response * self.mean_factor
        half = t_quantile(level, self.df) * middle * sqrt(self.variance * (1.0 + 1.0 / self.placements))
        return middle - half, middle + half

    def over(self, phases: int) -> MeshScatter:
        """Return the scatter of a mean over so many places."""
        return replace(self, own=self.own / phases, common=self.common / phases)


@dataclass(frozen=True)
class SizeFactor:
    """The force on elements of another size over that of the study's own, for all diameters alike.

    `standard_error_percent` is that of the factor by the scatter of both meshes; None where none is known.
    """

    element_size: str
    factor: float
    standard_error_percent: float | None


def scatter_of(own: ArrayLike, placed: Array, sized: Array) -> MeshScatter:
    """Return the scatter over the placements.

    The study's own mesh is none of them: it is what their scatter is to tell of, and counted among few it would make
    its own error look the smaller.

    Parameters
    ----------
    own : (diameters,)
        Forces on the study's own mesh.
    placed : array (diameters, placements)
        Forces with the mesh at other places.
    sized : array (diameters, sizes)
        Forces on elements of other sizes; they tell only how differently the diameters answer.
    """
    places = np.log(placed)
    conditions, count = places.shape
    if count < 2:
        raise UsageError("mesh.phases: the scatter over the places of the mesh needs two or more")
    mean_factor = float(np.exp(np.mean(places - np.log(np.asarray(own, dtype=float))[:, None])))
    if conditions == 1:
        return MeshScatter(float(places.var(ddof=1)), float(count - 1), 0.0, float(count - 1), mean_factor, count)
    whole = np.hstack([places, np.log(sized)])
    df = float((conditions - 1) * (whole.shape[1] - 1))
    within = _interaction(whole) / df
    between = conditions * float(places.mean(axis=0).var(ddof=1))
    common = max((between - within) / conditions, 0.0)
    return MeshScatter(within, df, common, float(count - 1), mean_factor, count, conditions)


def _interaction(table: Array) -> float:
    """Return the sum of squares that rows and columns leave."""
    rest = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0, keepdims=True) + table.mean()
    return float((rest**2).sum())


def size_factors(own: ArrayLike, sized: Array, names: Sequence[str], scatter: MeshScatter | None) -> list[SizeFactor]:
    """Return the factor of each element size, mean over the diameters."""
    base = np.log(np.asarray(own, dtype=float))
    apart = np.log(sized) - base[:, None]
    # the difference of two meshes, each with the common scatter once and its own at every diameter
    error = None if scatter is None else 100.0 * (2.0 * (scatter.common + scatter.own / base.size)) ** 0.5
    return [
        SizeFactor(name, float(np.exp(value)), error) for name, value in zip(names, apart.mean(axis=0), strict=True)
    ]
