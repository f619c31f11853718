"""The base class of stage results: the head of a stage file, conversion to and from JSON, tables, runs."""

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
    """The first entries of every stage file: `inputs` are hashes, `naming` has the names of responses and condition."""

    schema_version: int
    stage: str
    study: str
    title: str = ""
    stemcal_version: str = ""
    inputs: dict[str, str] | None = None
    naming: Vocabulary = CUTTING


@dataclass(frozen=True)
class CodedScale:
    """The coding of a factor: its value at coded 0 (`center`), and the difference to coded 1 (`half_step`)."""

    center: float
    half_step: float

    def natural(self, coded: Any) -> Any:
        """Return coded numbers or arrays in the unit of the factor."""
        return self.center + self.half_step * coded


@dataclass(frozen=True, kw_only=True)
class DesignRun(Spread):
    """One run of a design: all levels, coded levels of varied factors, the condition if it varies, the outcome."""

    run: int
    levels: dict[str, float]
    coded: dict[str, float]
    condition: float | None = absent()
    replicate: int | None = absent()
    outcome: Outcome = inline()

    @property
    def response(self) -> float | None:
        """First response; None if the run failed."""
        return self.outcome.response

    def number(self, name: str) -> float:
        """Return a response by its name, or the first one for `FIRST`; NaN if the run failed."""
        return self.outcome.number(name)


@dataclass(frozen=True)
class DesignRuns:
    """The runs of a design, in order."""

    kind: str
    runs: Rows[DesignRun]

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of the factors that vary."""
        return tuple(name for name in self.runs[0].coded if name in self.runs[0].levels) if self.runs else ()

    def table(self) -> Table:
        """Return levels and response of every run, as a sheet that the solver for manual runs can read."""
        more = [name for name in ("condition", "replicate") if self.runs and getattr(self.runs[0], name) is not None]
        return Table.of(["run", *self.varied, *more, "response"], self.runs)


@dataclass(frozen=True)
class Judged:
    """The error of a response at a condition, None if the run failed; `key` is the key of the run record."""

    response: str
    condition: float
    error_percent: float | None
    fitted: bool
    key: str = field(default="", compare=False)

    @property
    def size(self) -> float:
        """Absolute error in percent; 0 if the run failed."""
        return abs(self.error_percent or 0.0)


@dataclass(frozen=True)
class Prediction:
    """Largest error of the model for values that were not fitted, and the errors of a power law (`formula`) for them.

    The values were held out at `conditions`, or left out in a cross-validation: one `in_turn`, e.g. a stem diameter.
    """

    worst_percent: float
    formula: Formula | None
    conditions: tuple[float, ...] = ()
    in_turn: str = ""

    @property
    def better(self) -> Better | None:
        """The better predictor (model, formula or neither); None without a formula."""
        return None if self.formula is None else self.formula.better(self.worst_percent)


class StageResult(Spread):
    """Base class of the result of a stage; its fields are the contents of the stage file."""

    name: ClassVar[str]
    shown: ClassVar[tuple[str, ...]] = ()
    """Attributes in the `repr` of a result."""
    head: Head
    notes: tuple[Note, ...]

    @property
    def naming(self) -> Vocabulary:
        return self.head.naming

    @property
    def settles(self) -> Mapping[str, float] | None:
        """Calibrated levels of all factors; None if the stage does not calibrate the study's own model."""
        return None

    @property
    def recentred(self) -> Mapping[str, CodedScale] | None:
        """Coding of the factors of the surface about a better centre; None if the stage finds no centre."""
        return None

    @property
    def misses(self) -> tuple[float, ...]:
        """Errors of the fitted values in percent."""
        return ()

    @property
    def best(self) -> tuple[Mapping[str, float], Mapping[str, float]] | None:
        """Levels at the optimum of a goal and at the present cutter; None for all other results."""
        return None

    @property
    def gains(self) -> tuple[str, ...]:
        """Sentences on the gains of an optimum over the present cutter; none for all other results."""
        return ()

    @property
    def prediction(self) -> Prediction | None:
        """Errors of predictions of values that were not fitted; None if there are none."""
        return None

    def sign_of(self, factor: str) -> Literal["+", "-"] | None:
        """Return the sign of a factor's effect on the first response; None if it is not significant."""
        return None

    def judged(self, study: Study) -> list[Judged]:
        """Return the errors of simulations with the calibrated parameters, in the study's own model."""
        return []

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without cached properties."""
        result: Any = self
        return {field.name: getattr(self, field.name) for field in fields(result)}

    def to_json(self) -> dict[str, Any]:
        """Return the contents of the stage's file."""
        content: dict[str, Any] = jsonable({**to_json(self.head), **to_json(self)})  # the head comes first
        return content

    @classmethod
    def from_json(cls, content: object) -> Self:
        """Return the result from the contents of a stage file; raise `UsageError` if they are invalid."""
        try:
            return from_json(cls, content)
        except ValueError as error:
            raise UsageError(f"{cls.name}.json: {error}. Run `stemcal {cls.name} SPEC` again.") from None

    def tables(self) -> dict[str, Table]:
        """Return the tables for the CSV files of the stage, by file name, with headings in the terms of the study."""
        return {name: table.headed(self.naming.headings) for name, table in self._tables().items()}

    def _tables(self) -> dict[str, Table]:
        raise NotImplementedError

    def to_frame(self) -> pd.DataFrame:
        """Return the main table of the stage as a pandas DataFrame, with headings in the terms of the study."""
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
    """Round a number, or all numbers of a mapping, to four digits.

    >>> _short({"a": 18.36612, "b": 0.03})
    {'a': 18.37, 'b': 0.03}
    """
    if isinstance(value, Mapping):
        return {name: _short(each) for name, each in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def write_result(folder: StudyFolder, result: R) -> R:
    """Write the JSON file and the tables of a stage; return the result as it was read back from the file."""
    content = result.to_json()
    result = type(result).from_json(content)
    for name, table in result.tables().items():
        write_atomic(folder.path / f"{name}.csv", table.csv())
    folder.write_stage(result.name, content)
    folder.log("stage_done", stage=result.name)
    return result


def read_result(folder: StudyFolder, kind: type[R]) -> R:
    """Return a stage's result from its file; raise `UsageError` if the file is missing or invalid."""
    return kind.from_json(folder.read_stage(kind.name))
