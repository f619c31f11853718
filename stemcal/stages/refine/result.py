"""The result of the refinement: the refined parameters, the responses with them, and every run."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from stemcal.drawing.table import Table
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.loop import RefineRun, Stopped
from stemcal.stages.result import Head, Interval, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import absent, inline
from stemcal.vocabulary import Wording


@dataclass(frozen=True)
class SimulatedBy:
    """The simulating program: solver kind, version if known, and the settings on which the parameters depend."""

    kind: str
    version: str | None = None
    depends_on: dict[str, str] | None = absent()


@dataclass(frozen=True)
class AdjustedFactor:
    """A factor that may move in another model; its 95 % interval follows from the scatter of the measured mean."""

    factor: str
    calibrated: float
    value: float
    interval: Interval | None
    low: float
    high: float


@dataclass(frozen=True)
class RefineRow:
    """A measured mean, and the response `before` (at the first solution) and `after` (at the refined parameters)."""

    condition: float
    response: str
    measured: float
    before: float | None
    after: float | None
    error_percent: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class RefineResult(StageResult):
    """The refined parameters and the responses with them; `model` (key `in`) is the model to use them in.

    `aim` is the response to reach at `condition`: the measured one; in another model after a joint fit, the response of
    the study's own model. `elsewhere`: whether `model` is another model. `undetermined` are the factors that stayed at
    mid-range in a study without a response surface.
    """

    name: ClassVar[str] = "refine"
    shown = ("parameters",)

    head: Head = inline()
    elsewhere: bool
    model: SimulatedBy = field(metadata={"alias": "in"})
    condition: float
    aim: float
    tolerance_percent: float
    budget: int
    converged: bool
    stopped: Stopped
    error_percent: float
    parameters: dict[str, float]
    adjusted: Rows[AdjustedFactor]
    rows: Rows[RefineRow]
    max_abs_error_percent: float | None
    trial_runs: Rows[RefineRun] = field(metadata={"alias": "runs"})
    undetermined: tuple[str, ...] = absent(())
    notes: tuple[Note, ...] = ()

    @property
    def settles(self) -> Mapping[str, float] | None:
        """Refined parameters; None if they are for another model."""
        return None if self.elsewhere else self.parameters

    @property
    def varied(self) -> tuple[str, ...]:
        """Factors whose levels differ between the runs."""
        first = self.trial_runs[0].levels
        return tuple(name for name in first if any(run.levels[name] != first[name] for run in self.trial_runs))

    @property
    def alone(self) -> bool:
        """Whether the study has no response surface, so that the refinement alone calibrates it."""
        return self.trial_runs[0].how == "middle"

    @property
    def determined(self) -> tuple[str, ...]:
        """Factors that the runs determine in a study without a response surface; otherwise none."""
        return tuple(name for name in self.varied if name not in self.undetermined) if self.alone else ()

    @property
    def fitted(self) -> RefineRow:
        """Row of the first response at the calibration condition."""
        return next(row for row in self.rows if row.condition == self.condition)

    def _tables(self) -> dict[str, Table]:
        columns = ("condition", "response", "measured", "before", "after", "error_percent")
        runs = ("run", "how", "condition", *self.varied, "predicted", "response", "status", "reason")
        return {"refine": Table.of(columns, self.rows), "refine_runs": Table.of(runs, self.trial_runs)}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        for run in self.trial_runs:
            yield f"refine {run.run}{Wording(self.naming).at(run.condition) if self.elsewhere else ''}", run.outcome
