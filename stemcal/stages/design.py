"""A design: which factors vary, over which levels, coded how; its runs before and after they are answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stemcal.doe.coding import Array, Coding
from stemcal.errors import UsageError
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.solvers.protocol import Request
from stemcal.stages.result import DesignRun, DesignRuns
from stemcal.storage.rows import Rows
from stemcal.study.model.study import Study

_LEVEL_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Design:
    """The runs of a stage: `coded` is (n, k) over the factors of `coding`, `levels` holds every factor.

    Of a program with chance in it they are the design `replicates` times over. `order` is that of the model that they
    are fitted with: 1 for main effects, 2 for a quadratic surface. `conditions` are those of the rows, where the
    condition is the last of the factors that vary; `held` are factors at their centre.
    """

    stage: str
    kind: str
    coding: Coding
    coded: Array
    levels: tuple[Mapping[str, float], ...]
    replicates: int = 0
    order: int = 2
    conditions: tuple[float, ...] = ()
    held: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The factors that vary."""
        return self.coding.names

    def requests(self, condition: float) -> list[Request]:
        """Return a request per row."""
        times, conditions = self.replicates, self.conditions or (condition,) * len(self.levels)
        return [
            # replicates are numbered from 1, those of a deterministic program 0
            Request(self.stage, row, levels, at, replicate=times and 1 + row * times // len(self.levels))
            for row, (levels, at) in enumerate(zip(self.levels, conditions, strict=True))
        ]

    def repeated(self, times: int) -> Design:
        """Return the design with its replicates as rows; the design itself for 0."""
        coded = np.tile(self.coded, (times or 1, 1))
        levels, conditions = self.levels * (times or 1), self.conditions * (times or 1)
        return replace(self, coded=coded, levels=levels, replicates=times, conditions=conditions)


@dataclass(frozen=True)
class Asked:
    """What a stage asks of the solver; not `settled` as long as a stage before it has to decide."""

    stage: str
    requests: Sequence[Request]
    settled: bool
    note: Note | None = None
    design: Design | None = None


@dataclass(frozen=True)
class Later:
    """The runs that a stage usually decides on one by one, as rounds of runs at a time, and how many there may be."""

    rounds: Sequence[Sequence[Request]]
    note: Note


def runs_of(design: Design, requests: Sequence[Request], outcomes: Sequence[Outcome]) -> DesignRuns:
    """Return a design with its runs, numbered from 1."""
    runs = [
        DesignRun(
            run=request.row + 1,
            levels=dict(request.levels),
            coded={**dict.fromkeys(design.held, 0.0), **dict(zip(design.names, coded, strict=True))},
            condition=request.condition if design.conditions else None,
            replicate=request.replicate or None,
            outcome=outcome,
        )
        for request, outcome, coded in zip(requests, outcomes, design.coded.tolist(), strict=True)
    ]
    return DesignRuns(design.kind, Rows(runs))


def given_design(
    stage: str, study: Study, coding: Coding, given: Sequence[Mapping[str, float]], order: int = 2
) -> Design:
    """Return a solver's rows, coded; `UsageError` if a factor is missing or, of order 1, a level is between."""
    missing = [name for name in coding.names if name not in given[0]]
    if missing:
        raise UsageError(
            f"rsm.factors: the solver table has no columns for {', '.join(missing)}. List only factors that "
            "are columns of the table."
        )
    coded = coding.to_coded([[row[name] for name in coding.names] for row in given])
    if order == 1:
        centre = np.all(abs(coded) <= _LEVEL_TOLERANCE, axis=1)[:, None]
        for row, column in np.argwhere(~centre & (abs(abs(coded) - 1.0) > _LEVEL_TOLERANCE)).tolist():
            name = coding.names[column]
            raise UsageError(
                f"solver.screen row {row + 1}: the value {given[row][name]:g} is not a level of the factor {name}. "
                f"Set `low` and `high` of {name} to its two levels in the table."
            )
        coded = coded.round()
    levels = tuple({**study.midlevels(), **row} for row in given)
    return Design(stage, "given", coding, coded, levels, order=order)
