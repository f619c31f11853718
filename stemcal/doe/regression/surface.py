"""The response surface: a quadratic model in coded units, full or reduced, with ANOVA, intervals and diagnostics."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from stemcal.arrays import Array
from stemcal.doe.coding import term_columns, term_gradient, term_names
from stemcal.doe.regression import least_squares
from stemcal.doe.regression.anova import FitStatistics, LackOfFit, lack_of_fit, statistics_of
from stemcal.errors import UsageError
from stemcal.formats import counted
from stemcal.notes import Note
from stemcal.vocabulary import Wording

ROUGH_PERCENT = 3.0
"""A response counts as rough if its standard deviation about a smooth surface exceeds this percentage of the mean:
most responses with a true roughness of 5 % do, none with 1 % does (docs/reference/verdict.md)."""

_ROUNDING = 1e-12  # a smaller correlation is due to rounding


@dataclass(frozen=True, eq=False)
class Surface(FitStatistics):
    """A fitted quadratic model. Methods take coded points (m, k) and return values (m,) or intervals (m, 2).

    `beta` and `unscaled_covariance` contain all terms of the full quadratic, with zeros for terms that were not fitted.
    """

    names: tuple[str, ...]
    notes: tuple[Note, ...]
    design: Array  # coded runs (n, k) of the fit, without failed runs and copies
    beta: Array
    unscaled_covariance: Array
    mean_square: float | None  # residual mean square s², the basis of all intervals
    df: int
    response: Array
    copies: int = 0  # number of runs that are exact copies of others, left out of the fit
    deterministic: bool = False  # whether there are copies, which only a deterministic solver returns

    @property
    def terms(self) -> tuple[str, ...]:
        """The terms that were fitted, including the mean."""
        return tuple(coefficient.term for coefficient in self.coefficients)

    @property
    def covariance(self) -> tuple[tuple[float, ...], ...] | None:
        """Covariance s²(XᵀX)⁻¹ of the fitted coefficients; None without residual degrees of freedom."""
        if self.mean_square is None:
            return None
        kept = [term_names(self.names).index(term) for term in self.terms]
        scaled = self.mean_square * self.unscaled_covariance[np.ix_(kept, kept)]
        errors = np.sqrt(np.diag(scaled))
        return tuple(map(tuple, np.where(abs(scaled) > _ROUNDING * np.outer(errors, errors), scaled, 0.0).tolist()))

    @property
    def design_radius(self) -> float:
        """Coded distance of the outermost run from the centre."""
        return float(np.linalg.norm(self.design, axis=1).max())

    @property
    def leading(self) -> int:
        """Index of the factor with the largest linear coefficient."""
        return int(np.argmax(np.abs(self.beta[1 : len(self.names) + 1])))

    @property
    def own_scatter(self) -> float:
        """Variance of a single run about the mean response in units of s²; below 1 for a deterministic solver.

        A run of a deterministic solver scatters only if the response is rough, that is if σ exceeds c = `ROUGH_PERCENT`
        of the mean. The variance is therefore the probability of this, P(σ > c) = P(χ²(ν) < ν·(s/c)²), for the estimate
        s with ν degrees of freedom and the prior p(σ) ∝ 1/σ.
        """
        from scipy.special import chdtr

        if not self.deterministic or self.cv_percent is None:
            return 1.0
        return float(chdtr(self.df, self.df * (self.cv_percent / ROUGH_PERCENT) ** 2))

    def predict(self, coded: ArrayLike) -> Array:
        """Return the predicted response ŷ = φᵀβ, with φ the terms at the point."""
        return np.asarray(term_columns(coded) @ self.beta)

    def gradient(self, coded: ArrayLike) -> Array:
        """Return ∂ŷ/∂x at one point, (k,)."""
        return np.asarray(self.beta @ term_gradient(coded))

    def unscaled_variance(self, coded: ArrayLike) -> Array:
        """Return φᵀ(XᵀX)⁻¹φ, the variance of the prediction ŷ in units of s²."""
        phi = term_columns(coded)
        return np.asarray(np.einsum("ij,jk,ik->i", phi, self.unscaled_covariance, phi))

    def mean_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Return the confidence interval of the mean response: ŷ ± t·s·√(φᵀ(XᵀX)⁻¹φ)."""
        return self._interval(coded, level, 0.0)

    def prediction_interval(self, coded: ArrayLike, level: float = 0.95) -> Array:
        """Return the prediction interval for one further run: ŷ ± t·s·√(`own_scatter` + φᵀ(XᵀX)⁻¹φ)."""
        return self._interval(coded, level, self.own_scatter)

    def moved(self, coded: ArrayLike, response: float) -> "Surface":
        """Return a copy that passes through a response at a point: a constant is added to ŷ."""
        beta = self.beta.copy()
        beta[0] += response - float(self.predict(coded)[0])
        return replace(self, beta=beta)

    def _interval(self, coded: ArrayLike, level: float, extra: float) -> Array:
        t = least_squares.t_quantile(level, self.df) if self.df else np.nan
        s2 = np.nan if self.mean_square is None else self.mean_square
        half_width = t * np.sqrt(s2 * (extra + self.unscaled_variance(coded)))
        middle = self.predict(coded)
        return np.column_stack([middle - half_width, middle + half_width])


