"""Programs with chance in them: each point simulated several times over, each time a run of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stemcal.runs.outcome import Outcome, Replicates
from stemcal.solvers.protocol import Request

__all__ = ["Scatter", "merged", "pooled", "repeated"]


def repeated(requests: Sequence[Request], times: int) -> list[Request]:
    """Return every request so many times over, numbered from 1; as it is for 0, which no chance is in."""
    if not times:
        return list(requests)
    return [replace(request, replicate=number) for request in requests for number in range(1, times + 1)]


def merged(outcomes: Sequence[Outcome], times: int) -> list[Outcome]:
    """Return one outcome for so many replicates of each point: the mean of those that succeeded."""
    if not times:
        return list(outcomes)
    return [_mean(outcomes[i : i + times]) for i in range(0, len(outcomes), times)]


def _mean(replicates: Sequence[Outcome]) -> Outcome:
    done = [outcome for outcome in replicates if outcome.ok and outcome.force is not None]
    first = done[0] if done else replicates[0]
    values = tuple(outcome.force for outcome in done if outcome.force is not None)
    told = Replicates(values, tuple(outcome.key for outcome in replicates))
    return replace(first, force=float(np.mean(values)) if values else None, replicates=told)


@dataclass(frozen=True)
class Scatter:
    """The standard deviation of the mean over replicates, as a share of it, with its degrees of freedom."""

    share: float
    df: int


def pooled(outcomes: Sequence[Outcome]) -> Scatter | None:
    """Return the scatter of means over replicates, pooled over points; None where nothing was repeated."""
    groups = [np.array(told.forces) for outcome in outcomes if (told := outcome.replicates) and len(told.forces) > 1]
    df = sum(len(forces) - 1 for forces in groups)
    if not df or any(forces.mean() == 0.0 for forces in groups):
        return None
    square = sum(float(np.sum((forces / forces.mean() - 1.0) ** 2)) for forces in groups) / df
    times = sum(map(len, groups)) / len(groups)
    return Scatter(float(np.sqrt(square / times)), df)
