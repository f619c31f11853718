"""From requests to answers: look in the records, compute what is missing, keep each answer as it comes.

An answer counts once its record is in the study folder. A run that failed for physical reasons stays
failed; one that failed by accident (its process died, the solver raised) is repeated up to the number in the
spec, and once more by the next command.
"""

import logging
import math
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass

from stemcal.errors import RunsFailed, Waiting
from stemcal.executors import InlineExecutor, RunExecutor
from stemcal.folder import StudyFolder
from stemcal.runs.record import TRIES, counted, identity_of, judged, record_key, stands
from stemcal.runs.retries import Batch, Computed
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.study.model import RunsOptions

logger = logging.getLogger(__name__)

MOST_WARNINGS = 10
_MOST_REASONS = 10
WORK = "work"  # where solvers that need files have their run folders


@dataclass(frozen=True)
class Progress:
    """The progress of a stage, in runs: `points` of its design with equal levels and condition are one run.

    It is `preparing` while something is made that no row can begin without.
    """

    stage: str
    done: int
    total: int
    cached: int
    failed: int
    last_response: float | None
    last_condition: float | None = None
    preparing: bool = False
    points: int = 0


Watch = Callable[[Progress], None]


def ignore(_progress: Progress) -> None:
    """Watch and say nothing."""


def answer_all(
    requests: Sequence[Request],
    solver: Solver,
    folder: StudyFolder,
    executor: RunExecutor,
    watch: Watch = ignore,
    policy: RunsOptions | None = None,
    again: Collection[str] = (),
) -> list[Answer]:
    """Answer every request; the folder must be locked.

    Requests with equal identities are computed once, those with a record not at all, unless their key is in
    `again`. Interrupted, it leaves the records of all that was done.

    Raises
    ------
    RunsFailed
        If the policy asks for more successes.
    Waiting
        If the runs are done by hand, and results are not entered yet; those that are known are recorded first.
    """
    policy = policy or RunsOptions()
    keys = [record_key(solver, request) for request in requests]
    known: dict[str, Answer] = {}  # what earlier commands have left for good
    for key in dict.fromkeys(key for key in keys if key not in again):
        record = folder.load(key)
        if record is not None and stands(record, policy):
            known[key] = counted(record)
    missing: dict[str, Request] = {}
    for key, request in zip(keys, requests, strict=True):
        if key not in known:
            missing.setdefault(key, request)
    stage = requests[0].stage if requests else ""
    if solver.immediate:
        executor = InlineExecutor()
    folder.log("stage_begins", stage=stage, rows=len(keys), recorded=len(known), to_run=len(missing))
    tally = _Tally(stage, keys, known, watch)
    awaited = [key for key, run in missing.items() if solver.asks_people and not solver.knows(run)]
    waiting = [missing.pop(key) for key in awaited]
    if missing:
        if takes_a_while := solver.preparing():
            tally.report(preparing=True)
        solver.prepare()
        if takes_a_while:
            tally.report()
    with closing(_recording(missing, solver, folder, executor)) as answers:
        for key, answer in answers:
            known[key] = judged(answer)
            tally.add(known[key], missing[key])
    if waiting:
        raise Waiting(stage, waiting)
    found = [known[key] for key in keys]
    _require_quorum(requests, found, policy)
    return found


class _Tally:
    """Counts the finished runs and notifies the watcher."""

    def __init__(self, stage: str, keys: Sequence[str], known: Mapping[str, Answer], watch: Watch) -> None:
        self.stage, self.points, self.watch = stage, len(keys), watch
        self.total, self.warned = len(set(keys)), set[tuple[int, str]]()
        self.done = self.cached = len(known)
        self.failed = sum(not answer.ok for answer in known.values())
        self.report()

    def add(self, answer: Answer, request: Request) -> None:
        """Count one more answer."""
        self.done += 1
        if not answer.ok:
            self.failed += 1
            self._warn(answer, request)
        self.report(answer.response, request.condition)

    def _warn(self, answer: Answer, request: Request) -> None:
        """Warn of the first failures one by one, and once of those that several replicates share."""
        if (fault := (request.row, answer.message)) in self.warned:
            return
        self.warned.add(fault)
        if len(self.warned) <= MOST_WARNINGS:
            logger.warning("%s run %d: %s: %s", request.stage, request.row + 1, answer.reason, answer.message)
        elif len(self.warned) == MOST_WARNINGS + 1:
            logger.warning("more runs failed; `stemcal status SPEC --failed` lists all failed runs")

    def report(self, response: float | None = None, condition: float | None = None, preparing: bool = False) -> None:
        """Notify the watcher of the progress."""
        counts = (self.done, self.total, self.cached, self.failed)
        condition = None if response is None else condition
        self.watch(Progress(self.stage, *counts, response, condition, preparing, self.points))


def _recording(
    missing: Mapping[str, Request], solver: Solver, folder: StudyFolder, executor: RunExecutor
) -> Generator[tuple[str, Answer], None, None]:
    """Compute the missing answers; each is recorded before it is yielded."""
    if not missing:
        return
    solver = solver.placed(folder.path.absolute() / WORK)
    batch = Batch(missing, solver, executor, TRIES)
    try:
        for key, computed in batch.arriving():
            yield key, keep(key, missing[key], computed, solver, folder)
    finally:
        for key, computed in batch.rest():
            keep(key, missing[key], computed, solver, folder)


def keep(key: str, request: Request, computed: Computed, solver: Solver, folder: StudyFolder) -> Answer:
    """Save one outcome durably and return its answer."""
    answer = computed.answer.readable()
    folder.save(
        {
            "key": key,
            "identity": identity_of(solver, request),
            "request": request.as_record(),
            **asdict(answer),
            "provenance": computed.circumstances,
        }
    )
    if not answer.ok:
        folder.log("run_failed", key=key, stage=request.stage, row=request.row, reason=answer.reason)
    return answer


# ---- when a stage must not go on, and why


def _require_quorum(requests: Sequence[Request], answers: Sequence[Answer], policy: RunsOptions) -> None:
    """Raise `RunsFailed` if too small a share of a stage's rows succeeded."""
    needed = math.ceil(policy.quorum * len(answers) - 1e-9)
    failed = sum(not answer.ok for answer in answers)
    if len(answers) - failed >= needed:
        return
    counts = f"{failed} of {len(answers)} runs failed, but {needed} must succeed"
    head = f"{requests[0].stage}: {counts}; correct the cause, then run `stemcal run SPEC --retry`"
    raise RunsFailed("\n".join([head, *_reason_lines(requests, answers)]))


def _reason_lines(requests: Iterable[Request], answers: Iterable[Answer]) -> list[str]:
    """Return a line per failed run with its reason, the first ten in full."""
    lines = [
        f"  run {request.row + 1}: {answer.reason}: {answer.message}".rstrip(": ")
        for request, answer in zip(requests, answers, strict=True)
        if not answer.ok
    ]
    more = len(lines) - _MOST_REASONS
    return [*lines[:_MOST_REASONS], f"  and {more} more"] if more > 0 else lines


@contextmanager
def reasons_given(requests: Sequence[Request], answers: Sequence[Answer]) -> Iterator[None]:
    """Add to a `RunsFailed` which runs failed and why."""
    try:
        yield
    except RunsFailed as error:
        raise RunsFailed("\n".join([str(error), *_reason_lines(requests, answers)])) from None
