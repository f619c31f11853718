"""Programs outside stemcal as a spec describes them: any command, LS-DYNA and OpenRadioss."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, StringConstraints
from pydantic_core import PydanticCustomError

from stemcal.naming import FIRST
from stemcal.study.model import solver_options
from stemcal.study.model.frozen import Flag, Frozen
from stemcal.study.model.result_readers import ResultReader
from stemcal.study.types.field_types import Number, Quantity, SpecFile, Whole, complain
from stemcal.study.types.lengths import Length, StemLength

MOST_FILES = 100


def _argument(given: object) -> object:
    if isinstance(given, str) and ("\0" in given or len(given) > 4000):
        raise complain("is not usable as an argument", "shorten it")
    return given


Argument = Annotated[str, StringConstraints(strict=True, min_length=1), BeforeValidator(_argument)]
Command = Annotated[tuple[Argument, ...], Field(min_length=1, max_length=200)]
Variable = Annotated[str, StringConstraints(strict=True, pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", max_length=100)]
Value = Annotated[str, StringConstraints(strict=True), BeforeValidator(_argument)]
Environment = Annotated[dict[Variable, Value], Field(max_length=100)]
TimeLimit = Annotated[
    float,
    Quantity("time", above=0),
    Field(description="How long a run may take before it is ended with all its processes."),
]


def _diameters(given: dict[str, Path]) -> dict[str, Path]:
    for text in given:
        try:
            Quantity("length", above=0).checked(text, from_yaml=True)
        except PydanticCustomError as error:
            raise complain(f"{text[:60]!r} is no diameter: {error.message()}", "write 8 mm: own.k") from None
    return given


class ProgramOptions(Frozen):
    """What is said of every program that answers in place of the embedded solver."""

    environment: Environment = {}
    """Further variables of the environment, by name. They are inputs: another `VERSION: …` computes all runs anew."""
    time_limit: TimeLimit = 3600.0
    files: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Files put beside each run under their own names."""


class CommandSolver(ProgramOptions):
    """Any program that reads text files and leaves its result in one.

    In `templates` and in the arguments of `command`, ``{{factor}}`` stands for the factor's value in the unit of
    the spec and ``{{diameter}}`` for the stem's outer diameter in mm, or the condition that the spec declares in its
    place by its name; nothing else is replaced but, in a program with chance in it, ``{{seed}}`` and ``{{replicate}}``.
    Each run has a folder of its own, in which templates and `files` lie under their own names. The number that `result`
    reads is the response: the maximum force in N, or what the spec declares under ``responses``.
    ``targets`` hold the values it is calibrated to.
    """

    kind: Literal["command"] = "command"
    """Any program that reads text and leaves a number."""
    command: Command
    """The program and its arguments, as a list; it never passes through a shell."""
    templates: Annotated[tuple[SpecFile, ...], Field(max_length=MOST_FILES)] = ()
    """Text files in which `{{factor}}` stands for a factor's value, `{{diameter}}` for the stem's in mm; in a
    program with chance in it `{{seed}}` for a whole number, another one in every run, and `{{replicate}}`."""
    result: ResultReader | None = None
    """Where the program leaves its number; of several responses a mapping of such readers by their names."""
    results: Annotated[dict[str, ResultReader], Field(max_length=20)] = {}
    """The same by the names of the responses."""
    replicates: Annotated[Whole, Field(ge=1, le=100)] | None = None
    """Simulations of each point, each with another `{{seed}}`, for a program whose equal inputs give different answers;
    `1` simulates each run of the design once, repeated centre points too. Without the key the program must give equal
    answers: its first run is repeated at the start to check this."""

    @property
    def readers(self) -> dict[str, ResultReader]:
        """How each response is read; the one of a single reader is called `FIRST`."""
        return dict(self.results) if self.result is None else {FIRST: self.result}

    @property
    def by_chance(self) -> bool:
        """Whether equal inputs may give different answers."""
        return self.replicates is not None


