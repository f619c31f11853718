"""A run, the key of its record, the outcome read from a record, and the mean outcome of replicates."""

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

import numpy as np

from stemcal.formats import series
from stemcal.notes import Note, Remedy
from stemcal.registry import code_of
from stemcal.responses import CUT, ForceTravel, responses_in
from stemcal.runs.study_folder import now, provenance
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.replicates import Replicates
from stemcal.storage.canonical import key_of
from stemcal.storage.typed import absent
from stemcal.study.types.field_types import MOST
from stemcal.vocabulary import CUTTING, FIRST, Vocabulary

ACCIDENTS = frozenset({"worker_died", "exception"})
TIMEOUT = "timeout"

Computed = tuple[Answer, dict[str, Any]]
"""An answer, and its circumstances: versions of the programs, machine, times."""


@dataclass(frozen=True)
class Run:
    """A callable request to a solver; the `key` of its record is a hash of all data that determine the answer."""

    solver: Solver
    request: Request
    identity: dict[str, Any]
    key: str

    @classmethod
    def of(cls, solver: Solver, request: Request) -> "Run":
        """Return the run of a request; the identity of a solver of another package includes its code."""
        code = code_of(type(solver).__module__)
        identity = {**solver.identity(request), **({"code of package": code} if code else {})}
        return cls(solver, request, identity, key_of(identity))

    def get_ready(self) -> None:
        """Prepare the solver in this process; the time limit of the run starts afterwards."""
        self.solver.get_ready()

    def __call__(self) -> Computed:
        started, clock = now(), time.perf_counter()
        answer = validated(self.solver.solve(self.request), self.solver.naming)
        wall = time.perf_counter() - clock
        return answer, {**provenance(), "started": started, "finished": now(), "wall_seconds": wall}


def by_key(solver: Solver, requests: Iterable[Request]) -> dict[str, Request]:
    """Return the requests by the keys of their runs; of several requests with the same key, the first."""
    distinct: dict[str, Request] = {}
    for request in requests:
        distinct.setdefault(Run.of(solver, request).key, request)
    return distinct


def validated(answer: Answer, naming: Vocabulary = CUTTING) -> Answer:
    """Return the answer, or a failed answer if a response is not a finite number of plausible size."""
    if answer.status != "ok":
        return Answer("failed", None, answer.reason or "failed", answer.message, answer.details)
    rest, nouns = dict(answer.details), {response.name: response.noun for response in naming.responses}
    for name, value in {naming.response.name: answer.response, **rest.pop(RESPONSES, {})}.items():
        returned = f"the solver returned {value} for the {nouns.get(name, name)}"
        if value is None or not math.isfinite(value):
            return Answer("failed", None, "nan", returned, rest)
        if abs(value) > MOST:
            return Answer("failed", None, "bad_result", f"{returned}; the magnitude exceeds {MOST:g}", rest)
    return answer


def is_final(record: Mapping[str, Any], time_limit: float | None) -> bool:
    """Check that a record is final: neither an accident, nor a timeout under a shorter limit than the present one."""
    if record["reason"] in ACCIDENTS:
        return False
    allowed = record["details"].get("time_limit") if record["reason"] == TIMEOUT else None
    return allowed is None or (time_limit is not None and time_limit <= allowed)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The outcome of a run, or of the replicates of a point.

    response       first response of the study, for replicates the mean; None if the run failed
    travel, work   blade travel (mm) and work (mJ) up to the maximum force; None if the solver does not report a curve
    responses      other responses declared in the study, by name
    censored       whether the response is only a lower bound, because the stroke was too short
    reason         reason and `message` of a failed run
    key            name of the record
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
        """Keys of the record, or of the records of all replicates."""
        return (self.key,) if self.replicates is None else self.replicates.keys

    @property
    def ok(self) -> bool:
        """Whether the run succeeded, so that its response may be used in an analysis."""
        return self.status == "ok"

    def of(self, name: str) -> float | None:
        """Return a response by its name (`FIRST` for the first response); None if it is missing."""
        if name == FIRST:
            return self.response
        if self.responses is not None and name in self.responses:
            return self.responses[name]
        return {"travel": self.travel, "work": self.work}.get(name)

    def number(self, name: str) -> float:
        """Return a response for statistics; NaN if it is missing or the run failed."""
        value = self.of(name)
        return value if self.ok and value is not None else math.nan


