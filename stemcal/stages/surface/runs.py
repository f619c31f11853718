"""The runs of a surface as its fit takes them: scatter, what repeated ones show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stemcal.files.typed import Spread, inline
from stemcal.notes import Note
from stemcal.runs.outcome import Outcome
from stemcal.stages.result import DesignRun, DesignRuns


@dataclass(frozen=True, kw_only=True)
class ConditionRun(Spread):
    """One run of the surface's design at another diameter."""

    run: int
    outcome: Outcome = inline()


Answered = DesignRun | ConditionRun


class EqualRepeats(Note):
    """Repeated runs agree exactly: the solver is deterministic."""


class ScatterOfSeeds(Note):
    """Runs with seeds of their own scatter by this standard deviation."""

    sd: float
    df: int


class EqualSeeds(Note):
    """Runs with different seeds agree exactly."""


class UnequalRepeats(Note):
    """So many runs at the same levels of a deterministic solver gave different responses."""

    runs: int
    low: float
    high: float


def pure_error_of(design: DesignRuns, by_chance: bool = False) -> Note | None:
    """Return what repeated runs show; None if there are none.

    A solver that computes gives equal answers to equal inputs; repeated runs that differ were not equal, but for a
    program with chance in it.
    """
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in design.runs:
        if run.response is not None:
            groups.setdefault(tuple(run.coded.values()), []).append(run.response)
    repeated = [responses for responses in groups.values() if len(responses) > 1]
    if not repeated:
        return None
    widest = max(repeated, key=lambda responses: max(responses) - min(responses))
    same = max(widest) - min(widest) <= 1e-9 * max(map(abs, widest))
    if same:
        return EqualSeeds() if by_chance else EqualRepeats()
    return _scatter(repeated) if by_chance else UnequalRepeats(len(widest), min(widest), max(widest))


def _scatter(repeated: Sequence[Sequence[float]]) -> ScatterOfSeeds:
    df = sum(len(responses) - 1 for responses in repeated)
    square = sum(float(np.sum((np.array(responses) - np.mean(responses)) ** 2)) for responses in repeated) / df
    return ScatterOfSeeds(square**0.5, df)
