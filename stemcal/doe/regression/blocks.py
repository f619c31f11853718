"""Runs made together: each block gets a level of its own, whose effects add up to zero."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stemcal.doe.regression.least_squares import Array, LeastSquares
from stemcal.errors import UsageError


def block_columns(blocks: Sequence[object] | None, present: NDArray[np.bool_]) -> tuple[Array, list[str]]:
    """Code B blocks by B − 1 columns whose effects, with the last block's, add up to zero."""
    if blocks is None:
        return np.empty((int(present.sum()), 0)), []
    require_labels(blocks, present.size)
    of_run = [str(block) for block, there in zip(blocks, present, strict=True) if there]
    labels = list(dict.fromkeys(of_run))
    if len(labels) < 2:
        return np.empty((len(of_run), 0)), []
    number = np.array([labels.index(label) for label in of_run])
    coding = np.vstack([np.eye(len(labels) - 1), -np.ones(len(labels) - 1)])
    return coding[number], labels


def require_labels(blocks: Sequence[object], runs: int) -> None:
    """Raise `UsageError` unless every run has its label."""
    if len(blocks) != runs:
        raise UsageError(f"response surface: {len(blocks)} block labels for {runs} runs; give one per run")


def block_effects(fit: LeastSquares, labels: Sequence[str]) -> dict[str, float]:
    """Return how far each block lies above the mean of the blocks; empty without blocks."""
    if not labels:
        return {}
    effects = [float(value) for value in fit.coefficients[-fit.blocks :]]
    return dict(zip(labels, [*effects, -sum(effects)], strict=True))
