"""Kinds of solvers: their keys in a spec, constructors and capabilities."""

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from stemcal.notes import Remedy
from stemcal.registry import Registry
from stemcal.study.types.factor import Parameter
from stemcal.study.types.field_types import Frozen, Length, OneOf, field_or_none

Answers = Literal["computes", "looks_up", "asks_people"]


class ElementCounts(NamedTuple):
    """Mesh of the stem: length of the elements under the edge, and number of elements through the wall."""

    element_size: Length
    through_wall: int | None


class SolverOptions(Frozen):
    """The keys of `solver`; a subclass adds its own keys and defines the properties below."""

    kind: str

    @property
    def title(self) -> str:
        """Name of the solver in messages."""
        return self.kind

    @property
    def program_name(self) -> str:
        """Name of the program that computes the answers: the external program for decks, otherwise the solver kind."""
        return self.kind

    @property
    def version(self) -> str:
        """Version of the program if the spec has it, otherwise empty."""
        return ""

    @property
    def repeats(self) -> int:
        """Number of simulations at the same levels of the factors; 0 for a deterministic solver."""
        return field_or_none(self, "replicates") or 0

    @property
    def run_limit(self) -> float | None:
        """Time limit of a run that the executor must enforce, s."""
        return None

    @property
    def rate(self) -> str | None:
        """Law by which the strain rate increases the yield stress; None if the spec does not set a law."""
        return None

    @property
    def mesh(self) -> ElementCounts | None:
        """Mesh of the stem; None if the spec does not define it."""
        return None

    @property
    def has_lengths(self) -> bool:
        """Whether the force depends on the internal length and the edge spread of the spec."""
        return False

    def without_curve(self) -> tuple[str, str] | None:
        """Return (reason, remedy) if runs have no force–travel curve; None if they have one."""
        return f"the {self.title} solver returns no force–travel curve to compare with `curves`", "fit only the force"

    def sign_remedy(self, _response: str) -> Remedy:
        """Return the remedy for a response whose sign is wrong."""
        return Remedy("Reverse the sign of the values that the solver returns, then run the study again.")

    def chance_remedy(self) -> Remedy:
        """Return the remedy if equal simulations have different results: to declare replicates."""
        text = (
            "Write `replicates: 5` under `solver`, and write `{{seed}}` where the program expects a seed; each point "
            "is then simulated five times"
        )
        return Remedy(text, "solver: {replicates: 5}")


class SolverKind:
    """One kind of solver. A subclass defines `name`, `options` and `make`, and declares its capabilities."""

    name: ClassVar[str]
    options: ClassVar[type[SolverOptions]]
    """Model of the solver keys in a spec."""
    answers: ClassVar[Answers] = "computes"
    """Whether the solver computes answers, looks them up, or asks people to perform the runs."""
    of_spec_alone: ClassVar[bool] = False
    """Whether the answers depend only on the spec and on the stemcal code."""
    starts_program: ClassVar[bool] = False
    """Whether the solver requires a program that the spec names."""
    simulates_stems: ClassVar[bool] = False
    """Whether the solver itself simulates stems: cuts and other laboratory tests, elements of any size, the force over
    time, with an estimate of time and memory."""
    gives_curve: ClassVar[bool] = False
    """Whether runs give the responses of the cutting test next to the force, such as travel and work: the details of an
    answer contain `curve` and `peak_travel`, or numbers by the names of the responses."""
    has_layers: ClassVar[bool] = False
    """Whether the solver simulates stems with layers and fibres."""
    writes_decks: ClassVar[bool] = False
    """Whether the solver runs a program on decks that stemcal writes."""
    own_responses: ClassVar[bool] = True
    """Whether a study may declare responses and conditions instead of the force on a stem."""
    replicates: ClassVar[Literal["mesh", "seed"] | None] = None
    """The difference between replicates of a run."""
    parameters: ClassVar[Mapping[str, Parameter]] = {}
    """The parameters that can be factors; empty if factors may have any name."""
    rules: ClassVar[tuple[Callable[[Any, Any], Iterator[Any]], ...]] = ()
    """Rules for the solver keys: functions of a draft and the solver options that yield findings."""

    def make(self, study: Any) -> Any:
        """Return the solver of a study, an object of a subclass of `solvers.protocol.Solver`."""
        raise NotImplementedError

    def ready(self) -> Iterator[tuple[str, str, bool | None]]:
        """Yield the lines for `doctor`: a component, its state, and whether it works (None: not required)."""
        yield from ()


SOLVERS: Registry[SolverKind] = Registry(
    SolverKind,
    "stemcal.solvers",
    (
        *("stemcal.solvers.kinds:EmbeddedKind", "stemcal.solvers.kinds:CommandKind", "stemcal.by_hand.kind:SheetKind"),
        *("stemcal.solvers.kinds:DeckKind", "stemcal.solvers.kinds:PythonKind"),
    ),
)


def kind_of(options: SolverOptions) -> SolverKind:
    """Return the kind of solver to which the keys in a spec apply."""
    kind = SOLVERS.named(options.kind)
    assert kind is not None, options.kind
    return kind


AnySolver = Annotated[SolverOptions, OneOf(SOLVERS, "solver", first_is_usual=True)]


def usual_solver() -> SolverOptions:
    """Return the default solver of a spec."""
    return SOLVERS.built_in[0].options(kind=SOLVERS.built_in[0].name)
