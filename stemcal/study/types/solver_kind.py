"""Kinds of solvers: what each can do, the keys that a spec gives it, and what makes it.

Code asks a kind, or its options, what it can do; none asks for a class or for a name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Protocol

from stemcal.note import Remedy
from stemcal.registry import OneOf, Registry
from stemcal.study.types.factor import Parameter
from stemcal.study.types.field_types import Frozen, Length

Answers = Literal["computes", "looks_up", "asks_people"]


class Mesh(NamedTuple):
    """The elements of the stem: their length under the edge, and how many there are through the wall."""

    element_size: Length
    through_wall: int | None


class Explicit(Protocol):
    """What decides the time step of an explicit solver."""

    element_size: Length
    mass_scaling: float
    time_step: float | None
    time_step_safety: float


class SolverOptions(Frozen):
    """The keys of a spec's solver; a subclass adds its own and defines what follows from them."""

    kind: str

    @property
    def title(self) -> str:
        """What messages call the solver."""
        return self.kind

    @property
    def program_name(self) -> str:
        """The program that answers: that of a deck, else the kind."""
        return self.kind

    @property
    def version(self) -> str:
        """Its version, as far as the spec has it."""
        return ""

    @property
    def repeats(self) -> int:
        """How often it is asked for the same levels; 0 where it answers the same every time."""
        return getattr(self, "replicates", None) or 0

    @property
    def run_limit(self) -> float | None:
        """How long a run may take, s, where the executor has to end it."""
        return None

    @property
    def rate(self) -> str | None:
        """The law by which speed raises the yield stress, None where that is not the spec's matter."""
        return None

    @property
    def mesh(self) -> Mesh | None:
        """The mesh of the stem, None if the spec does not have it."""
        return None

    @property
    def has_lengths(self) -> bool:
        """Whether its force depends on the lengths over which failure and contact are averaged."""
        return False

    @property
    def explicit(self) -> Explicit | None:
        """What decides its time step, where advice may change that."""
        return None

    def without_curve(self) -> tuple[str, str] | None:
        """Return why a run has no force over travel and what to do, None if it has."""
        return f"solver {self.title} has no curve to compare", "give only the force"

    def chance_remedy(self) -> Remedy:
        """Return how to declare, or remove, the chance in its answers."""
        text = (
            "Write replicates: 5 under solver, to simulate each point five times and include its scatter, and "
            "{{seed}} where the program takes one"
        )
        return Remedy(text, "solver: {replicates: 5}")


class SolverKind:
    """One kind of solver. A subclass gives `name`, `options` and `make`, and declares what it can do."""

    name: ClassVar[str]
    options: ClassVar[type[SolverOptions]]
    """The keys that a spec gives it."""
    answers: ClassVar[Answers] = "computes"
    """Whether it computes, looks answers up, or people do the runs."""
    of_spec_alone: ClassVar[bool] = False
    """Whether nothing determines its answers but the spec and stemcal's own code."""
    starts_program: ClassVar[bool] = False
    """Whether a program has to be there that the spec names."""
    foresees: ClassVar[bool] = False
    """Whether it estimates the time and memory of a run."""
    force_history: ClassVar[bool] = False
    """Whether a single run gives the whole history of the force, for `simulate`."""
    travel_and_work: ClassVar[bool] = False
    """Whether it answers a cut with travel and work to the maximum, too."""
    writes_decks: ClassVar[bool] = False
    """Whether a study is calibrated in a program on decks that stemcal writes."""
    own_responses: ClassVar[bool] = True
    """Whether a study may declare responses and conditions, rather than the force on a stem."""
    replicates: ClassVar[Literal["mesh", "seed"] | None] = None
    """In what replicates of a run differ."""
    any_element_size: ClassVar[bool] = False
    """Whether a request may ask for elements of another size."""
    simulates_tests: ClassVar[bool] = False
    """Whether it simulates laboratory tests besides cutting."""
    parameters: ClassVar[Mapping[str, Parameter]] = {}
    """The parameters that factors can be; none where they may have any name."""
    rules: ClassVar[tuple[Callable[[Any, Any], Iterator[Any]], ...]] = ()
    """What must hold for its keys: functions of a draft and its options that yield findings."""

    def make(self, study: Any) -> Any:
        """Return the solver of a study, a `solvers.protocol.Solver`."""
        raise NotImplementedError

    def doubts(self, _study: Any) -> Iterator[Any]:
        """Yield findings on what is possible but looks like a slip."""
        yield from ()

    def ready(self) -> Iterator[tuple[str, str, bool | None]]:
        """Yield the lines for `doctor`: a part, its state, whether it is fine (None: not needed)."""
        yield from ()


SOLVERS: Registry[SolverKind] = Registry(
    SolverKind,
    "stemcal.solvers",
    tuple(f"stemcal.solvers.kinds:{name}" for name in ("Embedded", "Command", "Sheet", "Deck", "Python")),
)


def kind_of(options: SolverOptions) -> SolverKind:
    """Return the kind of a spec's solver."""
    found = SOLVERS.named(options.kind)
    assert found is not None, options.kind
    return found


AnySolver = Annotated[SolverOptions, OneOf(SOLVERS)]


def usual_solver() -> SolverOptions:
    """Return the solver of a spec that names none."""
    return SOLVERS.built_in[0].options(kind=SOLVERS.built_in[0].name)
