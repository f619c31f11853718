"""A response surface over factors and a condition, such as the stem diameter, and its section at one condition.

The surface is a quadratic in z, the coded factors followed by the coded condition. It describes y or ln y. At a fixed
condition it is a function of the coded factors x alone.

A factor p may grow with a power of the condition d: at d the model has the value p·(d/a)^e, with a fixed a. If e is a
factor too, z has no coordinate for e. All runs have the exponent e₀ (coded 0), and a point with another exponent is
represented by the p that gives the same value with e₀:

    z_p = (p·(d/a)^(e − e₀) − centre)/half_step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from stemcal.arrays import Array
from stemcal.doe.coding import Coding, term_columns, term_gradient
from stemcal.doe.regression.surface import Surface, fit_surface


@dataclass(frozen=True)
class Place:
    """The coded condition of a section; it converts points x (m, k) in coded factors to coordinates z of the surface.

    `growing` maps the index of a factor that grows with the condition d to the index of its exponent and ln(d/a).
    """

    coding: Coding
    condition: float
    growing: Mapping[int, tuple[int, float]] = field(default_factory=dict)

    @cached_property
    def coordinates(self) -> tuple[list[int], Array, Array, list[int]]:
        """Return j, start, rate and e of every coordinate zⱼ = (startⱼ + xⱼ)·exp(rateⱼ·x_e) − startⱼ.

        The indices j of factors exclude exponents; e is the index of the exponent with which factor j grows. A factor
        that does not grow has zⱼ = xⱼ: start and rate are 0.
        """
        half, grows = self.coding.half_step, self.growing
        factors = [j for j in range(len(half)) if j not in {exponent for exponent, _ in grows.values()}]
        start = np.array([self.coding.centre[j] / half[j] if j in grows else 0.0 for j in factors])
        rate = np.array([grows[j][1] * half[grows[j][0]] if j in grows else 0.0 for j in factors])
        return factors, start, rate, [grows[j][0] if j in grows else j for j in factors]

    def z(self, points: ArrayLike) -> Array:
        """Return the coordinates z of points x, (m, number of factors without exponents + 1); the condition is last."""
        return _Places([self]).z(np.atleast_2d(np.asarray(points, dtype=float)))[:, 0]


class _Places:
    """Several conditions of one surface, evaluated together for speed."""

    def __init__(self, each: Sequence[Place]) -> None:
        self._factors, self._start, _, self._exponents = each[0].coordinates
        self._rates = np.array([place.coordinates[2] for place in each])
        self._conditions = np.array([place.condition for place in each])

    def z(self, x: Array) -> Array:
        """Return the coordinates z (m, places, coordinates) of points x (m, k); the last is the condition."""
        growth = np.exp(self._rates * x[:, None, self._exponents])
        z = np.empty((*growth.shape[:2], growth.shape[2] + 1))
        z[..., :-1] = (self._start + x[:, None, self._factors]) * growth - self._start
        z[..., -1] = self._conditions
        return z

    def slopes(self, x: Array) -> Array:
        """Return ∂z/∂x at one point, without the row of the condition, (places, coordinates − 1, k)."""
        rows, growth = range(len(self._factors)), np.exp(self._rates * x[self._exponents])
        slopes = np.zeros((*growth.shape, len(x)))
        slopes[:, rows, self._factors] = growth
        slopes[:, rows, self._exponents] += (self._start + x[self._factors]) * growth * self._rates
        return slopes


@dataclass(frozen=True, eq=False)
class Section:
    """A surface over factors and conditions at one fixed condition: y as a function of the factors alone.

    Methods take coded points (m, k) and return values of y, (m,), or intervals, (m, 2).
    """

    whole: Surface
    place: Place
    logarithm: bool  # whether the surface describes ln y

    @property
    def names(self) -> tuple[str, ...]:
        return self.place.coding.names

    @property
    def df(self) -> int:
        return self.whole.df

    @property
    def design_radius(self) -> float:
        return self.whole.design_radius

    def predict(self, coded: ArrayLike) -> Array:
        return self._response(self.whole.predict(self.place.z(coded)))

    def gradient(self, coded: ArrayLike) -> Array:
        return np.asarray(SeveralSurfaces([self]).slopes(np.asarray(coded, dtype=float))[0])

    def mean_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        return self._response(self.whole.mean_interval(self.place.z(coded), level))

    def prediction_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        return self._response(self.whole.prediction_interval(self.place.z(coded), level))

    def _response(self, values: Array) -> Array:
        return np.asarray(np.exp(values)) if self.logarithm else values

    def moved(self, coded: Array, response: float) -> Section:
        """Return a copy that passes through a response at a point: a constant is added to ŷ, or to ln ŷ."""
        beta = self.whole.beta.copy()
        value = np.log(response) if self.logarithm else response
        beta[0] += float(value - self.whole.predict(self.place.z(coded))[0])
        return replace(self, whole=replace(self.whole, beta=beta))


AnySurface = Surface | Section


class SeveralSurfaces:
    """Several surfaces over the same factors, or several sections of surfaces, evaluated together for speed."""

    def __init__(self, each: Sequence[AnySurface]) -> None:
        self.sections = tuple(surface for surface in each if isinstance(surface, Section))
        wholes = (surface.whole if isinstance(surface, Section) else surface for surface in each)
        self._beta = np.array([whole.beta for whole in wholes])
        self._logarithm = np.array([section.logarithm for section in self.sections], dtype=bool)
        self._places = _Places([section.place for section in self.sections]) if self.sections else None

    def terms(self, points: Array) -> Array:
        """Return the terms of each section, (points, sections, terms), at coded points (points, factors)."""
        assert self._places is not None
        return term_columns(self._places.z(np.atleast_2d(points)))

    def predict(self, points: Array) -> Array:
        """Return ŷ of all surfaces at coded points, (points, surfaces)."""
        if self._places is None:
            return np.asarray(term_columns(points) @ self._beta.T)
        y = np.einsum("pst,st->ps", self.terms(points), self._beta)
        return np.asarray(np.exp(y, out=y, where=self._logarithm))

    def slopes(self, x: Array) -> Array:
        """Return ∂ŷ/∂x of all surfaces at one point, (surfaces, factors)."""
        if self._places is None:
            return np.asarray(self._beta @ term_gradient(x))
        along_z = np.einsum("st,stz->sz", self._beta, term_gradient(self._places.z(x[None])[0]))[:, :-1]
        slopes = np.einsum("sz,szk->sk", along_z, self._places.slopes(x))
        return np.asarray(np.where(self._logarithm, self.predict(x)[0], 1.0)[:, None] * slopes)


# ---- lack of fit over the condition: would terms of third and fourth order improve the surface?

_BENT_PERCENT, _BENT_P = 0.5, 0.1


@dataclass(frozen=True)
class Bend:
    """Improvement of the fit by the terms z_d³ and z_d⁴ of the condition d."""

    percent: float  # root mean square of the part of the response that the terms explain, in percent of its mean
    p: float  # p-value of the F test of these terms

    @property
    def significant(self) -> bool:
        """Whether the terms improve the fit significantly, by more than half a percent of the mean response."""
        return self.percent > _BENT_PERCENT and self.p < _BENT_P


def bend_freedom(terms: Array, d: Array) -> int:
    """Return the residual degrees of freedom with the further terms d³ and d⁴ (coded condition); 0 if not estimable."""
    more = np.column_stack([terms, d**3, d**4])
    return len(d) - more.shape[1] if np.linalg.matrix_rank(more) == more.shape[1] else 0


def bend_of(whole: Surface, logarithm: bool) -> Bend | None:
    """Test the terms z_d³ and z_d⁴ of the condition; None with fewer than five conditions, or too few runs.

    F = ((SS − SS₂)/2)/(SS₂/(n − p − 2)), with SS and SS₂ the residual sums of squares without and with these terms.
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


