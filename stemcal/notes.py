"""Notes: findings and warnings about a result, a run or a verdict.

The function that detects a fact creates its note. Programs and tests use the `kind` of a note, people read its `text`.
"""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning", "caution", "info"]
SEVERITIES: tuple[Severity, ...] = ("error", "warning", "caution", "info")


@dataclass(frozen=True)
class Remedy:
    """The remedy for a note: an instruction for people, and an edit of the spec if an edit alone is sufficient.

    The edit is a YAML fragment to be merged into the spec; list items with the same ``name`` are merged.
    """

    text: str
    edit: str | None = None


@dataclass(frozen=True)
class Note:
    """A fact that the reader of a result should know.

    Severity ``error``: the result cannot be used; ``warning``: numbers are missing, are only bounds, or may be wrong;
    ``caution``: the statistics are weaker than they look; ``info``: for completeness.
    """

    kind: str  # identifier of the fact for programs, such as ``flat_response``
    severity: Severity
    text: str  # one to three sentences, numbers with units
    remedy: Remedy | None = None

    def __str__(self) -> str:
        return f"{self.text} {self.remedy.text}" if self.remedy else self.text
