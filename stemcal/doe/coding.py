"""Natural ↔ coded units by the design, never by data; terms of a full quadratic: names, columns, derivatives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stemcal.errors import UsageError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coding:
    """x = (natural − centre) / half_step for each factor.

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
        """Put low and high at −reach and +reach: 1 for a two-level design, α for a central composite."""
        bottom, top = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
        centre, half_step = 0.5 * (bottom + top), 0.5 * (top - bottom) / reach
        return cls(tuple(names), tuple(map(float, centre)), tuple(map(float, half_step)))

    def to_coded(self, natural: ArrayLike) -> Array:
        """Code an array whose last axis runs over the factors."""
        return np.asarray((np.asarray(natural, dtype=float) - self.centre) / np.asarray(self.half_step))

    def to_natural(self, coded: ArrayLike) -> Array:
        """Undo `to_coded`."""
        return np.asarray(np.asarray(coded, dtype=float) * np.asarray(self.half_step) + self.centre)

    def levels(self, coded: ArrayLike) -> dict[str, float]:
        """Return one coded point as levels by name, twelve digits: an axial point is 20, not 19.999999999999996."""
        natural = self.to_natural(coded)
        return {name: float(f"{value:.12g}") for name, value in zip(self.names, natural, strict=True)}

    def runs(self, coded: Iterable[ArrayLike], others: Mapping[str, float]) -> tuple[dict[str, float], ...]:
        """Return every factor's level in each run; `others` has those of factors that do not vary."""
        return tuple({**others, **self.levels(row)} for row in coded)

    def by_name(self, coded: Array) -> dict[str, float]:
        """Return one coded point by name."""
        return dict(zip(self.names, map(float, coded), strict=True))

    def point(self, by_name: Mapping[str, float]) -> Array:
        """Undo `by_name`."""
        return np.array([by_name[name] for name in self.names])


def term_names(names: Sequence[str]) -> tuple[str, ...]:
    """List the terms: the mean, linear, interactions, squares.

    >>> term_names(["a", "b"])
    ('1', 'a', 'b', 'a:b', 'a^2', 'b^2')
    """
    interactions = [f"{a}:{b}" for a, b in combinations(names, 2)]
    return ("1", *names, *interactions, *(f"{name}^2" for name in names))


@cache
def _pairs(k: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the factors of every interaction, in the order of `term_names`."""
    return np.triu_indices(k, 1)


def term_columns(coded: ArrayLike) -> Array:
    """Evaluate every term at (m, k) coded points; returns (m, p)."""
    x = np.atleast_2d(np.asarray(coded, dtype=float))
    first, second = _pairs(x.shape[1])
    return np.concatenate([np.ones((len(x), 1)), x, x[:, first] * x[:, second], x**2], axis=1)


def term_gradient(coded: ArrayLike) -> Array:
    """Differentiate every term at one coded point; returns (p, k)."""
    x = np.asarray(coded, dtype=float)
    first, second = _pairs(x.size)
    products, rows = np.zeros((len(first), x.size)), np.arange(len(first))
    products[rows, first], products[rows, second] = x[second], x[first]
    return np.concatenate([np.zeros((1, x.size)), np.eye(x.size), products, np.diag(2.0 * x)])