def outcome_of(record: Mapping[str, Any], naming: Vocabulary = CUTTING) -> Outcome:
    """Return the outcome in a record, with the further responses of the study, which are listed in `naming`."""
    details = record["details"] if record["status"] == "ok" else {}
    of_curve = curve_responses(details, record["request"]["condition"], naming)
    return Outcome(
        response=record[FIRST],
        travel=of_curve.pop("travel", None),
        work=of_curve.pop("work", None),
        responses={**of_curve, **details.get(RESPONSES, {})} or None,
        status=record["status"],
        censored=details.get("stroke_was_enough") is False,
        reason=record["reason"],
        message=record["message"],
        key=record["key"],
    )


def curve_responses(details: Mapping[str, Any], diameter: float, naming: Vocabulary = CUTTING) -> dict[str, float]:
    """Return the responses besides the force, by name, that the curve and the values in `details` determine."""
    curve = details.get("curve") or {"travel": (), "force": ()}
    travel, force = (np.asarray(curve[name], dtype=float) for name in ("travel", "force"))
    peak = (details.get("peak_force", math.nan), details.get("peak_travel", math.nan))
    cut = ForceTravel(travel, force, *peak, diameter, CUT, details)
    wanted = {named.name for named in (*CUTTING.further, *naming.further) if named.in_table}
    responses = (response for response in responses_in(CUT, measured=wanted) if response.name in wanted)
    return {response.name: value for response in responses if (value := response.value(cut)) is not None}


def lower_bound_notes(outcomes: Sequence[Outcome]) -> list[Note]:
    """Return a note on the runs whose response is only a lower bound, if there are any."""
    rows = [row for row, outcome in enumerate(outcomes, 1) if outcome.censored]
    if not rows:
        return []
    remedy = Remedy(
        "Increase the stroke (`loading.stroke` or `loading.duration`, or in the input of your program). If the program "
        "may stop early, write the text of its normal end as `ends_with` under `result`."
    )
    noun = "run" if len(rows) == 1 else "runs"
    text = (
        f"In {noun} {series(rows)}, the response had not fallen when the stroke ended, so the "
        "recorded maximum is a lower bound."
    )
    return [Note("lower_bound", "warning", text, remedy)]


def merged(outcomes: Sequence[Outcome], times: int) -> list[Outcome]:
    """Replace every `times` replicates by the mean of those that succeeded; with `times` = 0, change nothing."""
    if not times:
        return list(outcomes)
    return [_mean(outcomes[i : i + times]) for i in range(0, len(outcomes), times)]


def _mean(replicates: Sequence[Outcome]) -> Outcome:
    done = [outcome for outcome in replicates if outcome.ok and outcome.response is not None]
    first, keys = done[0] if done else replicates[0], tuple(outcome.key for outcome in replicates)
    if not done:
        return replace(first, replicates=Replicates((), keys))
    further = {name: _values(done, name) for name in first.responses or {}}
    values, travels, works = (_values(done, name) for name in (FIRST, "travel", "work"))
    return replace(
        first,
        response=fmean(values),
        travel=fmean(travels) if travels else None,
        work=fmean(works) if works else None,
        responses={name: fmean(numbers) for name, numbers in further.items()} or None,
        replicates=Replicates(values, keys, further or None),
    )


def _values(done: Sequence[Outcome], response: str) -> tuple[float, ...]:
    return tuple(value for outcome in done if (value := outcome.of(response)) is not None)
