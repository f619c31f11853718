"""Programs with chance in them: each point simulated several times over, each time a run of its own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np

from stemcal.naming import FIRST
from stemcal.runs.outcome import Outcome, Replicates
from stemcal.solvers.protocol import Request


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
    done = [outcome for outcome in replicates if outcome.ok and outcome.response is not None]
    first, keys = done[0] if done else replicates[0], tuple(outcome.key for outcome in replicates)
    if not done:
        return replace(first, replicates=Replicates((), keys))
    further = {name: _values(done, name) for name in first.responses or {}}
    values = _values(done, FIRST)
    return replace(
        first,
        response=fmean(values),
        responses={name: fmean(each) for name, each in further.items()} or None,
        replicates=Replicates(values, keys, further or None),
    )


def _values(done: Sequence[Outcome], response: str) -> tuple[float, ...]:
    return tuple(value for outcome in done if (value := outcome.of(response)) is not None)


@dataclass(frozen=True)
class Scatter:
    """The standard deviation of the mean over replicates, as a share of it, with its degrees of freedom."""

    share: float
    df: int


def pooled(outcomes: Sequence[Outcome], response: str = FIRST) -> Scatter | None:
    """Return the scatter of means over replicates, pooled over points; None where nothing was repeated."""
    drawn = [outcome.replicates.of(response) for outcome in outcomes if outcome.replicates is not None]
    groups = [np.array(values) for values in drawn if len(values) > 1]
    df = sum(len(values) - 1 for values in groups)
    if not df or any(values.mean() == 0.0 for values in groups):
        return None
    square = sum(float(np.sum((values / values.mean() - 1.0) ** 2)) for values in groups) / df
    times = sum(map(len, groups)) / len(groups)
    return Scatter(float(np.sqrt(square / times)), df)
