"""The verdict of a study and its reasons, as facts; `stemcal.text.verdict` makes their sentences."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Literal

from stemcal.files.typed import Tagged, absent

Word = Literal["calibrated", "with_reservations", "not_calibrated"]
Severity = Literal["with_reservations", "not_calibrated"]


class Remedy(Tagged):
    """What would mend a reason: a kind for each, with its numbers, declared in `advice`."""


class Reason(Tagged):
    """Why a study is not simply calibrated: a kind for each, declared beside its rule; weight and remedy."""

    _: KW_ONLY
    weight: Severity
    remedy: Remedy


@dataclass(frozen=True)
class Judged:
    """A response at a condition: how far simulated is from measured, None where the run failed; fitted, or a check."""

    response: str
    condition: float
    error_percent: float | None
    fitted: bool

    @property
    def size(self) -> float:
        """The error without its sign."""
        return abs(self.error_percent or 0.0)


@dataclass(frozen=True)
class Use:
    """Where the result may be used: conditions at which all is within the percentage; what is off most elsewhere."""

    within_percent: float
    good: tuple[float, ...]
    worst: Judged | None


@dataclass(frozen=True)
class UseThere:
    """Where the parameters for another program may be used in it, and which kind of solver that is."""

    solver: str
    use: Use


@dataclass(frozen=True)
class Verdict:
    """What a study comes to: a word, where the result may be used (None where nothing tells), and the reasons.

    `there` tells where the result of a transfer may be used.
    """

    verdict: Word
    use: Use | None
    reasons: tuple[Reason, ...]
    there: UseThere | None = absent()

    @classmethod
    def of(cls, reasons: list[Reason], use: Use | None, there: UseThere | None = None) -> Verdict:
        """Weigh the reasons: the heaviest decides, and comes first."""
        heavy = [reason for reason in reasons if reason.weight == "not_calibrated"]
        light = [reason for reason in reasons if reason.weight != "not_calibrated"]
        word: Word = "not_calibrated" if heavy else "with_reservations" if light else "calibrated"
        return cls(word, use, (*heavy, *light), there)

    @property
    def holds(self) -> bool:
        """Whether intervals and claims of agreement may be shown."""
        return self.verdict != "not_calibrated"

    @property
    def may_hold(self) -> bool:
        """Whether nothing but what is not done yet speaks against intervals and claims of agreement."""
        return self.holds or all(
            reason.kind == "unfinished" for reason in self.reasons if reason.weight == "not_calibrated"
        )

    def says(self, kind: str) -> bool:
        """Whether a reason of that kind is among them."""
        return any(reason.kind == kind for reason in self.reasons)