def fit_surface(
    coded: ArrayLike,
    response: ArrayLike,
    names: Sequence[str],
    terms: Sequence[str] | None = None,
    written: Wording = Wording(),
) -> Surface:
    """Fit y = β₀ + Σβᵢxᵢ + Σβᵢⱼxᵢxⱼ + Σβᵢᵢxᵢ² by least squares, or only some of its `terms` (see `term_names`).

    `coded` (n, k) are the design points; the response (n,) is NaN for failed runs, which are left out. `written` has
    names and units for notes. If a term cannot be estimated, raises `RunsFailed`, or `UsageError` if no run failed.
    """
    points, y = np.asarray(coded, dtype=float), np.asarray(response, dtype=float)
    if points.ndim != 2 or points.shape != (y.size, len(names)):
        shapes = f"a design of shape {points.shape} does not match {y.size} responses and {len(names)} factors"
        raise UsageError(f"response surface: {shapes}")
    copies = least_squares.copies_of(points, y)
    present, n_failed = np.isfinite(y) & ~copies, int(np.sum(~np.isfinite(y)))
    kept, every = _kept(names, terms), term_names(names)
    matrix = term_columns(points)[present][:, kept]
    chosen = [every[i] for i in kept]
    least_squares.require_estimable(matrix, chosen, n_failed, "response surface")
    fit = least_squares.fit_least_squares(matrix, y[present])
    split = lack_of_fit(points[present], fit)
    beta, covariance = np.zeros(len(every)), np.zeros((len(every), len(every)))
    beta[kept] = fit.coefficients
    covariance[np.ix_(kept, kept)] = fit.unscaled_covariance
    surface = Surface(
        **vars(statistics_of(fit, chosen, split, (np.flatnonzero(present) + 1).tolist(), n_failed)),
        names=tuple(names),
        notes=(),
        design=points[present],
        beta=beta,
        unscaled_covariance=covariance,
        mean_square=fit.mean_square,
        df=fit.df,
        response=fit.response,
        copies=int(copies.sum()),
        deterministic=bool(copies.any()),
    )
    return replace(surface, notes=tuple(_surface_notes(surface, fit, split, written)))


def _kept(names: Sequence[str], terms: Sequence[str] | None) -> list[int]:
    known = term_names(names)
    if terms is None:
        return list(range(len(known)))
    if unknown := [term for term in terms if term not in known]:
        raise UsageError(f"response surface: unknown term {unknown[0]!r}; the available terms are {', '.join(known)}")
    return [i for i, term in enumerate(known) if i == 0 or term in terms]


# Common rules: the adequate precision should be above 4, Cook's distance of a run below 1, and variance inflation
# factors below 10.
_ADEQUATE, _INFLUENTIAL, _ENTANGLED = 4.0, 1.0, 10.0


def flat_response(consequence: str) -> Note:
    """Return a warning that all runs have the same response, and its `consequence`."""
    return Note("flat_response", "warning", f"All runs have the same response, so {consequence}.")


