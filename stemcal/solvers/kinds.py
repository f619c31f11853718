"""The built-in kinds of solvers and their capabilities. The solvers themselves are imported when they are created."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.errors import UsageError
from stemcal.solvers import rules
from stemcal.solvers.options import CommandSolver, DeckSolver, EmbeddedSolver, PythonSolver
from stemcal.study.types.factor import EMBEDDED, IN_DECKS
from stemcal.study.types.solver_kind import SolverKind

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model.study import Study


class EmbeddedKind(SolverKind):
    """The explicit finite element solver that comes with stemcal."""

    name, options = "embedded", EmbeddedSolver
    of_spec_alone = simulates_stems = gives_curve = has_layers = True
    own_responses = False
    replicates = "mesh"
    parameters = EMBEDDED
    rules = rules.OF_EMBEDDED

    def make(self, study: Study) -> Solver:
        from stemcal.solvers.embedded import Embedded

        return Embedded(study)


class CommandKind(SolverKind):
    """Any program that reads text files and writes its result to a file."""

    name, options = "command", CommandSolver
    starts_program = True
    replicates = "seed"
    rules = rules.OF_COMMAND

    def make(self, study: Study) -> Solver:
        from stemcal.solvers.program import Command

        return Command(study)


class DeckKind(SolverKind):
    """LS-DYNA or OpenRadioss on a deck of the shear test."""

    name, options = "deck", DeckSolver
    starts_program = writes_decks = gives_curve = True
    own_responses = False
    parameters = IN_DECKS
    rules = rules.OF_DECK

    def make(self, study: Study) -> Solver:
        from stemcal.solvers.deck import DeckProgram

        return DeckProgram(study)

    def ready(self) -> Iterator[tuple[str, str, bool | None]]:
        from stemcal.solvers.deck.openradioss import HOME, installation

        try:
            yield "OpenRadioss", installation(DeckSolver(program="openradioss"), Path.cwd()).starter, True
        except UsageError as error:
            missing = f"not found: {HOME} is not set (required only for `solver: {{kind: deck, program: openradioss}}`)"
            yield ("OpenRadioss", str(error), False) if HOME in os.environ else ("OpenRadioss", missing, None)


class PythonKind(SolverKind):
    """A class in a Python file next to the spec."""

    name, options = "python", PythonSolver
    starts_program = True
    replicates = "seed"

    def make(self, study: Study) -> Solver:
        from stemcal.solvers.python import PythonClass

        return PythonClass.of(study)
