"""What other meshes make of the force at the solution, and the intervals with their scatter in them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

from stemcal.doe.calibration.mesh_scatter import MeshScatter, SizeFactor
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import Spread, absent, inline
from stemcal.naming import FIRST
from stemcal.notes import Note
from stemcal.runs.outcome import Outcome
from stemcal.stages.invert.result import Certainty, InvertResult
from stemcal.stages.result import Head, Interval, StageResult

_COLUMNS = ("condition", "mesh", "response", "status", "reason")


@dataclass(frozen=True, kw_only=True)
class MeshRun(Spread):
    """The force at the solution on one mesh: ``own``, ``phases`` (their mean) or an element size.

    `further` has travel and work at each place, where they were measured.
    """

    condition: float
    mesh: str
    further: dict[str, tuple[float, ...]] | None = absent()
    outcome: Outcome = inline()

    def at_places(self, response: str) -> tuple[float, ...]:
        """Return the response at each place of the mesh; nothing where that is not told."""
        return self.outcome.phase_responses or () if response == FIRST else (self.further or {}).get(response, ())


@dataclass(frozen=True)
class BudgetRow:
    """One source of error of the force at a diameter: standard deviation, share of the variance, degrees of freedom.

    `shared` is what moves all diameters alike, which no mean over them makes smaller; `df` is None where the variance
    counts as known.
    """

    condition: float
    source: str
    sd: float
    share_percent: float
    df: float | None
    shared: bool = False


@dataclass(frozen=True, kw_only=True, repr=False)
class MeshResult(StageResult):
    """The force at the solution on other meshes, its scatter, and the inversion's intervals with that scatter in them.

    `prediction_interval` is of a further simulation with the mesh at any place, `scatter` of a force on one mesh,
    `further` that of travel and work where they were measured.
    """

    name: ClassVar[str] = "mesh"

    head: Head = inline()
    parameters: dict[str, float]
    belongs_to: dict[str, str]
    condition: float
    rows: Rows[MeshRun]
    scatter: MeshScatter
    further: dict[str, MeshScatter] | None = absent()
    sizes: Rows[SizeFactor]
    budget: Rows[BudgetRow]
    mean_interval: Interval | None
    prediction_interval: Interval | None
    ranges: dict[str, Interval]
    coded_ranges: dict[str, Interval]
    certainty: Certainty
    certainty_alone: Certainty | None = absent()
    notes: tuple[Note, ...] = ()

    def widened(self, inversion: InvertResult) -> InvertResult:
        """Return an inversion with the intervals that hold the scatter of the mesh."""
        mean, one = self.mean_interval, self.prediction_interval
        return replace(
            inversion,
            point=replace(inversion.point, mean_interval=mean, prediction_interval=one),
            ranges=self.ranges,
            coded_ranges=self.coded_ranges,
            certainty=self.certainty,
            certainty_alone=self.certainty_alone,
        )

    @property
    def known(self) -> list[Certainty]:
        """What is known of the parameters with the mesh's scatter counted, as of an inversion."""
        return [part for part in (self.certainty, self.certainty_alone) if part is not None]

    def scatter_of(self, response: str) -> MeshScatter | None:
        """Return the scatter of the force, or of travel or work; None where it is not told."""
        return self.scatter if response == FIRST else (self.further or {}).get(response)

    def _tables(self) -> dict[str, Table]:
        """Return the force on every mesh, and the error budget."""
        budget = Table.of(("condition", "source", "sd", "share_percent", "df", "shared"), self.budget)
        return {"mesh": Table.of(_COLUMNS, self.rows), "mesh_budget": budget}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run."""
        for row in self.rows:
            yield f"mesh {row.mesh} at {row.condition:g} mm", row.outcome
