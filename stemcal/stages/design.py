"""Experimental designs: coded points, levels of all factors, requests for the runs, and finished runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.coding import Coding
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
    """The n runs of a stage: `coded` (n, k) has the varied factors of `coding`, `levels` the values of all factors.

    For a stochastic program the rows are the design repeated `replicates` times. `order` is the order of the model that
    is fitted to the runs: 1 for main effects, 2 for a quadratic surface. `conditions` are the conditions of the rows if
    the condition is the last column of `coded`; `held` are factors that stay at their centre.
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
        """Names of the factors that vary."""
        return self.coding.names

    def requests(self, condition: float) -> list[Request]:
        times, conditions = self.replicates, self.conditions or (condition,) * len(self.levels)
        return [
            # replicates are numbered from 1; without replicates the number is 0
            Request(self.stage, row, levels, at, replicate=times and 1 + row * times // len(self.levels))
            for row, (levels, at) in enumerate(zip(self.levels, conditions, strict=True))
        ]

    def repeated(self, times: int) -> Design:
        """Return the design repeated `times` times, in further rows; the design itself for 0."""
        coded = np.tile(self.coded, (times or 1, 1))
        levels, conditions = self.levels * (times or 1), self.conditions * (times or 1)
        return replace(self, coded=coded, levels=levels, replicates=times, conditions=conditions)


@dataclass(frozen=True)
class StageRuns:
    """The runs that a stage requires; not `settled` while they depend on an earlier stage that is not finished."""

    stage: str
    requests: Sequence[Request]
    settled: bool
    note: Note | None = None
    design: Design | None = None
    in_materials: Sequence[Sequence[Request]] = ()
    """Further runs in each of the other materials of the study."""


@dataclass(frozen=True)
class AdaptiveRuns:
    """The usual rounds of runs of a stage that chooses its runs one by one, and a note on their largest number."""

    rounds: Sequence[Sequence[Request]]
    note: Note


def runs_of(design: Design, requests: Sequence[Request], outcomes: Sequence[Outcome]) -> DesignRuns:
    """Return the finished runs of a design, numbered from 1."""
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
    stage: str, study: Study, coding: Coding, table: Sequence[Mapping[str, float]], order: int = 2
) -> Design:
    """Return the design in a solver's table, which must have every factor and, for `order` 1, coded levels 0 and ±1."""
    missing = [name for name in coding.names if name not in table[0]]
    if missing:
        raise UsageError(
            f"rsm.factors: the solver table has no columns for {', '.join(missing)}. List only factors that "
            "are columns of the table."
        )
    coded = coding.to_coded([[row[name] for name in coding.names] for row in table])
    if order == 1:
        centre = np.all(abs(coded) <= _LEVEL_TOLERANCE, axis=1)[:, None]
        for row, column in np.argwhere(~centre & (abs(abs(coded) - 1.0) > _LEVEL_TOLERANCE)).tolist():
            name = coding.names[column]
            raise UsageError(
                f"solver.screen row {row + 1}: the value {table[row][name]:g} is not a level of the factor {name}. "
                f"Set `low` and `high` of {name} to its two levels in the table."
            )
        coded = coded.round()
    levels = tuple({**study.midlevels(), **row} for row in table)
    return Design(stage, "given", coding, coded, levels, order=order)
