"""What a transfer comes to: the parameters for another program, what they give there, and what was run for it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

from stemcal.doe.calibration.transfer import Learnt
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import Spread, absent, inline, key
from stemcal.notes import Note, Weight
from stemcal.runs.outcome import Outcome
from stemcal.stages.result import AimsAt, Entries, Head, Interval, StageResult

Stopped = Literal["tolerance", "budget", "out_of_reach", "settled"]
Role = Literal["search", "after", "before"]


class NotReached(Note, weight=Weight.USE):
    """The response there is not within the tolerance: runs spent, the range at its end, or no step left to take."""

    stopped: Stopped
    missed_percent: float
    aim: float
    factors: tuple[str, ...]


class BeyondRange(Note, weight=Weight.USE):
    """A value lies outside the study's range of the factor: the spec allows it, or it belongs to mesh and lengths."""

    factor: str
    value: float
    low: float
    high: float
    allowed: bool


class StillRose(Note, weight=Weight.NUMBERS):
    """In so many runs there the response still rose when the stroke ended: what they gave is a lower bound."""

    runs: int


class NotRunThere(Note, weight=Weight.USE):
    """The result was not run at these conditions: the budget was spent, or the search had not `converged` before."""

    conditions: tuple[float, ...]
    converged: bool


class FailedThere(Note, weight=Weight.NUMBERS):
    """Runs with the result failed at these conditions, the first for this reason."""

    conditions: tuple[float, ...]
    reason: str


@dataclass(frozen=True)
class TargetSolver:
    """What answers there: kind and version of the program as far as it tells, and settings that values belong to."""

    kind: str
    version: str | None = None
    belongs_to: dict[str, str] | None = absent()


@dataclass(frozen=True)
class AdjustedFactor:
    """A factor that might move: calibrated, and for the other program, with the range it might move in.

    `interval` holds the value with 95 % by the scatter of the measured mean, all else as it is; None where that counts
    as exact. `beyond` tells that the value lies outside the study's range.
    """

    factor: str
    calibrated: float
    value: float
    interval: Interval | None
    low: float
    high: float
    beyond: bool


@dataclass(frozen=True)
class TransferRow:
    """A condition: measured, simulated by the study's solver, by the other before and after; None where not run."""

    condition: float
    measured: float
    calibrated: float | None
    before: float | None
    after: float | None
    error_percent: float | None
    role: str


@dataclass(frozen=True, kw_only=True)
class TransferRun(Spread):
    """One run of the other program: of the search, or of the result (`after`) or the start (`before`) elsewhere.

    `predicted` is what the surface, as corrected by then, expected.
    """

    run: int
    role: Role
    condition: float
    levels: dict[str, float]
    predicted: float | None
    outcome: Outcome = inline()


@dataclass(frozen=True, kw_only=True, repr=False)
class TransferResult(StageResult):
    """The parameters for another program or mesh, and the response there at every condition.

    `aim` is what the response at `condition` is to be: the measured one, or, after a joint fit, what the study's own
    solver gives there with the calibrated parameters. `learnt` corrects the surface there; None where no run of the
    search succeeded.
    """

    name: ClassVar[str] = "transfer"
    shown = ("parameters",)

    head: Head = inline()
    solver: TargetSolver
    condition: float
    aim: float
    tolerance_percent: float
    budget: int
    converged: bool
    stopped: Stopped
    parameters: dict[str, float]
    adjusted: Rows[AdjustedFactor]
    rows: Rows[TransferRow]
    max_abs_error_percent: float | None
    learnt: Learnt | None
    asked: Rows[TransferRun] = key("runs")
    notes: tuple[Note, ...] = ()

    @property
    def fitted(self) -> TransferRow:
        """The row of the condition where the parameters were corrected."""
        return next(row for row in self.rows if row.condition == self.condition)

    @property
    def aims_at(self) -> AimsAt:
        """Whether the aim is the measured response, or what the study's own solver gives."""
        return "measured" if self.aim == self.fitted.measured else "study"

    @property
    def missed_percent(self) -> float:
        """How far the response there is from its aim, without a sign."""
        after = self.fitted.after
        return 100.0 if after is None else 100.0 * abs(after / self.aim - 1.0)

    def _tables(self) -> dict[str, Table]:
        """Return the responses, the factors that moved, and every run."""
        columns = ("condition", "role", "measured", "calibrated", "before", "after", "error_percent")
        moved = ("factor", "calibrated", "value", "interval_low", "interval_high", "low", "high", "beyond")
        values = [
            (one.factor, one.calibrated, one.value, *(one.interval or (None, None)), one.low, one.high, one.beyond)
            for one in self.adjusted
        ]
        runs = ("run", "role", "condition", *self.moving, "predicted", "response", "status", "reason")
        return {
            "transfer": Table.of(columns, self.rows),
            "transfer_parameters": Table.of(moved, [dict(zip(moved, row, strict=True)) for row in values]),
            "transfer_runs": Table.of(runs, self.asked),
        }

    @property
    def moving(self) -> tuple[str, ...]:
        """The factors that might move."""
        return tuple(one.factor for one in self.adjusted)

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run."""
        for one in self.asked:
            yield f"transfer {one.run}{self.naming.at(one.condition)}", one.outcome

    def entries(self) -> Iterator[Entries]:
        """Yield what must be told of every factor that might move."""
        yield "parameters", self.parameters, self.moving
