"""What answers "these levels, this diameter, which force?"."""

from __future__ import annotations

from collections.abc import Callable
from pkgutil import resolve_name
from typing import TYPE_CHECKING

from stemcal.errors import UsageError

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model import Study


def _of(place: str) -> Callable[[Study], Solver]:
    """Return what makes a solver for a study; its module is imported when the first is made."""
    return lambda study: resolve_name(f"stemcal.solvers.{place}")(study)


SOLVERS: dict[str, Callable[[Study], Solver]] = {
    "embedded": _of("embedded:Embedded"),
    "command": _of("command:Command"),
    "sheet": _of("sheet.solver:Sheet.of"),
    "deck": _of("deck.program:DeckProgram"),
}


def make_solver(study: Study) -> Solver:
    """Return the solver that the spec names."""
    kind = study.solver.kind
    if kind not in SOLVERS:
        raise UsageError(f"solver.kind {kind!r} is unknown; choose one of {', '.join(SOLVERS)}")
    return SOLVERS[kind](study)
