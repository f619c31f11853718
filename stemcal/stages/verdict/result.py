"""The verdict of a study: one of three words, the reasons, and where the result may be used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from stemcal.notes import SEVERITIES, Note
from stemcal.stages.result import Judged, Prediction
from stemcal.storage.typed import absent

Word = Literal["calibrated", "with_reservations", "not_calibrated"]


@dataclass(frozen=True)
class Use:
    """Where the result may be used: the `good` conditions, with errors of at most `largest_percent`.

    `worst` is the largest error beyond the limit `within_percent`, `held_out` that of values which were not fitted.
    """

    within_percent: float
    good: tuple[float, ...]
    worst: Judged | None
    largest_percent: float = 0.0
    held_out: Judged | None = None
    fitted: tuple[float, ...] = ()
    predictions: tuple[Prediction, ...] = ()


@dataclass(frozen=True)
class Verdict:
    """The verdict, where the result may be used (None where no run shows it), and the reasons by importance."""

    verdict: Word
    use: Use | None
    reasons: tuple[Note, ...]
    goal: bool = absent(False)
    found: tuple[str, ...] = absent(())

    @classmethod
    def of(cls, reasons: list[Note], use: Use | None, goal: bool = False, found: tuple[str, ...] = ()) -> Verdict:
        """Return the verdict of the reasons: an error is not calibrated, else a reservation; a `goal` is confirmed."""
        worst = min((reason.severity for reason in reasons), key=SEVERITIES.index, default=None)
        word: Word = "calibrated" if worst is None else "not_calibrated" if worst == "error" else "with_reservations"
        return cls(word, use, tuple(reasons), goal, found)

    @property
    def holds(self) -> bool:
        """Whether intervals and statements of agreement may be shown."""
        return self.goal or self.verdict != "not_calibrated"

    @property
    def may_hold(self) -> bool:
        """Whether only unfinished stages speak against intervals and statements of agreement."""
        return self.holds or all(reason.kind == "unfinished" for reason in self.reasons if reason.severity == "error")

    def has(self, kind: str) -> bool:
        """Whether a reason of that kind is among them."""
        return any(reason.kind == kind for reason in self.reasons)
