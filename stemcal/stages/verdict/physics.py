"""How many of a study's runs have doubtful physics, as their records tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any, Literal

from stemcal.cutting.result import NEGLIGIBLE_MASS
from stemcal.folder.store import StudyFolder
from stemcal.stages.results import Results

DoubtKind = Literal["hourglass", "inertia", "drift", "stroke"]
# Shares from which a solver doubts a run itself, percent: the same as `cutting.result` warns of.
LIMITS: dict[DoubtKind, float] = {"hourglass": 10.0, "inertia": 5.0, "drift": 2.0}
_DETAILS: dict[DoubtKind, str] = {
    "hourglass": "hourglass_ratio_percent",
    "inertia": "inertia_percent",
    "drift": "energy_drift_percent",
}


@dataclass(frozen=True)
class Doubt:
    """One kind of doubt, in how many runs, and the worst of it in percent (None of a stroke that was too short)."""

    kind: DoubtKind
    runs: int
    worst: float | None


@dataclass(frozen=True)
class Physics:
    """How many distinct runs told of their checks, how many are doubtful for any reason, and why."""

    checked: int
    doubtful: int
    doubts: tuple[Doubt, ...]

    @property
    def share(self) -> float:
        """Share of the checked runs that are doubtful."""
        return self.doubtful / self.checked if self.checked else 0.0


def physics_of(results: Results, folder: StudyFolder) -> Physics:
    """Read the checks of every run of the results; runs of solvers that tell none are not counted."""
    keys = dict.fromkeys(outcome.key for _, outcome in results.runs() if outcome.key and outcome.ok)
    contents = [content for key in keys if (content := folder.peek(key)) is not None]
    found = [doubts for content in contents if (doubts := _doubts(content["details"])) is not None]
    kinds = dict.fromkeys(kind for doubts in found for kind in doubts)
    return Physics(
        checked=len(found),
        doubtful=sum(bool(doubts) for doubts in found),
        doubts=tuple(
            sorted((_gathered(kind, found) for kind in kinds), key=lambda doubt: (-doubt.runs, doubt.kind)),
        ),
    )


def _doubts(details: Mapping[str, Any]) -> dict[DoubtKind, float | None] | None:
    """Return what is doubtful of a run with its size; None where the solver told nothing of it."""
    sizes = {kind: details[name] for kind, name in _DETAILS.items() if isinstance(details.get(name), int | float)}
    if not sizes and "stroke_was_enough" not in details:
        return None
    if details.get("added_mass_percent", inf) <= NEGLIGIBLE_MASS:
        sizes.pop("inertia", None)  # it is the stem's own
    found: dict[DoubtKind, float | None] = {kind: value for kind, value in sizes.items() if value > LIMITS[kind]}
    return found | ({"stroke": None} if details.get("stroke_was_enough") is False else {})


def _gathered(kind: DoubtKind, found: list[dict[DoubtKind, float | None]]) -> Doubt:
    sizes = [doubts[kind] for doubts in found if kind in doubts]
    return Doubt(kind, len(sizes), max((size for size in sizes if size is not None), default=None))
