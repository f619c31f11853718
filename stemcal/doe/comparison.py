"""Measured against simulated response over the stem diameter or another condition, and against a formula.

A model that predicts no better than F = a·dᵇ through the same forces has shown nothing of what it is made of. The
formula is fitted to the least sum of squared relative errors, Σ((F_d − a·dᵇ)/F_d)², for which a is known where b is:
with r = dᵇ/F it is Σr/Σr².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stemcal.doe.coding import Array
from stemcal.doe.regression.least_squares import fit_least_squares
from stemcal.errors import UsageError
from stemcal.notes import Note
from stemcal.power_law import PowerLaw, fit_power_law
from stemcal.storage.typed import absent
from stemcal.vocabulary import CUTTING, Vocabulary, Wording


@dataclass(frozen=True)
class ValidationRow:
    """One diameter, or other condition; simulated and error are None where the run failed."""

    condition: float
    measured: float
    simulated: float | None
    error_percent: float | None
    role: Literal["fitted", "held_out"]
    sd: float | None = None
    n: int | None = None
    left_out_percent: float | None = absent()
    """Error of a fitted condition, predicted from a fit to the others."""


@dataclass(frozen=True)
class Exponent:
    """b of force ~ diameter^b, with its 95 % interval (None with fewer than three points)."""

    value: float
    low: float | None
    high: float | None

    @classmethod
    def of(cls, law: PowerLaw | None) -> Exponent | None:
        """Return that of a law, None where there is none."""
        return None if law is None else cls(law.exponent, *(law.exponent_interval or (None, None)))


@dataclass(frozen=True)
class Validation:
    """Errors by diameter, and how force grows with diameter, None where it is no force over the stem's diameter."""

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
    """Compare responses; error = 100·(measured − simulated)/measured.

    None or NaN in `simulated` marks a failed run. The parameters were fitted at `calibration_condition`, one or more:
    no independent check. `scatter` has standard deviation and number of specimens of each measured mean, None where
    unknown. Only forces over stems (`naming`) have exponents, and are looked through for a trend.
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
    """Return the standard error of a measured mean in percent of it, None where it is unknown.

    >>> standard_error(100.0, 12.0, 9), standard_error(100.0, 12.0, None)
    (4.0, None)
    """
    return None if sd is None or n is None else 100.0 * sd / n**0.5 / mean


def error_percent(measured: float, simulated: float | None) -> float | None:
    """Return 100·(measured − simulated)/measured; None where there is no simulated value.

    >>> error_percent(100.0, 90.0)
    10.0
    """
    return None if simulated is None else 100.0 * (measured - simulated) / measured


def _error_trend(rows: Sequence[ValidationRow]) -> tuple[float | None, tuple[Note, ...]]:
    """Return the slope of the error over three diameters or more, with a note if it explains most of the variation."""
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


# ---- a formula without mechanics

_EXPONENTS = (-2.0, 8.0)
_NORMAL = 1.96  # standard errors by which a measured mean may be off, at 95 %

Better = Literal["model", "formula", "neither"]
Force = tuple[float, float, float | None]
"""Diameter, measured mean, and its standard error in percent, None where it is unknown."""


@dataclass(frozen=True)
class Formula:
    """F = a·dᵇ: b, the largest error at held-out diameters and the largest standard error of these means, percent."""

    exponent: float
    worst_held_out_percent: float
    standard_error_percent: float | None = absent()

    def better(self, model_percent: float) -> Better:
        """Return the better prediction; neither if the scatter of the measured means explains the difference.

        A mean is off by more than 1.96 standard errors in 5 % of cases, and with it the difference of two errors.

        >>> Formula(2.6, 0.1, 4.7).better(3.0), Formula(2.6, 0.1, 1.0).better(3.0), Formula(2.6, 9.0).better(3.0)
        ('neither', 'formula', 'model')
        """
        difference = model_percent - self.worst_held_out_percent
        if abs(difference) <= _NORMAL * (self.standard_error_percent or 0.0):
            return "neither"
        return "formula" if difference > 0.0 else "model"


def formula_elsewhere(fitted: Sequence[Force], held_out: Sequence[Force]) -> Formula | None:
    """Return F = a·dᵇ through the forces at two fitted diameters or more, and its error at the held-out ones.

    None without either: through a single diameter the exponent would be an assumption, and no comparison with it.

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
    known = [error for *_, error in held_out if error is not None]
    return Formula(b, float(100.0 * np.max(np.abs(errors))), max(known, default=None))


def formula_left_out(forces: Sequence[Force]) -> Formula | None:
    """Return F = a·dᵇ through all forces, its largest error that at a diameter left out, each in turn.

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
    """Return b of the least sum of squared relative errors."""
    from scipy.optimize import minimize_scalar

    def missed(b: float) -> float:
        return float(np.sum((1.0 - _factor(d, f, b) * (d / d[0]) ** b / f) ** 2))

    return float(minimize_scalar(missed, bounds=_EXPONENTS, method="bounded", options={"xatol": 1e-9}).x)


def _factor(d: Array, f: Array, b: float) -> float:
    """Return a of F = a·(d/d₁)ᵇ: Σr/Σr²."""
    r = (d / d[0]) ** b / f
    return float(r.sum() / (r @ r))
