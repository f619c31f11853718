"""The key of a run record, and the answer that a record holds."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from stemcal.files.showing import in_a_line, visible
from stemcal.folder.record import key_of
from stemcal.naming import FIRST
from stemcal.solvers.protocol import Answer, Request, Solver


def record_key(solver: Solver, request: Request) -> str:
    """Return the name of the record that answers a request: a hash of what determines the answer."""
    return key_of(solver.identity(request))


def answer_of(record: Mapping[str, Any]) -> Answer:
    """Return the answer that a record holds."""
    return readable(Answer(**{name: record[name] for name in ("status", FIRST, "reason", "message", "details")}))


def readable(answer: Answer) -> Answer:
    """Return an answer whose words have no control characters: they may be a program's."""
    return replace(answer, reason=in_a_line(answer.reason), message=visible(answer.message))
