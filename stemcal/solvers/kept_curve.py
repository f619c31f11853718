"""The force–travel curve in the record of a run, and its scores on the principal components of measured curves."""

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array
from stemcal.errors import SimulationFailed, UsageError
from stemcal.measured.curve_modes import CurveModes
from stemcal.study.model.measured_targets import named_modes

_KEPT = 200  # largest number of rows of a curve in a record


def kept_rows(count: int) -> NDArray[np.int64]:
    """Return the indices of the stored rows of a history of `count` rows, evenly spaced from the first to the last."""
    return np.unique(np.linspace(0, count - 1, _KEPT).round().astype(np.int64))


def kept_curve(travel: Array, force: Array) -> dict[str, list[float]]:
    """Return the stored points of a curve of force (N) over travel (mm)."""
    rows = kept_rows(len(travel))
    return {
        "travel": [round(float(value), 6) for value in travel[rows]],
        "force": [round(float(value), 4) for value in force[rows]],
    }


def curve_scores(modes: CurveModes | None, travel: Array, force: Array, broke: float | None = None) -> dict[str, float]:
    """Return the scores of a simulated curve (mm, N), by response name; {} if no curves were measured (no `modes`).

    A mode is a principal component of the measured curves, and a score the part of the curve along a mode. The curve is
    used up to the travel (mm) at which the stem `broke`. Raises `SimulationFailed` if the force does not exceed the
    preload, or has no rise.
    """
    if modes is None:
        return {}
    end = len(travel) if broke is None else int(np.searchsorted(travel, broke))
    try:
        scores = modes.scores(travel[:end], force[:end])
    except UsageError as error:
        raise SimulationFailed("no_curve", str(error)) from error
    return {response.name: score for response, score in zip(named_modes([modes]), scores, strict=True)}