def _surface_notes(
    surface: Surface, fit: least_squares.LeastSquares, split: LackOfFit, written: Wording
) -> Iterator[Note]:
    """Yield notes on the reliability of the fit: failed runs, collinearity, lack of fit, influential runs."""
    failed, copies, precision = surface.runs_failed, surface.copies, surface.adequate_precision
    largest = max((row.vif for row in surface.coefficients if row.vif is not None), default=1.0)
    if failed:
        text = (
            f"{failed} of {len(fit.response) + failed} runs failed. The response surface is fitted to the remaining "
            f"runs, with {fit.df} residual degrees of freedom and variance inflation factors of up to {largest:.2f}."
        )
        yield Note("surface_runs_failed", "warning", text)
    if largest > _ENTANGLED:
        vif = f"largest variance inflation factor: {largest:.1f}"
        yield Note("terms_entangled", "caution", f"Some terms of the response surface are nearly collinear ({vif}).")
    if fit.flat:
        yield flat_response("the response surface is constant")
    elif fit.df == 0:
        text = "The response surface has as many coefficients as runs, so its error cannot be estimated."
        yield Note("saturated_surface", "warning", text)
    elif fit.exact:
        text = "The response surface passes through every run, so F values cannot be computed."
        yield Note("exact_surface", "caution", text)
    if copies:
        text = (
            f"The solver is deterministic: {counted(copies, 'run')} returned the same results as "
            f"earlier runs. Each point is counted once, which leaves {fit.df} residual degrees of freedom."
        )
        yield Note("copies_only", "info", text)
    yield from _lack_of_fit_notes(split)
    if precision is not None and precision < _ADEQUATE:
        text = f"The adequate precision of {precision:.2f} is below {_ADEQUATE:g}"
        yield Note("mostly_noise", "warning", f"{text}, so the response surface mainly represents noise.")
    for run in surface.runs_diagnostics:
        if run.cooks_distance is not None and run.cooks_distance > _INFLUENTIAL:
            named = f"Run {run.run} ({written.quantity(run.response, 'g')})"
            text = f"{named} strongly influences the response surface (Cook's distance {run.cooks_distance:.2f})."
            yield Note("influential_run", "caution", text)


def _lack_of_fit_notes(split: LackOfFit) -> Iterator[Note]:
    if split.pure_df == 0:
        text = "Lack of fit cannot be tested because no point has repeated runs with different responses."
        yield Note("nothing_repeated", "caution", text)
    elif split.df == 0:
        text = "the response surface has as many terms as there are distinct points"
        yield Note("no_point_to_spare", "caution", f"Lack of fit cannot be tested because {text}.")


# Backward elimination keeps the model hierarchical: an interaction or square is kept only together with its linear
# terms. Then the model does not depend on the coding of the factors. Source: J. L. Peixoto, The American Statistician
# 44 (1990), 26–30.


@dataclass(frozen=True)
class ReductionStep:
    """A removed term and the p-value of its F test."""

    term: str
    p: float


def reduce_surface(
    coded: ArrayLike, response: ArrayLike, names: Sequence[str], alpha: float = 0.1, written: Wording = Wording()
) -> tuple[Surface, tuple[ReductionStep, ...]]:
    """Fit the quadratic model and remove the least significant term as long as its p > alpha.

    Returns the reduced surface and the removed terms. Raises `UsageError` if the runs cannot estimate the full model.
    """
    points, y, chosen = np.asarray(coded, dtype=float), np.asarray(response, dtype=float), list(term_names(names))
    present = np.isfinite(y) & ~least_squares.copies_of(points, y)
    columns = term_columns(points[present])
    if least_squares.not_estimable(columns, chosen):
        raise UsageError(
            f"rsm.reduce: backward elimination starts from the full quadratic model, but its {columns.shape[1]} "
            f"coefficients cannot be estimated from {np.count_nonzero(present)} runs; add runs"
        )
    steps: list[ReductionStep] = []
    while removable := _removable(chosen):
        fit = least_squares.fit_least_squares(columns, y[present])
        tests = [least_squares.f_test(float(fit.partial_ss[i]), 1, fit.mean_square, fit.df) for i in removable]
        ps = [test[1] if test and not fit.exact else 0.0 for test in tests]
        weakest = int(np.argmax(ps))
        if ps[weakest] <= alpha:
            break
        place = removable[weakest]
        steps.append(ReductionStep(chosen.pop(place), ps[weakest]))
        columns = np.delete(columns, place, axis=1)
    return fit_surface(coded, response, names, chosen, written), tuple(steps)


def _removable(chosen: Sequence[str]) -> list[int]:
    needed = {"1"}.union(*(term.removesuffix("^2").split(":") for term in chosen if ":" in term or "^2" in term))
    return [i for i, term in enumerate(chosen) if term not in needed]
