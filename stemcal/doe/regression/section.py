"""A surface of a response over factors and a condition, and its section at one condition.

The surface is a quadratic in z: the coded factors, the coded condition last. Its response is y or ln y. At one
condition it is a function of the factors x alone.

A factor p that is a power of the condition d acts only through its value p·(d/a)^e. Where the exponent e is a factor
too, z has no coordinate for it: all runs have the exponent e₀ at coded 0, and z contains the p that has the same value
at d with that exponent,

    z_p = (p·(d/a)^(e − e₀) − centre)/half_step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.coding import Array, Coding, term_columns, term_gradient
from stemcal.doe.regression.surface import Surface, fit_surface


@dataclass(frozen=True)
class Place:
    """A condition, coded, where the surface over factors and conditions is seen; points are (m, k) coded factors.

    `growing` has, of each factor that grows, by their places, its exponent and ln(d/a) of the condition.
    """

    coding: Coding
    condition: float
    growing: Mapping[int, tuple[int, float]] = field(default_factory=dict)

    @cached_property
    def coordinates(self) -> tuple[list[int], Array, Array, list[int]]:
        """Of each coordinate z = (start + x)·exp(rate·x_e) − start its factor, start, rate and the exponent's factor e.

        Exponents are no coordinates; those of other factors are the factors themselves, with rate 0.
        """
        half, grows = self.coding.half_step, self.growing
        factors = [j for j in range(len(half)) if j not in {exponent for exponent, _ in grows.values()}]
        start = np.array([self.coding.centre[j] / half[j] if j in grows else 0.0 for j in factors])
        rate = np.array([grows[j][1] * half[grows[j][0]] if j in grows else 0.0 for j in factors])
        return factors, start, rate, [grows[j][0] if j in grows else j for j in factors]

    def z(self, points: ArrayLike) -> Array:
        """Return the coordinates of points on the surface, (m, factors without exponents + 1)."""
        x, (factors, start, rate, exponents) = np.atleast_2d(np.asarray(points, dtype=float)), self.coordinates
        moved = (start + x[:, factors]) * np.exp(rate * x[:, exponents]) - start
        return np.column_stack([moved, np.full(len(x), self.condition)])

    def slopes(self, x: Array) -> Array:
        """Return ∂z/∂x at one point without the condition, (factors without exponents, k)."""
        factors, start, rate, exponents = self.coordinates
        found, rows, growth = np.zeros((len(factors), len(x))), range(len(factors)), np.exp(rate * x[exponents])
        found[rows, factors] = growth
        found[rows, exponents] += (start + x[factors]) * growth * rate
        return found


@dataclass(frozen=True, eq=False)
class Section:
    """The surface `whole`, of y or ln y, at one place, as y: points are (m, k) coded, answers (m,) or (m, 2)."""

    whole: Surface
    place: Place
    logarithm: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The factors."""
        return self.place.coding.names

    @property
    def df(self) -> int:
        """The residual degrees of freedom of the surface."""
        return self.whole.df

    @property
    def design_radius(self) -> float:
        """Coded distance of the outermost run from the centre."""
        return self.whole.design_radius

    def predict(self, coded: ArrayLike) -> Array:
        """Evaluate ŷ."""
        return self._response(self.whole.predict(self.place.z(coded)))

    def gradient(self, coded: ArrayLike) -> Array:
        """Differentiate ŷ at one point; returns (k,)."""
        x = np.asarray(coded, dtype=float)
        z = self.place.z(x)[0]
        slope = self.whole.gradient(z)[:-1] @ self.place.slopes(x)
        return np.asarray(slope * np.exp(self.whole.predict(z)[0]) if self.logarithm else slope)

    def mean_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Interval of the mean response."""
        return self._response(self.whole.mean_interval(self.place.z(coded), level))

    def prediction_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Interval of one further run."""
        return self._response(self.whole.prediction_interval(self.place.z(coded), level))

    def _response(self, values: Array) -> Array:
        return np.asarray(np.exp(values)) if self.logarithm else values

    def moved(self, coded: Array, response: float) -> Section:
        """Return the section through a response at a point: ŷ, or ln ŷ, moved by the difference."""
        beta = self.whole.beta.copy()
        value = np.log(response) if self.logarithm else response
        beta[0] += float(value - self.whole.predict(self.place.z(coded))[0])
        return replace(self, whole=replace(self.whole, beta=beta))


