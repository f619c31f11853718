"""What a stage tells of one run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from stemcal.files.typed import absent
from stemcal.runs.key import record_key
from stemcal.runs.policy import is_censored
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver

# Name in a result, and what solvers call it among the details of an answer.
_TOLD = {"travel": "travel", "work": "work", "phases": "phases", "sd": "peak_sd", "phase_forces": "phase_forces",
         "responses": RESPONSES}  # fmt: skip


@dataclass(frozen=True)
class Replicates:
    """The responses of a point's replicates that succeeded, the first and the `further`, and the keys of all."""

    values: tuple[float, ...]
    keys: tuple[str, ...]
    further: dict[str, tuple[float, ...]] | None = absent()

    def of(self, response: str) -> tuple[float, ...]:
        """Return the values of a response, the first one's for ``force``."""
        return self.values if response == "force" else (self.further or {}).get(response, ())


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The force (N) of a run, or why there is none; `key` names its record.

    Where the study names its own responses `force` is the first of them, and `responses` has the others.

    `travel` (mm) and `work` (mJ) reach to the maximum force; `sd` is the scatter of the force over that many mesh
    `phases`. None where the solver does not tell. Of a point simulated several times over the force is the mean of its
    `replicates`.
    """

    force: float | None
    travel: float | None = absent()
    work: float | None = absent()
    phases: int | None = absent()
    sd: float | None = absent()
    phase_forces: tuple[float, ...] | None = absent()
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
        """Whether the force may enter an analysis."""
        return self.status == "ok"

    def response(self, name: str) -> float | None:
        """Return ``force``, ``travel`` or ``work``, or a further response of the study's own."""
        if self.responses is not None and name in self.responses:
            return self.responses[name]
        return {"force": self.force, "travel": self.travel, "work": self.work}.get(name)

    def number(self, name: str) -> float:
        """Return a response for statistics: NaN where there is none, so that a failed run cannot pass for a number.

        >>> Outcome(force=0.0).number("force"), Outcome(force=None, status="failed").number("force")
        (0.0, nan)
        """
        value = self.response(name)
        return value if self.ok and value is not None else math.nan


def outcome_of(request: Request, answer: Answer, solver: Solver) -> Outcome:
    """Return what is told of an answered request."""
    told: dict[str, Any] = {name: answer.details.get(detail) for name, detail in _TOLD.items()} if answer.ok else {}
    return Outcome(
        force=answer.force,
        **told,
        status=answer.status,
        censored=is_censored(answer),
        reason=answer.reason,
        message=answer.message,
        key=record_key(solver, request),
    )
