"""Compare measured with simulated responses over the stem diameter or another condition, and with a power law.

If the model predicts forces no better than F = a·dᵇ fitted to the same measurements, its predictions do not confirm its
mechanics. The power law minimises Σ((F_d − a·dᵇ)/F_d)²; for each exponent b, a = Σr/Σr² with r = dᵇ/F_d.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.regression.least_squares import fit_least_squares
from stemcal.errors import UsageError
from stemcal.notes import Note
from stemcal.power_law import PowerLaw, fit_power_law
from stemcal.storage.typed import absent
from stemcal.vocabulary import CUTTING, Vocabulary, Wording


@dataclass(frozen=True)
class ValidationRow:
    """Measured and simulated response at one condition; simulated value and error are None if the run failed."""

    condition: float
    measured: float
    simulated: float | None
    error_percent: float | None
    role: Literal["fitted", "held_out"]
    sd: float | None = None  # standard deviation of the specimens
    n: int | None = None  # number of specimens
    left_out_percent: float | None = absent()  # error at this fitted condition of a fit to the other conditions


@dataclass(frozen=True)
class Exponent:
    """The exponent b of F = a·dᵇ with its 95 % confidence interval; its limits are None for two points."""

    value: float
    low: float | None
    high: float | None

    @classmethod
    def of(cls, law: PowerLaw | None) -> Exponent | None:
        return None if law is None else cls(law.exponent, *(law.exponent_interval or (None, None)))


@dataclass(frozen=True)
class Validation:
    """Errors at all conditions, and the exponents of measured and simulated forces over the stem diameter.

    The exponents and the slope of the error are None unless the response is a force over the stem diameter.
    """

    rows: tuple[ValidationRow, ...]
    worst_held_out_percent: float | None
    error_slope_percent_per_unit: float | None
    measured_exponent: Exponent | None
    simulated_exponent: Exponent | None
    notes: tuple[Note, ...]


def compare_conditions(
    conditions: Sequence[float],
    measured: Sequence[float],
    simulated: Sequence[float | None],
    calibration_condition: float | Sequence[float] | None,
    scatter: Sequence[tuple[float | None, int | None]] | None = None,
    naming: Vocabulary = CUTTING,
) -> Validation:
    """Compare measured and simulated responses; error = 100·(measured − simulated)/measured.

    None or NaN in `simulated` marks a failed run. `calibration_condition`, one or more, are the conditions used in the
    fit, whose errors are no independent check. `scatter` has the standard deviation and the number of specimens of each
    measured mean, None if unknown. The exponents and the trend of the error are computed only if, by `naming`, the
    response is a force over the stem diameter.
    """
    scatter = scatter or [(None, None)] * len(conditions)
    if not len(conditions) == len(measured) == len(simulated):
        raise UsageError("validation: conditions, measured values and simulated values must be equal in number")
    rows = []
    for at, mean, value, (sd, n) in zip(map(float, conditions), map(float, measured), simulated, scatter, strict=True):
        if mean <= 0.0:
            where = f"{naming.response.text(mean)}{Wording(naming).at(at)}"
            raise UsageError(f"validation: the measured {naming.response.long} must be positive, not {where}")
        fitted = calibration_condition is not None and bool(np.any(np.isclose(at, calibration_condition)))
        known = float(value) if value is not None and np.isfinite(value) else None
        error = error_percent(mean, known)
        rows.append(ValidationRow(at, mean, known, error, "fitted" if fitted else "held_out", sd, n))
    done = [row for row in rows if row.error_percent is not None]
    held_out = [abs(row.error_percent or 0.0) for row in done if row.role == "held_out"]
    grows = naming.is_force_on_stems
    lab = fit_power_law([row.condition for row in rows], [row.measured for row in rows]) if grows else None
    model = fit_power_law([row.condition for row in done], [row.simulated or 0.0 for row in done]) if grows else None
    slope, notes = _error_trend(done) if grows else (None, ())
    return Validation(
        rows=tuple(rows),
        worst_held_out_percent=max(held_out, default=None),
        error_slope_percent_per_unit=slope,
        measured_exponent=Exponent.of(lab),
        simulated_exponent=Exponent.of(model),
        notes=notes,
    )


def standard_error(mean: float, sd: float | None, n: int | None) -> float | None:
    """Return the standard error of a measured mean in percent of the mean; None if it is unknown.

    >>> standard_error(100.0, 12.0, 9), standard_error(100.0, 12.0, None)
    (4.0, None)
    """
    return None if sd is None or n is None else 100.0 * sd / n**0.5 / mean


def error_percent(measured: float, simulated: float | None) -> float | None:
    """Return 100·(measured − simulated)/measured; None without a simulated value.

    >>> error_percent(100.0, 90.0)
    10.0
    """
    return None if simulated is None else 100.0 * (measured - simulated) / measured


def _error_trend(rows: Sequence[ValidationRow]) -> tuple[float | None, tuple[Note, ...]]:
    """Return the slope of the error (% per mm), None with fewer than three diameters, and a note on a clear trend."""
    d = np.array([row.condition for row in rows])
    if len(np.unique(d)) < 3:
        return None, ()
    errors = np.array([row.error_percent for row in rows], dtype=float)
    slope = float(fit_least_squares(np.column_stack([np.ones_like(d), d]), errors).coefficients[1])
    total, explained = (float(np.sum((values - values.mean()) ** 2)) for values in (errors, slope * d))
    if not explained > 0.5 * total > 0.0:
        return slope, ()
    changes = f"{'in' if slope > 0 else 'de'}creases by {abs(slope):.1f}"
    text = (
        f"The relative error {changes} percentage points per mm of diameter. A constant scale factor for the "
        "force would not remove this trend in the error."
    )
    return slope, (Note("error_trend", "warning", text),)


_EXPONENTS = (-2.0, 8.0)  # bounds of b
NORMAL = 1.96  # 95 % of normally distributed means are within this number of standard errors

Better = Literal["model", "formula", "neither"]
Force = tuple[float, float, float | None]
"""Diameter, measured mean force, and the standard error of this mean in percent (None if unknown)."""


@dataclass(frozen=True)
class Formula:
    """The power law F = a·dᵇ, to be compared with the model."""

    exponent: float
    worst_held_out_percent: float  # largest error at diameters that were not used in the fit
    standard_error_percent: float | None = absent()  # largest standard error of the measured means at these diameters

    def better(self, model_percent: float) -> Better:
        """Return the better predictor at held-out diameters; `model_percent` is the largest error of the model there.

        It is ``neither`` if the errors differ by less than 1.96 standard errors of the measured mean, since the
        scatter of the specimens may then explain the difference.

        >>> Formula(2.6, 0.1, 4.7).better(3.0), Formula(2.6, 0.1, 1.0).better(3.0), Formula(2.6, 9.0).better(3.0)
        ('neither', 'formula', 'model')
        """
        difference = model_percent - self.worst_held_out_percent
        if abs(difference) <= NORMAL * (self.standard_error_percent or 0.0):
            return "neither"
        return "formula" if difference > 0.0 else "model"


def formula_elsewhere(fitted: Sequence[Force], held_out: Sequence[Force]) -> Formula | None:
    """Fit F = a·dᵇ to the forces at the fitted diameters; return it with its error at the held-out diameters.

    None with fewer than two fitted diameters, which do not determine the exponent, or without a held-out one.

    >>> formula_elsewhere([(8.0, 159.2, None)], [(7.0, 120.0, None), (11.0, 378.2, None)]) is None
    True
    >>> round(formula_elsewhere([(8.0, 159.2, None), (11.0, 378.2, None)], [(7.0, 120.0, None)]).exponent, 3)
    2.717
    """
    if len({force[0] for force in fitted}) < 2 or not held_out:
        return None
    d, f = np.array([force[:2] for force in fitted], dtype=float).T
    at, measured = np.array([force[:2] for force in held_out], dtype=float).T
    b = _exponent(d, f)
    errors = 1.0 - _factor(d, f, b) * (at / d[0]) ** b / measured
    standard_errors = [percent for *_, percent in held_out if percent is not None]
    return Formula(b, float(100.0 * np.max(np.abs(errors))), max(standard_errors, default=None))


def formula_left_out(forces: Sequence[Force]) -> Formula | None:
    """Fit F = a·dᵇ to all forces; its error is from cross-validation, in which each diameter is left out in turn.

    None with fewer than three diameters.

    >>> round(formula_left_out([(7.0, 49.0, None), (8.0, 64.0, None), (9.0, 81.0, None)]).exponent, 6)
    2.0
    """
    turns = []
    for left in {d for d, *_ in forces}:
        others, held_out = ([force for force in forces if (force[0] == left) == out] for out in (False, True))
        if (formula := formula_elsewhere(others, held_out)) is not None:
            turns.append(formula)
    if not turns:
        return None
    errors = [turn.standard_error_percent for turn in turns if turn.standard_error_percent is not None]
    b = _exponent(*np.array([force[:2] for force in forces], dtype=float).T)
    return Formula(b, max(turn.worst_held_out_percent for turn in turns), max(errors, default=None))


def _exponent(d: Array, f: Array) -> float:
    """Return the exponent b with the least sum of squared relative errors of the forces `f` at the diameters `d`."""
    from scipy.optimize import minimize_scalar

    def sum_of_squares(b: float) -> float:
        return float(np.sum((1.0 - _factor(d, f, b) * (d / d[0]) ** b / f) ** 2))

    return float(minimize_scalar(sum_of_squares, bounds=_EXPONENTS, method="bounded", options={"xatol": 1e-9}).x)


def _factor(d: Array, f: Array, b: float) -> float:
    """Return the best factor a = Σr/Σr² of F = a·(d/d₁)ᵇ for an exponent b; d₁ is d[0] and r = (d/d₁)ᵇ/F."""
    r = (d / d[0]) ** b / f
    return float(r.sum() / (r @ r))
