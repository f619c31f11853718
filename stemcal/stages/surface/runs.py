"""The runs of a surface as its fit takes them: weights, blocks, scatter, what repeated ones tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from stemcal.doe.regression.within import Within, moderated_weights
from stemcal.files.typed import absent, inline
from stemcal.naming import FIRST, FORCE, Named
from stemcal.runs.outcome import Outcome
from stemcal.stages.result import DesignRun, DesignRuns
from stemcal.study.model import Study


@dataclass(frozen=True, kw_only=True)
class ConditionRun:
    """One run of the surface's design at another diameter."""

    run: int
    outcome: Outcome = inline()
    weight: float | None = absent()


Answered = DesignRun | ConditionRun
A = TypeVar("A", DesignRun, ConditionRun)


def weighed(study: Study, runs: Sequence[A]) -> list[A]:
    """Add to the runs the weight that their scatter over mesh phases gives them, if the spec asks for it."""
    if study.rsm.weights != "phases":
        return list(runs)
    told = [(run.outcome.sd, run.outcome.phases) for run in runs]
    weights = moderated_weights([np.nan if sd is None else sd for sd, _ in told], [m or 0 for _, m in told])
    return [replace(run, weight=float(weight)) for run, weight in zip(runs, weights, strict=True)]


def circumstances(
    blocks: Sequence[str | None] | None, answered: Sequence[Answered], response: str, further: int = 0
) -> tuple[list[float] | None, list[str] | None, Within | None]:
    """Return weights, blocks and scatter of runs as `fit_surface` takes them.

    Points added later count to the last block, with the mean weight; their scatter is not counted.
    """
    apart = None if blocks is None else [block or "" for block in blocks] + [blocks[-1] or ""] * further
    weights = within = None
    if response == FIRST and any(run.weight is not None for run in answered):
        weights = [1.0 if run.weight is None else run.weight for run in answered] + [1.0] * further
    if response == FIRST and any(run.outcome.sd is not None for run in answered):
        within = _within([run.outcome for run in answered], further)
    return weights, apart, within


def _within(outcomes: Sequence[Outcome], further: int) -> Within:
    most = max(outcome.phases or 0 for outcome in outcomes)
    empty = (np.nan,) * most
    responses = [empty if o.phase_responses is None else o.phase_responses for o in outcomes] + [empty] * further
    same = all(len(values) == most for values in responses)
    return Within(
        np.array([np.nan if o.sd is None else o.sd for o in outcomes] + [np.nan] * further),
        np.array([o.phases or 0 for o in outcomes] + [0] * further),
        np.array(responses, dtype=float) if same else None,
    )


def error_remark(design: DesignRuns, by_chance: bool = False, response: Named = FORCE) -> str | None:
    """Say what repeated runs, or mesh phases within the runs, tell; None if there are neither.

    A solver that computes gives equal answers to equal inputs; repeated runs that differ were not equal, but for a
    program with chance in it.
    """
    if phases := max((run.outcome.phases or 1 for run in design.runs), default=1) - 1:
        return f"Every force is the mean over {phases + 1} places of the mesh; their scatter is the pure error."
    groups: dict[tuple[float, ...], list[float]] = {}
    for run in design.runs:
        if run.response is not None:
            groups.setdefault(tuple(run.coded.values()), []).append(run.response)
    repeated = [responses for responses in groups.values() if len(responses) > 1]
    if not repeated:
        return None
    widest = max(repeated, key=lambda responses: max(responses) - min(responses))
    same = max(widest) - min(widest) <= 1e-9 * max(map(abs, widest))
    if by_chance:
        return _chance_remark(repeated, same, response)
    if same:
        return "Repeated runs agree exactly: the solver is deterministic, and there is no pure error."
    return _unequal_remark(widest, response)


def _chance_remark(repeated: Sequence[Sequence[float]], same: bool, response: Named) -> str:
    """Say how widely a program with chance in it scatters."""
    df = sum(len(responses) - 1 for responses in repeated)
    if same:
        return (
            "Runs with different seeds agree exactly: the program has no chance in it (write deterministic: true), or "
            "does not take {{seed}}."
        )
    square = sum(float(np.sum((np.array(responses) - np.mean(responses)) ** 2)) for responses in repeated) / df
    told = response.text(square**0.5, ".3g")
    return f"Every run has a seed of its own; runs at the same levels scatter with sd {told} ({df} df)."


def _unequal_remark(widest: Sequence[float], response: Named) -> str:
    return (
        f"{len(widest)} runs at the same levels gave {min(widest):g} to {response.text(max(widest))}. A deterministic "
        f"solver gives one {response.noun} for one set of levels, so these runs differed in something not recorded."
    )
