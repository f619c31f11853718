"""The key of a run record, and the answer that a record holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stemcal.files.durable import digest
from stemcal.solvers.protocol import Answer, Request, Solver

KEY_LENGTH = 32


def record_key(solver: Solver, request: Request) -> str:
    """Return the name of the record that answers a request: a hash of what determines the answer."""
    return digest(solver.identity(request))[:KEY_LENGTH]


def answer_of(record: Mapping[str, Any]) -> Answer:
    """Return the answer that a record holds."""
    return Answer(**{name: record[name] for name in ("status", "force", "reason", "message", "details")})
