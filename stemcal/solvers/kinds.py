"""The kinds of solvers that come with stemcal: what each can do. Their modules are imported when they are used."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from stemcal.study.model.factor import EMBEDDED, PARAMETERS, Parameter
from stemcal.study.model.solver_kind import SolverKind, SolverOptions

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model import Study


class Embedded(SolverKind):
    """The explicit finite element solver that comes with stemcal."""

    name = "embedded"
    of_spec_alone = foresees = force_history = travel_and_work = any_element_size = True
    own_responses = False
    replicates = "mesh"
    tests = frozenset({"cutting", "three-point-bending", "radial-compression", "axial-compression", "axial-tension"})

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The nine of the material, friction and wall."""
        return EMBEDDED

    def options(self) -> type[SolverOptions]:
        """Return its keys."""
        from stemcal.solvers.options import EmbeddedSolver

        return EmbeddedSolver

    def make(self, study: Study) -> Solver:
        """Return the solver of a study."""
        from stemcal.solvers.embedded import Embedded

        return Embedded(study)

    def rules(self) -> tuple[Any, ...]:
        """Return that its elements fit the stem."""
        from stemcal.solvers import rules

        return (rules.elements_fit_stem,)


class Command(SolverKind):
    """Any program that reads text files and leaves its result in one."""

    name = "command"
    starts_program = True
    replicates = "seed"

    def options(self) -> type[SolverOptions]:
        """Return its keys."""
        from stemcal.solvers.options import CommandSolver

        return CommandSolver

    def make(self, study: Study) -> Solver:
        """Return the solver of a study."""
        from stemcal.solvers.command import Command

        return Command(study)

    def rules(self) -> tuple[Any, ...]:
        """Return what its templates, arguments and readers must be."""
        from stemcal.solvers import rules

        return (
            rules.placeholders_are_known,
            rules.placeholders_are_used,
            rules.chance_is_said,
            rules.run_files_differ,
            rules.every_response_is_read,
        )

    def doubts(self, study: Study) -> Iterator[Any]:
        """Yield arguments that are files beside the spec."""
        from stemcal.solvers.rules import files_are_given

        yield from files_are_given(study)


class Sheet(SolverKind):
    """A sheet of runs that people do."""

    name = "sheet"
    answers = "asks_people"
    replicates = "seed"

    def options(self) -> type[SolverOptions]:
        """Return its keys."""
        from stemcal.solvers.options import SheetSolver

        return SheetSolver

    def make(self, study: Study) -> Solver:
        """Return the solver of a study."""
        from stemcal.solvers.sheet.solver import Sheet

        return Sheet.of(study)

    def rules(self) -> tuple[Any, ...]:
        """Return what its templates must be."""
        from stemcal.solvers import rules

        return rules.placeholders_are_known, rules.chance_is_said, rules.run_files_differ


class Deck(SolverKind):
    """LS-DYNA or OpenRadioss on a deck of the shear test."""

    name = "deck"
    starts_program = True
    own_responses = False

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The nine of the material."""
        return PARAMETERS

    def options(self) -> type[SolverOptions]:
        """Return its keys."""
        from stemcal.solvers.options import DeckSolver

        return DeckSolver

    def make(self, study: Study) -> Solver:
        """Return the solver of a study."""
        from stemcal.solvers.deck.program import DeckProgram

        return DeckProgram(study)

    def rules(self) -> tuple[Any, ...]:
        """Return what the keys of the program must be."""
        from stemcal.solvers import rules

        return rules.command_names_deck, rules.keys_belong_to_the_program, rules.openradioss_hardens_isotropically


class Python(SolverKind):
    """A class in a Python file beside the spec."""

    name = "python"
    starts_program = True

    def options(self) -> type[SolverOptions]:
        """Return its keys."""
        from stemcal.solvers.options import PythonSolver

        return PythonSolver

    def make(self, study: Study) -> Solver:
        """Return the solver of a study."""
        from stemcal.solvers.python import PythonClass

        return PythonClass.of(study)