_ALONE = 0.9  # a run with a higher leverage, such as a single centre run, nearly determines a coefficient alone


def fit_whole(
    coded: ArrayLike, response: Array, names: Sequence[str], terms: Sequence[str] | None, logarithm: bool
) -> Surface:
    """Fit a surface over factors and conditions to y, or to ln y, with `relative_percent` as its `cv_percent`."""
    surface = fit_surface(coded, np.log(response) if logarithm else response, names, terms)
    return replace(surface, cv_percent=relative_percent(surface)) if logarithm else surface


def relative_percent(logarithm: Surface) -> float | None:
    """Return 100·s, with s² the mean square of a surface of ln y: nearly the coefficient of variation of y in %."""
    return None if logarithm.mean_square is None else 100.0 * logarithm.mean_square**0.5


def left_out_percent(surface: Surface, logarithm: bool) -> float | None:
    """Return the root mean square of 100·(y − ŷ₍ᵢ₎)/y, with ŷ₍ᵢ₎ the prediction of run i by a fit without this run.

    y − ŷ₍ᵢ₎ = e/(1 − h); for a surface of ln y this is ln(y/ŷ₍ᵢ₎). Runs with a leverage h near 1 are left out, because
    they nearly determine a coefficient alone.
    """
    rows = [row for row in surface.runs_diagnostics if row.leverage < _ALONE]
    if surface.df < 1 or not rows:
        return None
    errors = np.array([row.residual / (1.0 - row.leverage) for row in rows])
    relative = 1.0 - np.exp(-errors) if logarithm else errors / np.array([row.response for row in rows])
    return float(100.0 * np.sqrt(np.mean(relative**2)))
