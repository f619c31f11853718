"""Programs with chance in them: each point simulated several times over, each time a run of its own."""

from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean

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
