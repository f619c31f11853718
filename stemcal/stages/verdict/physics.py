"""How many of a study's runs have doubtful physics, according to their records."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any, Literal

from stemcal.folder import StudyFolder
from stemcal.run_warnings import MOST_DRIFT, MOST_HOURGLASS, MOST_INERTIA, NEGLIGIBLE_MASS
from stemcal.stages.results import Results
from stemcal.stages.stage import stage_called
from stemcal.study.model import Study

DoubtKind = Literal["hourglass", "inertia", "drift", "stroke"]
Doubts = dict[DoubtKind, float | None]
LIMITS: dict[DoubtKind, float] = {"hourglass": MOST_HOURGLASS, "inertia": MOST_INERTIA, "drift": MOST_DRIFT}
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
class DoubtAt:
    """The worst doubt of the run that validates one condition, and whether the parameters were fitted there."""

    condition: float
    fitted: bool
    doubt: Doubt


@dataclass(frozen=True)
class Physics:
    """The number of distinct runs with checks, the number of doubtful ones, and the reasons.

    `at_solution` are the doubts of runs with the calibrated parameters, one by one.
    """

    checked: int
    doubtful: int
    doubts: tuple[Doubt, ...]
    at_solution: tuple[DoubtAt, ...] = ()

    @property
    def share(self) -> float:
        """Share of the checked runs that are doubtful."""
        return self.doubtful / self.checked if self.checked else 0.0


def physics_of(study: Study, results: Results, folder: StudyFolder) -> Physics:
    """Read the checks of every run of the study's own solver; runs of solvers without checks are not counted."""
    own = [result for result in results.done if stage_called(result.name).seen(study) is study]
    outcomes = [outcome for result in own for _, outcome in result.runs()]
    keys = dict.fromkeys(outcome.key for outcome in outcomes if outcome.key and outcome.ok)
    every = {key: doubts for key in keys if (doubts := _doubts_of(key, folder)) is not None}
    found = list(every.values())
    kinds = dict.fromkeys(kind for doubts in found for kind in doubts)
    return Physics(
        checked=len(found),
        doubtful=sum(bool(doubts) for doubts in found),
        doubts=tuple(
            sorted((_gathered(kind, found) for kind in kinds), key=lambda doubt: (-doubt.runs, doubt.kind)),
        ),
        at_solution=tuple(_at_solution(study, results, every)),
    )


def _at_solution(study: Study, results: Results, every: Mapping[str, Doubts]) -> Iterator[DoubtAt]:
    """Yield what is doubtful of each run with the calibrated parameters that was compared."""
    runs = {row.key: row for result in results.done for row in reversed(result.judged(study))}
    for key, row in reversed(runs.items()):
        for kind, size in every.get(key, {}).items():
            yield DoubtAt(row.condition, row.fitted, Doubt(kind, 1, size))


def _doubts_of(key: str, folder: StudyFolder) -> Doubts | None:
    content = folder.peek(key)
    return None if content is None else _doubts(content["details"])


def _doubts(details: Mapping[str, Any]) -> Doubts | None:
    """Return what is doubtful of a run with its size; None if the solver did not report it."""
    sizes = {kind: details[name] for kind, name in _DETAILS.items() if isinstance(details.get(name), int | float)}
    if not sizes and "stroke_was_enough" not in details:
        return None
    if details.get("added_mass_percent", inf) <= NEGLIGIBLE_MASS:
        sizes.pop("inertia", None)  # it is the stem's own
    found: Doubts = {kind: value for kind, value in sizes.items() if value > LIMITS[kind]}
    return found | ({"stroke": None} if details.get("stroke_was_enough") is False else {})


def _gathered(kind: DoubtKind, found: list[Doubts]) -> Doubt:
    sizes = [doubts[kind] for doubts in found if kind in doubts]
    return Doubt(kind, len(sizes), max((size for size in sizes if size is not None), default=None))
