"""The verdict of a study and its reasons."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from stemcal.words import counted

Word = Literal["calibrated", "with_reservations", "not_calibrated"]
Weight = Literal["with_reservations", "not_calibrated"]
_HEAVY: Weight = "not_calibrated"


@dataclass(frozen=True)
class Reason:
    """Why a study is not simply calibrated: the rule that says so, how much it weighs, and what would mend it."""

    rule: str
    weight: Weight
    sentence: str
    remedy: str = ""


@dataclass(frozen=True)
class Verdict:
    """What a study comes to: a word, where the result may be used (empty where nothing tells), and the reasons."""

    verdict: Word
    use: str
    reasons: tuple[Reason, ...]

    @classmethod
    def of(cls, reasons: list[Reason], use: str) -> Verdict:
        """Weigh the reasons: the heaviest decides, and comes first."""
        heavy = [reason for reason in reasons if reason.weight == _HEAVY]
        light = [reason for reason in reasons if reason.weight != _HEAVY]
        word: Word = "not_calibrated" if heavy else "with_reservations" if light else "calibrated"
        return cls(word, use, (*heavy, *light))

    @property
    def holds(self) -> bool:
        """Whether intervals and claims of agreement may be shown."""
        return self.verdict != "not_calibrated"

    @property
    def may_hold(self) -> bool:
        """Whether nothing but what is not done yet speaks against intervals and claims of agreement."""
        return self.holds or all(reason.rule == "unfinished" for reason in self.reasons if reason.weight == _HEAVY)

    @property
    def word(self) -> str:
        """The verdict as people read it."""
        words = {"with_reservations": "Calibrated, with reservations", "not_calibrated": "Not calibrated"}
        return words.get(self.verdict, "Calibrated")

    @property
    def next_step(self) -> str:
        """The remedy of the weightiest reason that has one, or nothing."""
        return next((reason.remedy for reason in self.reasons if reason.remedy), "")

    def lines(self) -> list[str]:
        """Return it in three lines at most: the word with its first reason, where it holds, the next step."""
        more = len(self.reasons) - 1
        rest = f" (and {counted(more, 'more reason')})" if more > 0 else ""
        told = [f"{self.word}: {self.reasons[0].sentence}{rest}." if self.reasons else f"{self.word}."]
        told += [self.use] if self.use else []
        return told + ([f"Next: {self.next_step}."] if self.next_step else [])
