"""The keys of the `solver` section in a spec for each kind of solver."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, StringConstraints

from stemcal.notes import Remedy
from stemcal.solvers.result_reader import ResultReader
from stemcal.study.types.field_types import Flag, Length, Number, Quantity, SpecFile, StemLength, Time, Whole
from stemcal.study.types.solver_kind import ElementCounts, SolverOptions
from stemcal.version import __version__
from stemcal.vocabulary import FIRST

# The stem counts as fractured once elements have failed and the force has dropped by this share of its maximum.
BREAK_DROP = 0.5
# Blade speed (mm/s; 100 mm/min) up to which the mass scaling and the time step are those of the spec.
_SLOW = 100.0 / 60.0
# Types of keys that the embedded solver and the deck solver share.
_ThroughWall = Annotated[
    Annotated[Whole, Field(ge=1, le=50)] | None,
    Field(
        description="Number of elements through the wall thickness. By default, the radial element length is at most "
        "`element_size`."
    ),
]
_MassScaling = Annotated[
    Number,
    Field(
        ge=1,
        description="Factor by which all masses are multiplied. A larger factor increases the time step and the "
        "kinetic energy. The kinetic energy is checked in each run.",
    ),
]
_FilterWindow = Annotated[
    float,
    Quantity("time", at_least=0),
    Field(description="Window length of the low-pass filter for the force; 0 s disables the filter."),
]


class EmbeddedSolver(SolverOptions):
    """The explicit finite element solver that comes with stemcal."""

    kind: Literal["embedded"] = "embedded"
    """The embedded solver, which is included in stemcal."""
    rate_law: Literal["paper", "cowper_symonds", "none"] = "paper"
    """Rate law of the yield stress: `paper` is 1 + (rate/C)^P as printed in the wild chrysanthemum study,
    `cowper_symonds` is 1 + (rate/C)^(1/P), and `none` omits the rate effect."""
    element_size: StemLength = Length(divisor=16.0)
    """Length of the elements under the blade edge: a length, or a fraction of the diameter such as d/16. Use at most
    0.6 times the smaller of `edge_spread` and `internal_length`."""
    elements_through_wall: _ThroughWall = None
    edge_over: Literal["elements", "nodes"] = "nodes"
    """Position of the blade edge: above a row of nodes, or above the middle of a row of elements."""
    hourglass: Annotated[Number, Field(ge=0, le=1)] = 0.01
    """Hourglass coefficient, defined as `QH` of hourglass type 4 in LS-DYNA. A small coefficient permits
    zero-energy modes; a large coefficient makes the stem too stiff."""
    mass_scaling: _MassScaling = 1e4
    time_step: Time | None = 4e-5
    """Minimum time step: mass is added to elements with a smaller stable time step. With `null`, no mass is added."""
    time_step_safety: Annotated[Number, Field(ge=0.001, le=1)] = 0.9
    """Fraction of the stable time step that the solver uses."""
    outputs: Annotated[Whole, Field(ge=10, le=100_000)] = 500
    """Number of points in the force history."""
    filter_window: _FilterWindow = 0.010
    coarsening: Annotated[Number, Field(ge=1, le=10)] = 6.0
    """Ratio of the element length at the ends of the stem to the element length under the edge. In whole cuts between
    two supports, the elements from the edge to beyond the supports are equally long."""
    coarsening_around: Annotated[Number, Field(ge=1, le=10)] = 2.0
    """Ratio of the element width at the bottom of the cross-section to the element width under the edge."""
    replicates: Annotated[Whole, Field(ge=2, le=100)] | None = None
    """Number of simulations of each point, each with a different mesh position along the stem. Every interval
    includes the scatter of the responses. Without this key, each point is simulated once."""
    time_limit: Time | None = None
    """Time limit for one run, measured from the start of the run; by default, there is no limit."""
    threads: Annotated[Whole, Field(ge=1, le=256)] = 1
    """Number of threads per simulation. Use several threads for large models. The number of parallel runs is set with
    `--workers`."""

    @property
    def version(self) -> str:
        return __version__

    @property
    def run_limit(self) -> float | None:
        return self.time_limit

    @property
    def rate(self) -> str | None:
        return self.rate_law

    @property
    def mesh(self) -> ElementCounts | None:
        return ElementCounts(self.element_size, self.elements_through_wall)

    @property
    def has_lengths(self) -> bool:
        return True

    def without_curve(self) -> tuple[str, str] | None:
        return None

    def at_speed(self, speed: float) -> Self:
        """Return the options for a blade speed (mm/s): unchanged up to 100 mm/min, scaled above it.

        Inertia forces are proportional to ρV². So that their effect does not increase, the mass scaling decreases as
        V⁻²; from 0.17 m/s, a mass scaling of 1e4 is reduced to 1. The time step and the filter window decrease as V⁻¹,
        so that the blade travel during them is constant.
        """
        step = None if self.time_step is None else self.time_step * min(1.0, _SLOW / speed)
        return self.model_copy(update={**_at_speed(self, speed), "time_step": step})


def _at_speed(options: "EmbeddedSolver | DeckSolver", speed: float) -> dict[str, float]:
    slower = min(1.0, _SLOW / speed)
    return {"mass_scaling": max(1.0, options.mass_scaling * slower**2), "filter_window": options.filter_window * slower}


MOST_FILES = 100
# Time limit for reading a result, s. A regular expression may search for ever, and only ending its process stops it.
_READING_S = 10.0


Argument = Annotated[str, StringConstraints(strict=True, min_length=1)]
Command = Annotated[tuple[Argument, ...], Field(min_length=1, max_length=200)]
Variable = Annotated[str, StringConstraints(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)]
Environment = Annotated[dict[Variable, Annotated[str, StringConstraints(strict=True)]], Field(max_length=100)]
_TimeLimit = Annotated[
    float,
    Quantity("time", above=0),
    Field(description="Time limit for one run. If a run exceeds the limit, all its processes are terminated."),
]


class ProgramOptions(SolverOptions):
    """Keys of every program that replaces the embedded solver."""

    environment: Environment = {}
    """Additional environment variables, as a mapping from names to values. If a variable changes, all runs are
    repeated."""
    time_limit: _TimeLimit = 3600.0
    files: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Files that are copied to each run folder."""

    @property
    def run_limit(self) -> float | None:
        """Time limit of the whole run (s): the limit of the program, plus the time to end it and to read the result."""
        return 1.01 * self.time_limit + _READING_S

    @property
    def version(self) -> str:
        return self.environment.get("VERSION", "")


