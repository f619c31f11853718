"""Results of a run besides its maximum force: its curve, travel and work to the maximum, scatter."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stemcal.errors import SimulationFailed, UsageError
from stemcal.measured.curve_modes import CurveModes
from stemcal.study.model.measured_targets import named_modes

Array = NDArray[np.float64]


def work_until(travel: ArrayLike, force: ArrayLike, end: float) -> float:
    """Integrate the force over the travel from first touch to `end`; N·mm, which is mJ.

    W = ∫₀ᵉⁿᵈ F du by the trapezoidal rule, the force at both ends interpolated.

    >>> work_until([-1.0, 0.0, 1.0, 2.0], [0.0, 0.0, 10.0, 20.0], 1.5)
    11.25
    """
    u, f = np.asarray(travel, dtype=float), np.asarray(force, dtype=float)
    inner = u[(u > 0.0) & (u < end)]
    points = np.concatenate([[0.0], inner, [max(end, 0.0)]])
    return float(np.trapezoid(np.interp(points, u, f), points))


def kept_rows(count: int, most: int = 200) -> NDArray[np.int64]:
    """Return which of `count` rows of a history a record keeps: the first, the last, evenly between."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def kept_curve(travel: Array, force: Array, most: int = 200) -> dict[str, list[float]]:
    """Return what a record keeps of the force (N) over the travel (mm)."""
    rows = kept_rows(len(travel), most)
    return {
        "travel": [round(float(value), 6) for value in travel[rows]],
        "force": [round(float(value), 4) for value in force[rows]],
    }


def curve_scores(modes: CurveModes | None, travel: Array, force: Array, broke: float | None = None) -> dict[str, float]:
    """Return the score of a simulated curve (mm, N) on each mode of those measured, by the name of the response.

    What follows the travel at which the stem `broke` (mm) counts for nothing. Without modes there are no scores.

    Raises
    ------
    SimulationFailed
        If the force stays below the preload that measured curves begin with, or has no rise.
    """
    if modes is None:
        return {}
    end = len(travel) if broke is None else int(np.searchsorted(travel, broke))
    try:
        found = modes.scores(travel[:end], force[:end])
    except UsageError as error:
        raise SimulationFailed("no_curve", str(error)) from error
    return {named.name: score for named, score in zip(named_modes([modes]), found, strict=True)}


def measures(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``travel`` (mm) and ``work`` (mJ) to the maximum of the recorded curve, if a run's details have one."""
    if (end := details.get("peak_travel")) is None:
        return {}
    curve = details.get("curve")
    return {"travel": end, **({"work": work_until(curve["travel"], curve["force"], end)} if curve else {})}