class DeckSolver(ProgramOptions):
    """LS-DYNA or OpenRadioss, run on a keyword deck of the shear test that stemcal writes.

    The force is that of contact `interface`, times `scale` (4 for a quarter model), filtered, and its peak found like
    that of the embedded solver.

    LS-DYNA is started by `command`, in whose arguments ``{{deck}}`` stands for the file name of the deck. It can also
    run your own `decks` with the stem's MAT_003 replaced. OpenRadioss needs starter, engine and ``th_to_csv``: those
    of `programs`, else those of the installation in its `home` or in the environment variable
    ``OPENRADIOSS_PATH``, else those on PATH.
    """

    kind: Literal["deck"] = "deck"
    """A program that runs a keyword deck of the shear test."""
    program: Literal["lsdyna", "openradioss"]
    """The program that runs the deck."""
    time_limit: TimeLimit = 86400.0
    interface: Annotated[Whole, Field(ge=1)] = 1
    """Number of the contact whose force is read."""
    scale: Number = 1.0
    """The force is multiplied by it: 4 for a quarter model."""
    filter_window: solver_options.FilterWindow = 0.010
    rate_law: Literal["paper", "cowper_symonds", "none"] | None = None
    """How speed raises the yield stress: `paper` 1 + (rate/C)^P as printed in the wild chrysanthemum study,
    `cowper_symonds` 1 + (rate/C)^(1/P), `none` not at all. By default `cowper_symonds` for LS-DYNA, `paper` for
    OpenRadioss."""
    nonlocal_failure: Flag = False
    """Whether the deck that stemcal writes carries the lengths of the study: failure by a nonlocal strain over an
    equivalent of `material.internal_length`, and a nose of radius `blade.edge_spread`. `false`: elements fail by their
    own strain and the edge is sharp, so that what is calibrated belongs to this mesh."""
    element_size: StemLength = Length(1.0)
    """Length of the elements under the edge of the deck that stemcal writes: a length, or a share of the diameter."""
    elements_through_wall: solver_options.ThroughWall = None
    mass_scaling: solver_options.MassScaling = 1e4
    command: Annotated[tuple[Argument, ...], Field(max_length=200)] = ()
    """LS-DYNA: the program and its arguments, as a list; `{{deck}}` stands for the deck."""
    decks: Annotated[dict[str, SpecFile], Field(max_length=MOST_FILES), AfterValidator(_diameters)] = {}
    """LS-DYNA: your own decks by the diameter of the stem, as in `8 mm: own.k`; without them stemcal writes one."""
    component: Literal["x", "y", "z"] = "z"
    """LS-DYNA: direction of the force."""
    programs: dict[Literal["home", "starter", "engine", "th_to_csv"], Argument] = {}
    """OpenRadioss: `home`, the folder of the installation with `exec` and `hm_cfg_files` in it, by default what the
    environment variable `OPENRADIOSS_PATH` names; names or paths of `starter`, `engine` and `th_to_csv` where `home`
    has none of the usual name."""

    def own_decks(self) -> dict[float, Path]:
        """Return the user's own decks by the diameter of the stem, mm."""
        diameter = Quantity("length", above=0)
        return {diameter.checked(text, from_yaml=True): path for text, path in self.decks.items()}

    @property
    def time_step_safety(self) -> float:
        """Share of the stable time step that is taken."""
        return 0.8 if self.program == "lsdyna" else 0.9

    @property
    def outputs(self) -> int:
        """Points of the force history."""
        return 500

    @property
    def law(self) -> str:
        """The rate law, chosen or by default."""
        return self.rate_law or ("cowper_symonds" if self.program == "lsdyna" else "paper")


OF_LSDYNA = ("command", "decks", "component")
OF_OPENRADIOSS = ("programs",)


def program_of(solver: object) -> str:
    """Return the program that answers: that of a deck, else the kind of the solver."""
    return solver.program if isinstance(solver, DeckSolver) else str(getattr(solver, "kind", ""))
