"""What the spec says about runs that fail: which are tried again, which count, when a stage must not go on."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from stemcal.notes import Note, Weight
from stemcal.solvers.measures import measures
from stemcal.solvers.protocol import RESPONSES, Answer
from stemcal.study.model import RunsOptions

ACCIDENTS = frozenset({"worker_died", "exception"})
TIMEOUT = "timeout"
CENSORED = "censored"
NOT_RUN = "not_run"  # said by whoever does the runs by hand
WITHDRAWN = "withdrawn"  # a result entered by hand that was none


class LowerBound(Note, weight=Weight.NUMBERS):
    """In these rows (from 1) the response is a lower bound: how the stroke ended, as far as the solver tells."""

    rows: tuple[int, ...]
    stroke_end: str


def stands(record: Mapping[str, Any], policy: RunsOptions) -> bool:
    """Whether a record answers for good, or its run is to be computed again.

    Accidents are tried again by the next command, and so is what timed out if it may take longer now.
    """
    if record["reason"] in ACCIDENTS or record["reason"] == WITHDRAWN:
        return False
    allowed = record["details"].get("time_limit") if record["reason"] == TIMEOUT else None
    return allowed is None or (policy.time_limit is not None and policy.time_limit <= allowed)


def judged(answer: Answer, policy: RunsOptions) -> Answer:
    """Return the answer as the spec wants it counted; of long lists only what they come to leaves the record."""
    kept = (RESPONSES,)
    details = {n: value for n, value in answer.details.items() if n in kept or not isinstance(value, list | dict)}
    details |= measures(answer.details)
    if is_censored(answer) and policy.censored == "fail":
        message = f"{ending(answer)}: it is at least {answer.response:g} N"
        return Answer("failed", None, CENSORED, message, details)
    return replace(answer, details=details)


_ENDINGS = {
    "rising": "the force still rose when the stroke ended",
    "regained": "a peak was passed and partly regained when the stroke ended",
    "falling": "a peak was passed, but the force had fallen little when the stroke ended",
}


def ending(answer: Answer) -> str:
    """Say how the force of a censored run ended, as far as the solver tells."""
    return _ENDINGS.get(str(answer.details.get("stroke_end")), "the force had not fallen when the stroke ended")


def is_censored(answer: Answer) -> bool:
    """Whether the force is only a lower bound: the stroke ended before the maximum was clearly passed."""
    return answer.reason == CENSORED or (answer.ok and answer.details.get("stroke_was_enough") is False)


def lower_bounds(answers: Sequence[Answer]) -> list[Note]:
    """Return a note on the rows whose response is only a lower bound, one for each way in which their stroke ended."""
    rows: dict[str, list[int]] = {}
    for row, answer in enumerate(answers, 1):
        if is_censored(answer):
            rows.setdefault(str(answer.details.get("stroke_end", "unknown")), []).append(row)
    return [LowerBound(tuple(numbers), end) for end, numbers in rows.items()]
