"""Measured against simulated force over the stem diameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.regression import Array, fit_least_squares, t_quantile
from stemcal.errors import UsageError


@dataclass(frozen=True)
class ValidationRow:
    """One diameter; simulated and error are None where the run failed."""

    diameter: float
    measured: float
    simulated: float | None
    error_percent: float | None
    role: str


@dataclass(frozen=True)
class Exponent:
    """b of force ~ diameter^b, with its 95 % interval (None with fewer than three points)."""

    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Validation:
    """Errors by diameter, and how force grows with diameter in the laboratory and in the model."""

    rows: tuple[ValidationRow, ...]
    max_abs_error_percent: float | None
    mean_abs_error_percent: float | None
    max_abs_error_percent_independent: float | None
    best_scaled_max_error_percent: float | None
    error_slope_percent_per_mm: float | None
    measured_exponent: Exponent | None
    simulated_exponent: Exponent | None
    notes: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the contents of ``validate.json``."""
        return {**asdict(self), "rows": [asdict(row) for row in self.rows], "notes": list(self.notes)}


def compare_diameters(
    diameters: Sequence[float],
    measured: Sequence[float],
    simulated: Sequence[float | None],
    calibration_diameter: float | None,
) -> Validation:
    """Compare forces; error = 100·(measured − simulated)/measured.

    Parameters
    ----------
    diameters : mm
    measured, simulated : N
        None or NaN in `simulated` marks a failed run.
    calibration_diameter : mm
        The diameter the parameters were fitted at: no independent check.
    """
    if not len(diameters) == len(measured) == len(simulated):
        raise UsageError("validation: diameters, measured and simulated forces differ in number")
    rows = tuple(
        _row(float(d), float(m), s, calibration_diameter)
        for d, m, s in zip(diameters, measured, simulated, strict=True)
    )
    done = [row for row in rows if row.error_percent is not None]
    sizes = [abs(row.error_percent or 0.0) for row in done]
    independent = [abs(row.error_percent or 0.0) for row in done if row.role == "validation"]
    slope = _error_slope(done)
    lab = power_law_exponent(diameters, measured)
    model = power_law_exponent([row.diameter for row in done], [row.simulated or 0.0 for row in done])
    return Validation(
        rows=rows,
        max_abs_error_percent=max(sizes, default=None),
        mean_abs_error_percent=float(np.mean(sizes)) if sizes else None,
        max_abs_error_percent_independent=max(independent, default=None),
        best_scaled_max_error_percent=_best_scaled_error(done),
        error_slope_percent_per_mm=slope,
        measured_exponent=lab,
        simulated_exponent=model,
        notes=tuple(_notes(rows, slope, lab, model)),
    )


def _row(
    diameter: float, measured: float, simulated: float | None, calibration: float | None
) -> ValidationRow:
    if measured <= 0.0:
        raise UsageError(f"validation: measured force {measured:g} N at {diameter:g} mm must be positive")
    role = "calibration" if calibration is not None and np.isclose(diameter, calibration) else "validation"
    if simulated is None or not np.isfinite(simulated):
        return ValidationRow(diameter, measured, None, None, role)
    return ValidationRow(
        diameter, measured, float(simulated), 100.0 * (measured - simulated) / measured, role
    )


def power_law_exponent(diameters: ArrayLike, forces: ArrayLike) -> Exponent | None:
    """Fit log force = a + b·log diameter.

    None below two distinct diameters or with a force that is not positive.
    """
    d, force = np.asarray(diameters, dtype=float), np.asarray(forces, dtype=float)
    if len(np.unique(d)) < 2 or np.any(d <= 0.0) or np.any(force <= 0.0):
        return None
    slope, error, df = _line(np.log(d), np.log(force))
    if error is None:
        return Exponent(slope, None, None)
    half_width = t_quantile(0.95, df) * error
    return Exponent(slope, slope - half_width, slope + half_width)


def _line(x: Array, y: Array) -> tuple[float, float | None, int]:
    """Slope of a straight line, its standard error and residual df."""
    fit = fit_least_squares(np.column_stack([np.ones_like(x), x]), y)
    errors = fit.standard_errors
    return float(fit.coefficients[1]), None if errors is None else float(errors[1]), fit.df


def _error_slope(rows: Sequence[ValidationRow]) -> float | None:
    """Change of the error per millimetre of diameter, from three diameters on."""
    d = np.array([row.diameter for row in rows])
    if len(np.unique(d)) < 3:
        return None
    return _line(d, np.array([row.error_percent for row in rows], dtype=float))[0]


def _best_scaled_error(rows: Sequence[ValidationRow]) -> float | None:
    """Worst error left when all simulated forces are multiplied by the one best number.

    With r = simulated/measured the best number is 2/(min r + max r), and the worst error
    (max r − min r)/(max r + min r).
    """
    if not rows:
        return None
    ratios = [(row.simulated or 0.0) / row.measured for row in rows]
    low, high = min(ratios), max(ratios)
    return 100.0 * (high - low) / (high + low) if high + low > 0.0 else None


def _notes(
    rows: Sequence[ValidationRow], slope: float | None, lab: Exponent | None, model: Exponent | None
) -> list[str]:
    notes = [
        f"{row.diameter:g} mm is the calibration diameter: its error is not an independent check."
        for row in rows
        if row.role == "calibration"
    ]
    failed = [f"{row.diameter:g} mm" for row in rows if row.simulated is None]
    if failed:
        notes.append(f"No simulated force at {', '.join(failed)}: the run failed.")
    if slope is not None and _is_trend(rows, slope):
        notes.append(
            f"The error changes by {slope:+.1f} % per mm of diameter: it is a trend, which no common factor "
            "on the force removes."
        )
    if lab is not None and model is not None:
        notes.append(f"Measured force grows as d^{lab.value:.2f}, simulated as d^{model.value:.2f}.")
    if (better := _better_curve(rows)) is not None:
        notes.append(better)
    return notes


def _is_trend(rows: Sequence[ValidationRow], slope: float) -> bool:
    """Whether the straight line explains most of the errors' variation."""
    done = [row for row in rows if row.error_percent is not None]
    errors = np.array([row.error_percent for row in done], dtype=float)
    d = np.array([row.diameter for row in done])
    total = float(np.sum((errors - errors.mean()) ** 2))
    return total > 0.0 and slope**2 * float(np.sum((d - d.mean()) ** 2)) > 0.5 * total


def _better_curve(rows: Sequence[ValidationRow]) -> str | None:
    """Compare power law and straight line on the measured forces by AICc; both have three parameters.

    AICc differs by n·ln(RSS) alone, with 2·Σln(force) added to the power law for its logarithmic scale.
    """
    d, force = np.array([row.diameter for row in rows]), np.array([row.measured for row in rows])
    n = len(np.unique(d))
    if n < 5:  # AICc of three parameters needs n > 4
        return None
    ones = np.ones_like(d)
    straight = fit_least_squares(np.column_stack([ones, d]), force).residual_ss
    power = fit_least_squares(np.column_stack([ones, np.log(d)]), np.log(force)).residual_ss
    if min(straight, power) <= 0.0:
        return None
    gain = len(d) * np.log(straight) - len(d) * np.log(power) - 2.0 * float(np.sum(np.log(force)))
    winner, loser = ("a power law", "a straight line") if gain > 0.0 else ("a straight line", "a power law")
    return (
        f"Over the diameters {winner} describes the measured force better than {loser} "
        f"(AICc lower by {abs(gain):.1f})."
    )
