"""Solvers outside stemcal as a spec describes them: any command, LS-DYNA and OpenRadioss."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, ValidationInfo, WithJsonSchema

from stemcal.naming import CUTTING, FIRST, Naming
from stemcal.study.spec.fields import Number, Quantity, SpecFile, Whole, complain

__all__ = [
    "CalculixResult",
    "CommandSolver",
    "Commanded",
    "CsvResult",
    "DeckSolver",
    "JsonResult",
    "LsDynaSolver",
    "OpenRadiossSolver",
    "ProgramOptions",
    "RcforcResult",
    "RegexResult",
    "ResultReader",
]

MOST_FILES = 100


class _Frozen(BaseModel):
    """Immutable, no unknown keys, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def _argument(given: object) -> object:
    if isinstance(given, str) and ("\0" in given or len(given) > 4000):
        raise complain("is not usable as an argument", "shorten it")
    return given


def _inside_run_folder(given: object) -> object:
    """Refuse names that leave the run folder, on any system."""
    if not isinstance(given, str):
        return given
    parts = given.replace("\\", "/").split("/")
    if not given.strip() or "\0" in given or ":" in given or given[0] in "/\\" or ".." in parts or len(given) > 255:
        raise complain(f"{given[:60]!r} is not a file in the run folder", "write its name, such as out.csv")
    return given


def _pattern(given: object, info: ValidationInfo) -> object:
    import re

    if not isinstance(given, str):
        return given
    try:
        groups = re.compile(given).groups
    except re.error as error:
        raise complain(f"is no regular expression: {error}", "mend it") from None
    if groups == 0:
        raise complain("has no group around the number", f"write it like '{_first(info)} = (\\S+)'")
    return given


def _first(info: ValidationInfo) -> str:
    """Return the name of the first response."""
    naming: Naming = (info.context or {}).get("naming", CUTTING)
    return naming.response.name


Argument = Annotated[str, StringConstraints(strict=True, min_length=1), BeforeValidator(_argument)]
Command = Annotated[tuple[Argument, ...], Field(min_length=1, max_length=200)]
RunFile = Annotated[str, StringConstraints(strict=True), BeforeValidator(_inside_run_folder)]
Variable = Annotated[str, StringConstraints(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)]
Value = Annotated[str, StringConstraints(strict=True), BeforeValidator(_argument)]
Environment = Annotated[dict[Variable, Value], Field(max_length=100)]
TimeLimit = Annotated[float, Quantity("time", above=0)]
Text = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=500)]
Pattern = Annotated[Text, BeforeValidator(_pattern), WithJsonSchema({"type": "string", "format": "regex"})]


class _Result(_Frozen):
    """A file of the run folder and how its series of numbers becomes one.

    ``max, min, first, last`` need the series alone; ``at`` (with `at`, linear between points), ``mean_over``
    (with `over: [from, to]`) and ``work`` (the integral) also need what it is plotted along. The number is
    multiplied by `scale`.
    """

    file: RunFile
    reduction: Literal["max", "min", "first", "last", "at", "mean_over", "work"] = "last"
    at: Number | None = None
    over: tuple[Number, Number] | None = None
    scale: Number = 1.0


class JsonResult(_Result):
    """A number or a list of numbers in a JSON file; `path` is keys and list indices joined by points."""

    kind: Literal["json"]
    path: Text
    along: Text | None = None


class CsvResult(_Result):
    """A column of a CSV file with a header; `along` is the column it is plotted against."""

    kind: Literal["csv"]
    column: Text
    along: Text | None = None


class RegexResult(_Result):
    """Numbers found in a text file, line by line: the group called ``y``, or else the first.

    A group called ``x`` holds what they are plotted along.
    """

    kind: Literal["regex"]
    pattern: Pattern


class RcforcResult(_Result):
    """The force of a contact over time in LS-DYNA's ASCII ``rcforc``, turned so that its peak is positive."""

    kind: Literal["rcforc"]
    file: RunFile = "rcforc"
    interface: Annotated[Whole, Field(ge=1)] = 1
    component: Literal["x", "y", "z"] = "z"


class CalculixResult(_Result):
    """What CalculiX has printed into its ``.dat`` for a set, over time: ``*NODE PRINT, NSET=TIP`` and ``RF``, say.

    `quantity` and `component` are called as there: ``forces`` and ``fz``, ``displacements`` and ``vx``, ``total
    force``. Forces are summed over the set; of other quantities `node` chooses one row of it.
    """

    kind: Literal["calculix"]
    set: Text
    quantity: Text = "forces"
    component: Text
    node: Annotated[Whole, Field(ge=1)] | None = None


ResultReader = Annotated[
    JsonResult | CsvResult | RegexResult | RcforcResult | CalculixResult, Field(discriminator="kind")
]


class Commanded(_Frozen):
    """A program that one command starts."""

    command: Command


