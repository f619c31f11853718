"""What answers "these levels, this diameter, which force?"."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.errors import UsageError

if TYPE_CHECKING:
    from stemcal.solvers.protocol import Solver
    from stemcal.study.model import Study


def _embedded(study: Study) -> Solver:
    from stemcal.solvers.embedded import Embedded

    return Embedded(study)


def _table(study: Study) -> Solver:
    from stemcal.solvers.table import ReplaySolver

    return ReplaySolver(study)


def _command(study: Study) -> Solver:
    from stemcal.solvers.command import Command

    return Command(study)


def _manual(study: Study) -> Solver:
    from stemcal.solvers.manual import Manual

    return Manual.of(study)


def _lsdyna(study: Study) -> Solver:
    from stemcal.solvers.lsdyna import LsDyna

    return LsDyna(study)


def _openradioss(study: Study) -> Solver:
    from stemcal.solvers.openradioss import OpenRadioss

    return OpenRadioss(study)


SOLVERS: dict[str, Callable[[Study], Solver]] = {
    "embedded": _embedded,
    "table": _table,
    "command": _command,
    "manual": _manual,
    "lsdyna": _lsdyna,
    "openradioss": _openradioss,
}


def make_solver(study: Study) -> Solver:
    """Return the solver that the spec names."""
    kind = study.solver.kind
    if kind not in SOLVERS:
        raise UsageError(f"solver.kind {kind!r} is unknown; choose one of {', '.join(SOLVERS)}")
    return SOLVERS[kind](study)