AnySurface = Surface | Section


class SeveralSurfaces:
    """Several surfaces over the same factors, evaluated together."""

    def __init__(self, each: Sequence[AnySurface]) -> None:
        self._each = each
        quadratics = [surface.beta for surface in each if isinstance(surface, Surface)]
        self._beta = np.array(quadratics) if len(quadratics) == len(each) else None

    def predict(self, points: Array) -> Array:
        """Return ŷ, (points, surfaces)."""
        if self._beta is not None:
            return np.asarray(term_columns(points) @ self._beta.T)
        return np.column_stack([surface.predict(points) for surface in self._each])

    def slopes(self, x: Array) -> Array:
        """Return ∂ŷ/∂x at one point, (surfaces, factors)."""
        if self._beta is not None:
            return np.asarray(self._beta @ term_gradient(x))
        return np.array([surface.gradient(x) for surface in self._each])


# ---- whether the surface follows the response over the condition

_BENT_PERCENT, _BENT_P = 0.5, 0.1


@dataclass(frozen=True)
class Bend:
    """Root mean square, `percent` of the response, that terms of d³ and d⁴ would remove, and p of their F test."""

    percent: float
    p: float

    @property
    def found(self) -> bool:
        """Whether the response bends over the condition as no quadratic does, by more than chance."""
        return self.percent > _BENT_PERCENT and self.p < _BENT_P


def bend_freedom(terms: Array, d: Array) -> int:
    """Return the degrees of freedom left by z_d³, z_d⁴ and other terms (n, p); 0 if these are not estimable."""
    more = np.column_stack([terms, d**3, d**4])
    return len(d) - more.shape[1] if np.linalg.matrix_rank(more) == more.shape[1] else 0


def bend_of(whole: Surface, logarithm: bool) -> Bend | None:
    """Return what a quadratic in the condition misses; None with fewer than five levels, or too few runs, to see it.

    F = ((SS − SS₂)/2)/(SS₂/(n − p − 2)), SS and SS₂ the residuals without and with z_d³ and z_d⁴.
    """
    from scipy.special import fdtrc

    kept = np.diag(whole.unscaled_covariance) > 0.0
    terms, d = term_columns(whole.design)[:, kept], whole.design[:, -1]
    more = np.column_stack([terms, d**3, d**4])
    if (df := bend_freedom(terms, d)) < 1:
        return None
    before, after = (
        float(np.sum((whole.response - x @ np.linalg.lstsq(x, whole.response, rcond=None)[0]) ** 2))
        for x in (terms, more)
    )
    size = 1.0 if logarithm else float(np.mean(np.abs(whole.response))) or 1.0
    removed = max(before - after, 0.0)
    f = (removed / 2.0) / max(after / df, 1e-300)
    return Bend(100.0 * (removed / len(d)) ** 0.5 / size, float(fdtrc(2.0, df, f)))


# ---- the response or its logarithm

_ALONE = 0.9  # leverage of the one centre run of a spherical design


def fit_whole(
    coded: ArrayLike, response: Array, names: Sequence[str], terms: Sequence[str] | None, logarithm: bool
) -> Surface:
    """Fit a surface over factors and conditions to a response, or to its logarithm: then the error is relative."""
    found = fit_surface(coded, np.log(response) if logarithm else response, names, terms)
    return replace(found, cv_percent=relative_percent(found)) if logarithm else found


def relative_percent(logarithm: Surface) -> float | None:
    """Return 100·s of a surface of ln y, which corresponds to the coefficient of variation of one of y."""
    return None if logarithm.mean_square is None else 100.0 * logarithm.mean_square**0.5


def left_out_percent(surface: Surface, logarithm: bool) -> float | None:
    """Return the root mean square of 100·(y − ŷ)/y over the runs, each predicted without it.

    y − ŷ₍ᵢ₎ = e/(1 − h), of ln y ln(y/ŷ₍ᵢ₎). Runs that alone determine a coefficient (h near 1) are left aside.
    """
    rows = [row for row in surface.runs_diagnostics if row.leverage < _ALONE]
    if surface.df < 1 or not rows:
        return None
    missed = np.array([row.residual / (1.0 - row.leverage) for row in rows])
    relative = 1.0 - np.exp(-missed) if logarithm else missed / np.array([row.response for row in rows])
    return float(100.0 * np.sqrt(np.mean(relative**2)))