class ProgramOptions(_Frozen):
    """What is said of every program that answers in place of the embedded solver."""

    environment: Environment = {}
    time_limit: TimeLimit = 3600.0
    files: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    version: Annotated[str, StringConstraints(strict=True, max_length=200)] = ""
    keep: Literal["failed", "all"] = "failed"


class CommandSolver(ProgramOptions, Commanded):
    """Any program that reads text files and leaves its result in one.

    In `templates` and in the arguments of `command`, ``{{factor}}`` stands for the factor's value in the unit of
    the spec and ``{{diameter}}`` for the stem's outer diameter in mm, or the condition that the spec declares in its
    place by its name; nothing else is replaced but, in a program with chance in it, ``{{seed}}`` (a whole number,
    another one in every run) and ``{{replicate}}``. `command` is a list of arguments and never passes through a shell.
    Each run has a folder of its own, in which templates and `files` lie under their own names. The number that `result`
    reads is the response: the maximum force in N, or what the spec declares under ``responses``; of several responses
    `result` has a reader under the name of each. ``targets`` hold the values it is calibrated to.

    `deterministic` says whether equal inputs give equal answers: if true, one run is repeated at the start to see it;
    if false, or with more than one of `replicates`, every run of a design is simulated anew with a seed of its own,
    and so often. `seed` draws other seeds.
    """

    kind: Literal["command"] = "command"
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    result: ResultReader | None = None
    results: Annotated[dict[str, ResultReader], Field(max_length=20)] = {}
    deterministic: Annotated[bool, Field(strict=True)] | None = None
    replicates: Annotated[Whole, Field(ge=1, le=100)] = 1
    seed: Annotated[Whole, Field(ge=0, le=2**31)] = 0

    @property
    def readers(self) -> dict[str, ResultReader]:
        """How each response is read; the one of a single reader is called `FIRST`."""
        return dict(self.results) if self.result is None else {FIRST: self.result}

    @property
    def by_chance(self) -> bool:
        """Whether equal inputs may give different answers."""
        return self.replicates > 1 or self.deterministic is False


class DeckHourglass(_Frozen):
    """Hourglass control of LS-DYNA: Flanagan and Belytschko's stiffness form (IHQ 4) or the viscous one (IHQ 1)."""

    form: Literal["stiffness", "viscous"] = "stiffness"
    coefficient: Annotated[Number, Field(ge=0, le=1)] = 0.05


class DeckAt(_Frozen):
    """The user's own deck of a stem of one diameter."""

    diameter: Annotated[float, Quantity("length", above=0)]
    deck: SpecFile


class DeckSolver(ProgramOptions):
    """What is said of every program that runs a keyword deck of the shear test.

    The force is that of contact `interface`, times `scale` (4 for a quarter model), filtered, and its peak found like
    that of the embedded solver.
    """

    time_limit: TimeLimit = 86400.0
    interface: Annotated[Whole, Field(ge=1)] = 1
    scale: Number = 1.0
    filter_window: Annotated[float, Quantity("time", at_least=0)] = 0.010
    break_drop: Annotated[Number, Field(gt=0, le=1)] = 0.5
    element_size: Annotated[float, Quantity("length", above=0)] = 1.0
    elements_through_wall: Annotated[Whole, Field(ge=1, le=50)] | None = None
    hourglass: DeckHourglass = DeckHourglass()
    mass_scaling: Annotated[Number, Field(ge=1)] = 1e4
    time_step_safety: Annotated[Number, Field(gt=0, le=1)] = 0.8
    outputs: Annotated[Whole, Field(ge=10, le=100_000)] = 500


class LsDynaSolver(DeckSolver, Commanded):
    """LS-DYNA, run on a deck that stemcal writes, or on the user's own `deck` with the stem's MAT_003 replaced.

    A deck of the user's is of one stem: `deck` of that at the calibration diameter, `decks` of others.

    In the arguments of `command`, ``{{deck}}`` stands for the file name of the deck. The force is the resultant of
    contact `interface` along `component` in ``rcforc``. `files` (what the deck includes) are put beside it.
    """

    kind: Literal["lsdyna"] = "lsdyna"
    deck: SpecFile | None = None
    decks: Annotated[tuple[DeckAt, ...], Field(max_length=MOST_FILES)] = ()
    material: Annotated[Whole, Field(ge=1)] | None = None
    component: Literal["x", "y", "z"] = "z"


class OpenRadiossSolver(DeckSolver):
    """OpenRadioss, run on a deck that stemcal writes: starter, engine, ``th_to_csv``.

    The programs are those named here, else those of the installation in `home` or in the environment variable
    ``OPENRADIOSS_PATH``, else those on PATH. `rate_law` is that of the embedded solver.
    """

    kind: Literal["openradioss"] = "openradioss"
    home: Text | None = None
    starter: Argument | None = None
    engine: Argument | None = None
    th_to_csv: Argument | None = None
    threads: Annotated[Whole, Field(ge=1, le=256)] = 1
    rate_law: Literal["paper", "cowper_symonds"] = "paper"
