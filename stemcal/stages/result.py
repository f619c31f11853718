"""What every stage's result has: how it begins, how it becomes JSON and comes back, its tables and runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from html import escape
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, TypeVar

from stemcal.doe.comparison import Better, Formula
from stemcal.drawing.table import Table
from stemcal.errors import UsageError
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.storage.atomic import write_atomic
from stemcal.storage.canonical import jsonable
from stemcal.storage.rows import Rows
from stemcal.storage.typed import Spread, absent, from_json, inline, to_json
from stemcal.vocabulary import CUTTING, Vocabulary

if TYPE_CHECKING:
    import pandas as pd

    from stemcal.study.model.study import Study

R = TypeVar("R", bound="StageResult")
Interval = tuple[float, float]


@dataclass(frozen=True)
class Head:
    """How every stage file begins: a hash of each input, and the `naming` of what has neutral keys in the file."""

    schema_version: int
    stage: str
    study: str
    title: str = ""
    stemcal_version: str = ""
    inputs: dict[str, str] | None = None
    naming: Vocabulary = CUTTING


@dataclass(frozen=True)
class CodedScale:
    """Coded 0 and the length of coded 1 of a factor."""

    center: float
    half_step: float

    def natural(self, coded: Any) -> Any:
        """Return numbers or arrays in the factor's unit."""
        return self.center + self.half_step * coded


@dataclass(frozen=True, kw_only=True)
class DesignRun(Spread):
    """One run of a design, from 1: all levels, the varied ones coded, its condition if that varies, its outcome."""

    run: int
    levels: dict[str, float]
    coded: dict[str, float]
    condition: float | None = absent()
    replicate: int | None = absent()
    outcome: Outcome = inline()

    @property
    def response(self) -> float | None:
        """The first response; None where the run failed."""
        return self.outcome.response

    def number(self, name: str) -> float:
        """Return a response by its name, or the first one for `FIRST`; NaN where the run failed."""
        return self.outcome.number(name)


@dataclass(frozen=True)
class DesignRuns:
    """The runs of a design, in its order."""

    kind: str
    runs: Rows[DesignRun]

    @property
    def varied(self) -> tuple[str, ...]:
        """The factors that vary."""
        return tuple(name for name in self.runs[0].coded if name in self.runs[0].levels) if self.runs else ()

    def table(self) -> Table:
        """Return levels and response of every run, as a table solver reads them."""
        more = [name for name in ("condition", "replicate") if self.runs and getattr(self.runs[0], name) is not None]
        return Table.of(["run", *self.varied, *more, "response"], self.runs)


@dataclass(frozen=True)
class Judged:
    """A response at a condition: its error (None: the run failed), if fitted or a check, the `key` of its record."""

    response: str
    condition: float
    error_percent: float | None
    fitted: bool
    key: str = field(default="", compare=False)

    @property
    def size(self) -> float:
        """The error without its sign."""
        return abs(self.error_percent or 0.0)


@dataclass(frozen=True)
class Prediction:
    """The largest error of values held out at `conditions` or each `in_turn`, and that of F = a·dᵇ, if compared."""

    worst_percent: float
    formula: Formula | None
    conditions: tuple[float, ...] = ()
    in_turn: str = ""

    @property
    def better(self) -> Better | None:
        """Which predicts better, the model or the formula; None without a formula."""
        return None if self.formula is None else self.formula.better(self.worst_percent)


class StageResult(Spread):
    """The result of a stage: frozen, typed, the same as its file."""

    name: ClassVar[str]
    shown: ClassVar[tuple[str, ...]] = ()
    """The attributes that a result is shown with."""
    head: Head
    notes: tuple[Note, ...]

    @property
    def naming(self) -> Vocabulary:
        """What the responses and the condition are called."""
        return self.head.naming

    @property
    def settles(self) -> Mapping[str, float] | None:
        """The level of every factor, where the stage calibrates the study's own model; None where it does not."""
        return None

    @property
    def recentred(self) -> Mapping[str, CodedScale] | None:
        """The factors of the surface with a coding around a better centre; None where it finds none."""
        return None

    @property
    def misses(self) -> tuple[float, ...]:
        """By how many % it misses what it fits."""
        return ()

    @property
    def best(self) -> tuple[Mapping[str, float], Mapping[str, float]] | None:
        """The levels of the optimum of a goal, and the present ones; None of any other result."""
        return None

    @property
    def found(self) -> tuple[str, ...]:
        """The result of an optimisation in sentences."""
        return ()

    @property
    def prediction(self) -> Prediction | None:
        """How well values that were not fitted are predicted; None where none are."""
        return None

    def sign_of(self, factor: str) -> Literal["+", "-"] | None:
        """Return the sign of a factor's effect on the first response; None where it is not sure."""
        return None

    def judged(self, study: Study) -> list[Judged]:
        """Return measured against simulated, of runs with the calibrated parameters in the study's own model."""
        return []

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields, without cached values that follow from them."""
        result: Any = self
        return {field.name: getattr(self, field.name) for field in fields(result)}

    def to_json(self) -> dict[str, Any]:
        """Return the contents of the stage's file."""
        content: dict[str, Any] = jsonable({**to_json(self.head), **to_json(self)})  # the head comes first
        return content

    @classmethod
    def from_json(cls, content: object) -> Self:
        """Return the result that a stage's file holds; raise `UsageError` if it holds something else."""
        try:
            return from_json(cls, content)
        except ValueError as error:
            raise UsageError(f"{cls.name}.json: {error}. Run `stemcal {cls.name} SPEC` again.") from None

    def tables(self) -> dict[str, Table]:
        """Return the tables that the stage leaves as CSV, by file name, headed as the study calls things."""
        return {name: table.headed(self.naming.headings) for name, table in self._tables().items()}

    def _tables(self) -> dict[str, Table]:
        """Return the tables with columns called as the fields are; the one of the stage itself comes first."""
        raise NotImplementedError

    def to_frame(self) -> pd.DataFrame:
        """Return the stage's own table as a frame of pandas, headed as the study calls things."""
        return next(iter(self.tables().values())).to_frame()

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run."""
        yield from ()

    def __repr__(self) -> str:
        shown = "".join(f", {name}={_short(attrgetter(name)(self))!r}" for name in self.shown)
        return f"{type(self).__name__}(study={self.head.study!r}{shown})"

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>{''.join(table._repr_html_() for table in self.tables().values())}"


def _short(value: Any) -> Any:
    """Return a number, or numbers by name, to four digits.

    >>> _short({"a": 18.36612, "b": 0.03})
    {'a': 18.37, 'b': 0.03}
    """
    if isinstance(value, Mapping):
        return {name: _short(each) for name, each in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def leave(folder: StudyFolder, result: R) -> R:
    """Write a stage's JSON and tables; returns the result as a reader of the file gets it."""
    content = result.to_json()
    result = type(result).from_json(content)
    for name, table in result.tables().items():
        write_atomic(folder.path / f"{name}.csv", table.csv())
    folder.write_stage(result.name, content)
    folder.log("stage_done", stage=result.name)
    return result


def read_result(folder: StudyFolder, kind: type[R]) -> R:
    """Return a stage's result from its file; raise `UsageError` if it is not there or cannot be read."""
    return kind.from_json(folder.read_stage(kind.name))
