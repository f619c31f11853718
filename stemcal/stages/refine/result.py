"""What the closed loop comes to: every iteration, the best of them, and the surfaces that learnt."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

from stemcal.doe.regression.fit_statistics import Coefficient
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import Spread, absent, inline
from stemcal.notes import Note
from stemcal.runs.outcome import Outcome
from stemcal.stages.result import Head, Interval, StageResult

Stopped = Literal["tolerance", "budget", "settled"]


@dataclass(frozen=True)
class Place:
    """Where an iteration was, coded, and within which radius of the best it was sought."""

    coded: dict[str, float]
    coded_radius: float
    step_radius: float | None


@dataclass(frozen=True)
class ResponseRow:
    """A response at a point: measured, predicted by the surface, simulated."""

    condition: float
    response: str
    unit: str
    measured: float
    predicted: float
    prediction_interval: Interval | None
    simulated: float | None
    inside_interval: bool | None
    error_percent: float | None


@dataclass(frozen=True, kw_only=True)
class RefineRow(Spread):
    """One run: where it was, what the surface had predicted, what came of it.

    `how` is ``solution`` (of the stage before), ``surface`` (the refitted one), ``bracket`` (between two simulated
    points) or ``back`` (half-way back from a run that failed). `condition`, `measured` and `further` are of joint fits.
    """

    iteration: int
    how: str
    condition: float | None = absent()
    levels: dict[str, float]
    place: Place | None = inline(None)
    measured: float | None = absent()
    predicted: float
    prediction_interval: Interval | None
    inside_interval: bool | None
    error_percent: float | None
    outcome: Outcome = inline()
    further: Rows[ResponseRow] = absent(Rows())


@dataclass(frozen=True)
class Iteration:
    """One point of a joint fit, simulated at every diameter; None where not all runs succeeded."""

    iteration: int
    how: str
    levels: dict[str, float]
    coded: dict[str, float]
    coded_radius: float
    reach: float | None
    misfit: float | None
    max_abs_error_percent: float | None
    error_percent: float | None


@dataclass(frozen=True)
class Learnt:
    """The surface with the simulated points in it."""

    coefficients: Rows[Coefficient]
    r2: float | None


@dataclass(frozen=True, kw_only=True)
class LearntOf(Spread):
    """The surface of one measured mean with the simulated points in it, and the variance that weighs it."""

    condition: float
    response: str
    variance: float
    learnt: Learnt = inline()


@dataclass(frozen=True, kw_only=True, repr=False)
class RefineResult(StageResult):
    """The refined parameters; `at_conditions`, `stopped`, `iterations` and `surfaces` are of a joint fit."""

    name: ClassVar[str] = "refine"
    shown = ("solution",)

    head: Head = inline()
    target: float
    condition: float
    at_conditions: tuple[float, ...] = absent(())
    tolerance_percent: float
    budget: int
    converged: bool
    stopped: Stopped | None = absent()
    iteration: int
    solution: dict[str, float]
    coded: dict[str, float]
    coded_radius: float
    simulated: float | None
    error_percent: float
    max_abs_error_percent: float | None = absent()
    parameters: dict[str, float]
    iterations: Rows[Iteration] = absent(Rows())
    rows: Rows[RefineRow]
    surface: Learnt | None = absent()
    surfaces: Rows[LearntOf] = absent(Rows())
    notes: tuple[Note, ...] = ()

    def _tables(self) -> dict[str, Table]:
        """Return every run."""
        at = ("condition",) if self.at_conditions else ()
        columns = (
            "iteration",
            "how",
            *at,
            *self.solution,
            "predicted",
            "response",
            "error_percent",
            "status",
            "reason",
        )
        return {"refine": Table.of(columns, self.rows)}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run."""
        for number, row in enumerate(self.rows, 1):
            yield f"refine {number}", row.outcome