def _by_response(result: Any) -> Any:
    """Return the readers of `result` by the names of responses; a single reader reads the first response."""
    several = isinstance(result, dict) and all(isinstance(reader, dict | ResultReader) for reader in result.values())
    return result if several else {FIRST: result}


class CommandSolver(ProgramOptions):
    """Any program that reads text files and writes its result to a file.

    In `templates` and arguments of `command`, ``{{factor}}`` is replaced by the value of the factor in the unit of the
    spec, and ``{{diameter}}`` by the outer diameter in mm. The name of a declared condition is also a placeholder; for
    a stochastic program, so are ``{{seed}}`` and ``{{replicate}}``. Each run has a separate folder with the templates
    and `files`. The number that `result` reads is the response: the peak force in N, or a response declared under
    `responses`.
    """

    kind: Literal["command"] = "command"
    """Any program that reads text files and writes its result to a file."""
    command: Command
    """The program and its arguments, as a list. The command is not run in a shell."""
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Text files in which `{{factor}}` is replaced by the value of the factor and `{{diameter}}` by the diameter in mm.
    For a stochastic program, `{{seed}}` is an integer that differs between runs, and `{{replicate}}` is the number of
    the replicate."""
    result: Annotated[dict[str, ResultReader], Field(max_length=20), BeforeValidator(_by_response)] = {}
    """Result file, and how the response is read from this file. For several responses, write one reader under the name
    of each response."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """Number of simulations of each point with different seeds (`{{seed}}`), for a stochastic program. With `1`, each
    run of the design is simulated once, including repeated centre points. Without this key, the program must be
    deterministic: the first run is repeated as a check."""

    def without_curve(self) -> tuple[str, str] | None:
        reader = self.result.get(FIRST)
        has_travel = reader is not None and (reader.along is not None or "(?P<x>" in (reader.pattern or ""))
        if reader is not None and reader.reduction == "max" and has_travel:
            return None
        message = "curves can be fitted only if `result` reads a peak force and the travel in mm"
        return message, "add `along: TRAVEL` and `reduction: max` to `result`, or fit only the force"

    def sign_remedy(self, response: str) -> Remedy:
        """Return the remedy for a response with the wrong sign: scale by −1, and use the minimum, not the maximum."""
        name = response if response in self.result else FIRST
        if (reader := self.result.get(name)) is None:
            return super().sign_remedy(response)
        keys = ["reduction: min"] if reader.reduction == "max" else []
        keys.append(f"scale: {-reader.scale:g}")
        place = "solver.result" if name == FIRST else f"solver.result.{name}"
        inner = f"{{{', '.join(keys)}}}"
        edit = f"solver: {{result: {inner if name == FIRST else f'{{{name}: {inner}}}'}}}"
        return Remedy(f"Write {' and '.join(f'`{key}`' for key in keys)} in `{place}`.", edit)


class DeckSolver(ProgramOptions):
    """LS-DYNA or OpenRadioss, run on a keyword deck of the shear test that stemcal writes.

    The response is the peak of the filtered contact force on the blade.

    LS-DYNA is started with `command`; in its arguments, ``{{deck}}`` is replaced by the file name of the deck.
    OpenRadioss is started from the folder `home` or from the folder in the environment variable ``OPENRADIOSS_PATH``.
    """

    kind: Literal["deck"] = "deck"
    """A program that runs a keyword deck of the shear test."""
    program: Literal["lsdyna", "openradioss"]
    """The program that runs the deck."""
    time_limit: _TimeLimit = 86400.0
    filter_window: _FilterWindow = 0.010
    rate_law: Literal["paper", "cowper_symonds", "none"] | None = None
    """Rate law of the yield stress: `paper` is 1 + (rate/C)^P as printed in the wild chrysanthemum study,
    `cowper_symonds` is 1 + (rate/C)^(1/P), and `none` omits the rate effect. The default is `cowper_symonds` for
    LS-DYNA and `paper` for OpenRadioss."""
    nonlocal_failure: Flag = False
    """Whether the deck represents the characteristic lengths of the study: `material.internal_length` by nonlocal
    failure, and `blade.edge_spread` by a rounded edge. With `false`, failure is local and the edge is sharp, so
    calibrated values are valid only for this mesh."""
    element_size: StemLength = Length(1.0)
    """Length of the elements under the blade edge: a length, or a fraction of the diameter."""
    elements_through_wall: _ThroughWall = None
    mass_scaling: _MassScaling = 1e4
    command: Annotated[tuple[Argument, ...], Field(max_length=200)] = ()
    """Command that starts LS-DYNA: the program and its arguments, as a list. `{{deck}}` is replaced by the file name of
    the deck."""
    home: Argument | None = None
    """Installation folder of OpenRadioss with `exec`, `extlib` and `hm_cfg_files`. The default is the folder in the
    environment variable `OPENRADIOSS_PATH`."""

    @property
    def time_step_safety(self) -> float:
        """Fraction of the stable time step that is used."""
        return 0.8 if self.program == "lsdyna" else 0.9

    @property
    def outputs(self) -> int:
        """Number of points in the force history."""
        return 500

    def at_speed(self, speed: float) -> Self:
        """Return the options for a blade speed (mm/s): mass scaling and filter window as in `EmbeddedSolver`."""
        return self.model_copy(update=_at_speed(self, speed))

    @property
    def law(self) -> str:
        """The rate law of the spec, or the default of the program."""
        return self.rate_law or ("cowper_symonds" if self.program == "lsdyna" else "paper")

    @property
    def title(self) -> str:
        return "LS-DYNA" if self.program == "lsdyna" else "OpenRadioss"

    @property
    def program_name(self) -> str:
        return self.program

    @property
    def rate(self) -> str | None:
        return self.law

    @property
    def mesh(self) -> ElementCounts | None:
        return ElementCounts(self.element_size, self.elements_through_wall)

    @property
    def has_lengths(self) -> bool:
        return self.nonlocal_failure

    def without_curve(self) -> tuple[str, str] | None:
        return None

    def chance_remedy(self) -> Remedy:
        if self.program == "lsdyna":
            how = "use a negative number of processors (ncpu=-4) in the command"
        else:
            how = "use /PARITH/ON in the starter deck"
        return Remedy(f"Fix the order of summation: {how}")


class PythonSolver(SolverOptions):
    """A class in a Python file next to the spec, with a method `solve(levels, condition)`.

    `levels` contains the values of the factors by name, in the units of the spec. `condition` is the diameter of the
    stem in mm, or the value of the declared condition. `solve` returns the responses by name, such as
    `{"force": 12.5}`; an exception is recorded as a failed run. Each process creates one object, without arguments.
    The class can import modules from the folders of the file and of the spec. Data files are listed under `files`.
    """

    kind: Literal["python"] = "python"
    """A class in a Python file."""
    file: SpecFile
    """Path of the Python file. If the file changes, or a module that it imports from the folder of the spec, all runs
    are repeated."""
    class_: Annotated[str, StringConstraints(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)] = Field(
        validation_alias="class", serialization_alias="class"
    )
    """Name of the class in the Python file."""
    files: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Data files that the class reads. If a file changes, all runs are repeated."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """Number of simulations of each point with different seeds, for a stochastic class. `solve(levels, condition,
    seed)` receives the seed as its third argument. Without this key, the class must be deterministic."""
    time_limit: _TimeLimit = 3600.0

    @property
    def run_limit(self) -> float | None:
        return self.time_limit

    def chance_remedy(self) -> Remedy:
        text = (
            "Write `replicates: 5` under `solver`, and use the seed in `solve(levels, condition, seed)`; each point is "
            "then simulated five times"
        )
        return Remedy(text, "solver: {replicates: 5}")
