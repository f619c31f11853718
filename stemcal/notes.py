"""One class for everything that a result, a run or a verdict has to say: its kind, how serious it is, its text.

A note is made where the fact is found, by a plain function with an f-string. Programs and tests look at `kind`; people
read `text`.
"""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning", "caution", "info"]
SEVERITIES: tuple[Severity, ...] = ("error", "warning", "caution", "info")


@dataclass(frozen=True)
class Remedy:
    """What to do about a note: the instruction, for people, and perhaps an edit of the spec.

    The edit is a YAML fragment that makes the change when it is merged into the spec; list items are matched by
    ``name``.
    """

    text: str
    edit: str | None = None


@dataclass(frozen=True)
class Note:
    """A fact that concerns the reader of a result.

    kind       the same for every note of this kind, such as ``flat_response``
    severity   ``error``: the result cannot be used; ``warning``: numbers are missing, are only bounds, or may be wrong;
               ``caution``: the statistics are weaker than they look; ``info``: for completeness
    text       one to three sentences, numbers with units
    """

    kind: str
    severity: Severity
    text: str
    remedy: Remedy | None = None

    def __str__(self) -> str:
        """Return the text with its remedy."""
        return f"{self.text} {self.remedy.text}" if self.remedy else self.text
