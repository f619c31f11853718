"""The verdict of a study: calibrated, with reservations or not, the reasons, and where simulations agree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from stemcal.notes import SEVERITIES, Note
from stemcal.stages.result import Judged, Prediction
from stemcal.storage.typed import absent

Word = Literal["calibrated", "with_reservations", "not_calibrated"]


@dataclass(frozen=True)
class Use:
    """Conditions with small errors (`good`), largest error elsewhere (`worst`) and of unfitted values (`held_out`)."""

    within_percent: float
    good: tuple[float, ...]
    worst: Judged | None
    largest_percent: float = 0.0
    held_out: Judged | None = None
    fitted: tuple[float, ...] = ()
    predictions: tuple[Prediction, ...] = ()


@dataclass(frozen=True)
class Verdict:
    """The verdict with its reasons by importance, and the `use` of the result (None without a comparison)."""

    verdict: Word
    use: Use | None
    reasons: tuple[Note, ...]
    goal: bool = absent(False)
    gains: tuple[str, ...] = absent(())

    @classmethod
    def of(cls, reasons: list[Note], use: Use | None, goal: bool = False, gains: tuple[str, ...] = ()) -> Verdict:
        """Return the verdict: not calibrated for a reason of severity error, with reservations for any other reason."""
        worst = min((reason.severity for reason in reasons), key=SEVERITIES.index, default=None)
        word: Word = "calibrated" if worst is None else "not_calibrated" if worst == "error" else "with_reservations"
        return cls(word, use, tuple(reasons), goal, gains)

    @property
    def holds(self) -> bool:
        """Whether intervals and agreement may be shown: not for a study that is not calibrated."""
        return self.goal or self.verdict != "not_calibrated"

    @property
    def may_hold(self) -> bool:
        """Whether intervals and agreement may be shown; unfinished stages are ignored."""
        return self.holds or all(reason.kind == "unfinished" for reason in self.reasons if reason.severity == "error")

    def has(self, kind: str) -> bool:
        return any(reason.kind == kind for reason in self.reasons)
