"""Is a program deterministic that is said to be? Its first run is repeated at the start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from stemcal.errors import UsageError
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.base import stage_called
from stemcal.study.model import CommandSolver, Study

__all__ = ["require_same", "second_time"]

_SAME = 1e-9  # of the answer: what summing in another order may change


def second_time(study: Study, requests: Sequence[Request]) -> list[Request]:
    """Return the first run of the study and the same once more, where the spec calls the program deterministic."""
    said = isinstance(study.solver, CommandSolver) and study.solver.deterministic
    if not said or not requests or stage_called(requests[0].stage).needs(study) is not None:
        return []
    if requests[0].condition != study.targets.calibrate_at:
        return []
    return [requests[0], replace(requests[0], replicate=1)]


def require_same(requests: Sequence[Request], answers: Sequence[Answer]) -> None:
    """Raise `UsageError` if two answers to the same levels differ; runs that failed tell nothing."""
    first, second = (answer.response for answer in answers)
    if first is None or second is None or abs(first - second) <= _SAME * max(abs(first), abs(second)):
        return
    raise UsageError(
        f"solver.deterministic is true, but the program gave {first:.9g} and {second:.9g} to the levels of "
        f"{requests[0].stage} run {requests[0].row + 1}: there is chance in it. Write deterministic: false, so that "
        "every run is simulated anew and its scatter counts, and {{seed}} where the program takes one"
    )
