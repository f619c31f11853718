"""Conversion between natural and coded units, and the terms of the full quadratic model: names, values, derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stemcal.arrays import Array
from stemcal.errors import UsageError


@dataclass(frozen=True)
class Coding:
    """Coded units x = (natural − centre)/half_step of each factor.

    >>> coding = Coding(("yield_stress",), (15.0,), (2.5,))
    >>> float(coding.to_coded([[20.0]])[0, 0])
    2.0
    """

    names: tuple[str, ...]
    centre: tuple[float, ...]
    half_step: tuple[float, ...]

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.centre) == len(self.half_step):
            raise UsageError(
                "coding: `names`, `centre` and `half_step` have different lengths; each requires one value per factor"
            )
        for name, half_step in zip(self.names, self.half_step, strict=True):
            if not (np.isfinite(half_step) and half_step > 0.0):
                raise UsageError(f"coding.{name}: the half-step ({half_step:g}) must be positive")

    @classmethod
    def from_ranges(cls, names: Sequence[str], low: ArrayLike, high: ArrayLike, reach: float = 1.0) -> Coding:
        """Return the coding with `low` at −reach and `high` at +reach (two-level design: 1, composite design: α)."""
        bottom, top = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        centre, half_step = 0.5 * (bottom + top), 0.5 * (top - bottom) / reach
        return cls(tuple(names), tuple(map(float, centre)), tuple(map(float, half_step)))

    def to_coded(self, natural: ArrayLike) -> Array:
        """Convert natural to coded units; the last axis of the array runs over the factors."""
        return np.asarray((np.asarray(natural, dtype=float) - self.centre) / np.asarray(self.half_step))

    def to_natural(self, coded: ArrayLike) -> Array:
        """Convert coded to natural units; the inverse of `to_coded`."""
        return np.asarray(np.asarray(coded, dtype=float) * np.asarray(self.half_step) + self.centre)

    def levels(self, coded: ArrayLike) -> dict[str, float]:
        """Return the natural levels of a coded point by factor, to twelve digits (20, not 19.9999…96; 0, not 3e-15)."""
        natural = np.where(np.abs(x := self.to_natural(coded)) < 1e-12 * np.array(self.half_step), 0.0, x)
        return {name: float(f"{value:.12g}") for name, value in zip(self.names, natural, strict=True)}

    def runs(self, coded: Iterable[ArrayLike], others: Mapping[str, float]) -> tuple[dict[str, float], ...]:
        """Return the natural levels of all factors in each run; `others` are the levels of factors that do not vary."""
        return tuple({**others, **self.levels(row)} for row in coded)

    def by_name(self, coded: Array) -> dict[str, float]:
        """Return the coordinates of a coded point by the names of the factors."""
        return dict(zip(self.names, map(float, coded), strict=True))

    def point(self, by_name: Mapping[str, float]) -> Array:
        """Return the coded point from coordinates by name; the inverse of `by_name`."""
        return np.array([by_name[name] for name in self.names])


def term_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the terms in order: the mean, linear terms, interactions, squares.

    >>> term_names(["a", "b"])
    ('1', 'a', 'b', 'a:b', 'a^2', 'b^2')
    """
    return ("1", *names, *[f"{a}:{b}" for a, b in combinations(names, 2)], *(f"{name}^2" for name in names))


@cache
def _pairs(k: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    return np.triu_indices(k, 1)  # the two factors of each interaction, in the order of `term_names`


def term_columns(coded: ArrayLike) -> Array:
    """Evaluate all p terms at coded points (…, k); return (…, p), for a single point (k,) the row (1, p)."""
    x = np.atleast_2d(np.asarray(coded, dtype=float))
    first, second = _pairs(x.shape[-1])
    return np.concatenate([np.ones((*x.shape[:-1], 1)), x, x[..., first] * x[..., second], x**2], axis=-1)


def term_gradient(coded: ArrayLike) -> Array:
    """Return the derivatives of all p terms with respect to the k factors, (…, p, k), at coded points (…, k)."""
    x = np.asarray(coded, dtype=float)
    first, second = _pairs(k := x.shape[-1])
    gradient, pairs = np.zeros((*x.shape[:-1], 1 + 2 * k + len(first), k)), np.arange(1 + k, 1 + k + len(first))
    gradient[..., 1 : 1 + k, :] = np.eye(k)
    gradient[..., pairs, first], gradient[..., pairs, second] = x[..., second], x[..., first]
    gradient[..., np.arange(k) - k, np.arange(k)] = 2.0 * x
    return gradient
