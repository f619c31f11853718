"""What a run keeps of its force over the travel: a curve of a few hundred points, and its scores on measured modes."""

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import SimulationFailed, UsageError
from stemcal.measured.curve_modes import CurveModes
from stemcal.study.model.measured_targets import named_modes

Array = NDArray[np.float64]
_KEPT = 200  # rows at most


def kept_rows(count: int) -> NDArray[np.int64]:
    """Return the rows of a history of `count` that a record keeps: the first, the last, evenly between."""
    return np.unique(np.linspace(0, count - 1, _KEPT).round().astype(np.int64))


def kept_curve(travel: Array, force: Array) -> dict[str, list[float]]:
    """Return the points of the force (N) over the travel (mm) that a record keeps."""
    rows = kept_rows(len(travel))
    return {
        "travel": [round(float(value), 6) for value in travel[rows]],
        "force": [round(float(value), 4) for value in force[rows]],
    }


def curve_scores(modes: CurveModes | None, travel: Array, force: Array, broke: float | None = None) -> dict[str, float]:
    """Return the score of a simulated curve (mm, N) on each mode of those measured, by the name of the response.

    What follows the travel at which the stem `broke` (mm) counts for nothing. Without modes there are no scores. Raises
    `SimulationFailed` if the force stays below the preload that measured curves begin with, or has no rise.
    """
    if modes is None:
        return {}
    end = len(travel) if broke is None else int(np.searchsorted(travel, broke))
    try:
        found = modes.scores(travel[:end], force[:end])
    except UsageError as error:
        raise SimulationFailed("no_curve", str(error)) from error
    return {named.name: score for named, score in zip(named_modes([modes]), found, strict=True)}
