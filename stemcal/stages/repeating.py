"""Does a program give equal answers to equal inputs? Its first run is repeated at the start to see it."""

from collections.abc import Sequence
from dataclasses import replace

from stemcal.errors import UsageError
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.base import stage_called
from stemcal.study.model import RunsOptions, Study

__all__ = ["POLICY", "repeats_itself", "require_same", "second_time"]

POLICY = RunsOptions(quorum=0.0)
"""Of the two runs: what fails tells nothing here, and is judged among the runs of its stage."""
_SAME = 1e-6  # of the answer: what summing in another order may change
# No chance in these: our own, a table, and runs by hand, where who does them says so by `replicates`.
_ITSELF = ("embedded", "table", "manual")


def repeats_itself(study: Study) -> bool:
    """Tell whether equal inputs give equal answers: of our own solver, and of programs whose first run was repeated."""
    return study.solver.kind not in ("table", "manual") and not study.replicates


def second_time(study: Study, requests: Sequence[Request]) -> list[Request]:
    """Return the first run of the study and the same once more, unless chance is expected or impossible."""
    known = study.solver.kind in _ITSELF or study.replicates
    if known or not requests or stage_called(requests[0].stage).needs(study) is not None:
        return []
    if requests[0].condition != study.targets.calibrate_at:
        return []
    return [requests[0], replace(requests[0], replicate=1)]


def require_same(kind: str, requests: Sequence[Request], answers: Sequence[Answer]) -> None:
    """Raise `UsageError` if two answers to the same levels differ; runs that failed tell nothing."""
    first, second = (answer.response for answer in answers)
    if first is None or second is None or abs(first - second) <= _SAME * max(abs(first), abs(second)):
        return
    remedy = _REMEDIES.get(kind, _REMEDIES["command"])
    raise UsageError(
        f"solver: the program gave {first:.9g} and {second:.9g} to the levels of {requests[0].stage} run "
        f"{requests[0].row + 1}: there is chance in it. {remedy}"
    )


_REMEDIES = {
    "command": "Write deterministic: false, so that every run is simulated anew and its scatter counts, and {{seed}} "
    "where the program takes one",
    "lsdyna": "Let it sum in the same order always: a negative number of processors (ncpu=-4) in its command",
    "openradioss": "Let it sum in the same order always: /PARITH/ON in the starter's deck",
}
