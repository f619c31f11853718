"""From the record of a run to its outcome in a stage: whether the record is valid, how it counts, its result.

Accidents are tried again; a stroke that ended too early gives a lower bound.
"""

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

from stemcal.files.typed import absent
from stemcal.folder import key_of
from stemcal.naming import FIRST
from stemcal.note import Note, Remedy
from stemcal.registry import package_hash
from stemcal.solvers.measures import measures
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.replicates import Replicates
from stemcal.study.model import RunsOptions
from stemcal.words import series

ACCIDENTS = frozenset({"worker_died", "exception"})
TIMEOUT = "timeout"
TRIES = 2  # how often a run is begun that ends by accident

# ---- records, and how they count


def record_key(solver: Solver, request: Request) -> str:
    """Return the name of the record that answers a request: a hash of what determines the answer."""
    return key_of(identity_of(solver, request))


def identity_of(solver: Solver, request: Request) -> dict[str, Any]:
    """Return what determines the answer: the solver's identity, and its code if another package has it."""
    code = code_of(type(solver).__module__)
    return {**solver.identity(request), **({"code of package": code} if code else {})}


@functools.cache
def code_of(module: str) -> str:
    """Return a hash of the package of a module; nothing for stemcal's own."""
    return "" if module.partition(".")[0] == "stemcal" else package_hash(module)


def answer_of(record: Mapping[str, Any]) -> Answer:
    """Return the answer that a record holds."""
    return _kept(record).readable()


def counted(record: Mapping[str, Any]) -> Answer:
    """Return the answer that a record holds as stages count it."""
    return judged(_kept(record)).readable()


def _kept(record: Mapping[str, Any]) -> Answer:
    return Answer(**{name: record[name] for name in ("status", FIRST, "reason", "message", "details")})


def stands(record: Mapping[str, Any], policy: RunsOptions) -> bool:
    """Whether a record is final, or its run must be computed again.

    Accidents are tried again by the next command, and so is what timed out if it may take longer now.
    """
    if record["reason"] in ACCIDENTS:
        return False
    allowed = record["details"].get("time_limit") if record["reason"] == TIMEOUT else None
    return allowed is None or (policy.time_limit is not None and policy.time_limit <= allowed)


def judged(answer: Answer) -> Answer:
    """Return the answer as stages count it; long lists stay in the record, only their results leave it."""
    kept = (RESPONSES,)
    details = {n: value for n, value in answer.details.items() if n in kept or not isinstance(value, list | dict)}
    details |= measures(answer.details)
    return replace(answer, details=details)


def is_censored(answer: Answer) -> bool:
    """Whether the force is only a lower bound: the stroke ended before the maximum was clearly passed."""
    return answer.ok and answer.details.get("stroke_was_enough") is False


_STROKE_ENDS = {
    "rising": "the response was still rising",
    "regained": "the response had risen again after a peak",
    "falling": "the response had fallen only slightly after a peak",
}


def lower_bound_notes(answers: Sequence[Answer]) -> list[Note]:
    """Return a note on the rows whose response is only a lower bound, one for each way in which their stroke ended."""
    rows: dict[str, list[int]] = {}
    for row, answer in enumerate(answers, 1):
        if is_censored(answer):
            ended = _STROKE_ENDS.get(str(answer.details.get("stroke_end")), "the response had not fallen")
            rows.setdefault(ended, []).append(row)
    return [_lower_bound(numbers, ended) for ended, numbers in rows.items()]


def _lower_bound(rows: Sequence[int], ended: str) -> Note:
    one = len(rows) == 1
    runs, bound = ("run", "its maximum is a lower bound") if one else ("runs", "their maxima are lower bounds")
    remedy = Remedy("Increase the stroke (`loading.stroke` or `loading.duration`).")
    text = f"In {runs} {series(rows)}, {ended} when the stroke ended, so {bound}."
    return Note("lower_bound", "warning", text, remedy)


# ---- what a stage stores of a run


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The first response of a run, or why there is none; `key` names its record.

    `responses` has the others that a study declares itself, by name.

    `travel` (mm) and `work` (mJ) reach to the maximum force, None if the solver does not report it. Of a point
    simulated several times over the response is the mean of its `replicates`.
    """

    response: float | None
    travel: float | None = absent()
    work: float | None = absent()
    responses: dict[str, float] | None = absent()
    status: str = "ok"
    censored: bool = False
    reason: str = ""
    message: str = ""
    key: str = ""
    replicates: Replicates | None = absent()

    @property
    def keys(self) -> tuple[str, ...]:
        """The names of its records."""
        return (self.key,) if self.replicates is None else self.replicates.keys

    @property
    def ok(self) -> bool:
        """Whether the response may enter an analysis."""
        return self.status == "ok"

    def of(self, name: str) -> float | None:
        """Return a response by its name, or the first one for `FIRST`; None where there is none."""
        if name == FIRST:
            return self.response
        if self.responses is not None and name in self.responses:
            return self.responses[name]
        return {"travel": self.travel, "work": self.work}.get(name)

    def number(self, name: str) -> float:
        """Return a response for statistics: NaN where there is none, so that a failed run cannot pass for a number.

        >>> Outcome(response=0.0).number(FIRST), Outcome(response=None, status="failed").number(FIRST)
        (0.0, nan)
        """
        value = self.of(name)
        return value if self.ok and value is not None else math.nan


def outcome_of(request: Request, answer: Answer, solver: Solver) -> Outcome:
    """Return the stored row of an answered request."""
    told = answer.details if answer.ok else {}
    return Outcome(
        response=answer.response,
        travel=told.get("travel"),
        work=told.get("work"),
        responses=told.get(RESPONSES),
        status=answer.status,
        censored=is_censored(answer),
        reason=answer.reason,
        message=answer.message,
        key=record_key(solver, request),
    )


# ---- one outcome of the replicates of a point


def merged(outcomes: Sequence[Outcome], times: int) -> list[Outcome]:
    """Return one outcome for the replicates of each point: the mean of those that succeeded."""
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
