"""The designs of a study: which factors vary, over which levels, coded how, and their runs once answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from stemcal.doe.designs import catalogue
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError
from stemcal.files.rows import Rows
from stemcal.note import Note
from stemcal.runs.outcome import outcome_of
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.result import DesignRun, DesignRuns
from stemcal.study.model import RsmOptions, Study, factors_taken, strongest_asked
from stemcal.words import series

_LEVEL_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Design:
    """The runs of a stage: `coded` is (n, k) over the factors of `coding`, `levels` holds every factor.

    Of a program with chance in it they are the design `replicates` times over.
    """

    stage: str
    kind: str
    coding: Coding
    coded: Array
    levels: tuple[Mapping[str, float], ...]
    replicates: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """The factors that vary."""
        return self.coding.names

    def requests(self, condition: float) -> list[Request]:
        """Return a request per row."""
        return [
            Request(self.stage, row, levels, condition, replicate=self.replicate(row))
            for row, levels in enumerate(self.levels)
        ]

    def replicate(self, row: int) -> int:
        """Return which time over a row belongs to, from 1; 0 without chance."""
        return 1 + row * self.replicates // len(self.levels) if self.replicates else 0

    def repeated(self, times: int) -> Design:
        """Return the design so many times over, each row to be simulated anew; itself for 0."""
        coded = np.tile(self.coded, (times or 1, 1))
        return replace(self, coded=coded, levels=self.levels * (times or 1), replicates=times)


class Screened(Protocol):
    """A screening, or a climb that hands on what it found."""

    @property
    def shares(self) -> Mapping[str, float]:
        """What each factor contributes, per cent; of several responses to the one it moves most."""

    @property
    def active_factors(self) -> Sequence[str]:
        """Names of the factors that matter."""


def runs_of(design: Design, requests: Sequence[Request], answers: Sequence[Answer], solver: Solver) -> DesignRuns:
    """Return a design with its runs, numbered from 1."""
    runs = [
        DesignRun(
            run=request.row + 1,
            levels=dict(request.levels),
            coded=dict(zip(design.names, coded, strict=True)),
            replicate=request.replicate or None,
            outcome=outcome_of(request, answer, solver),
        )
        for request, answer, coded in zip(requests, answers, design.coded.tolist(), strict=True)
    ]
    return DesignRuns(design.kind, Rows(runs))


def screening_design(study: Study, solver: Solver) -> Design:
    """Return the screening design over all factors, or the rows the solver has."""
    factors = study.factors
    coding = Coding.from_ranges(study.names, [f.low for f in factors], [f.high for f in factors])
    given = solver.given_design("screen")
    if given is None:
        chosen = study.screen
        if chosen.design == "none":
            raise UsageError("screen.design is none; name another to screen factors")
        corners = catalogue.screening_runs(chosen.design, len(factors), chosen.runs, chosen.fold_over)
        coded = np.vstack([corners, np.zeros((chosen.centre_points, len(factors)))])
        kind = f"{chosen.design}, folded over" if chosen.fold_over else chosen.design
        return Design("screen", kind, coding, coded, coding.runs(coded, study.midlevels())).repeated(study.replicates)
    coded = _given_coded(coding, given)
    _require_two_levels(coding, coded, given)
    return Design("screen", "given", coding, coded.round(), _given_levels(study, given))


def surface_design(study: Study, solver: Solver, names: Sequence[str]) -> Design:
    """Return the design of the spec over the named factors, or the rows the solver has."""
    coding = surface_coding(study, names)
    given = solver.given_design("rsm")
    if given is None:
        coded = catalogue.surface_runs(len(names), surface_options(study))
        once = Design("rsm", study.rsm.design, coding, coded, coding.runs(coded, study.midlevels()))
        return once.repeated(study.replicates)
    return Design("rsm", "given", coding, _given_coded(coding, given), _given_levels(study, given))


def surface_coding(study: Study, names: Sequence[str]) -> Coding:
    """Return the coding of the spec; factors without one have the outermost runs at low and high."""
    factors = [study.factor(name) for name in names]
    reach = catalogue.surface_reach(len(names), surface_options(study))
    ranged = Coding.from_ranges(names, [f.low for f in factors], [f.high for f in factors], reach=reach)
    coded = {name: study.rsm.coded(name) for name in study.rsm.coding}
    return Coding(
        tuple(names),
        tuple(coded[n][0] if n in coded else c for n, c in zip(names, ranged.centre, strict=True)),
        tuple(coded[n][1] if n in coded else h for n, h in zip(names, ranged.half_step, strict=True)),
    )


def design_radius(study: Study, k: int) -> float:
    """Return how far from the centre the surface may be trusted, in coded units."""
    return catalogue.surface_radius(k, surface_options(study))


def surface_options(study: Study) -> catalogue.SurfaceOptions:
    """Return what the spec chooses about the design of the surface."""
    rsm = study.rsm
    return catalogue.SurfaceOptions(rsm.design, rsm.centre_points, rsm.alpha, rsm.runs, rsm.extra_runs)


def surface_factors(study: Study, solver: Solver, screening: Screened | None) -> tuple[list[str], list[Note]]:
    """Return the factors of the surface, the strongest first, and notes on how they were chosen."""
    given = solver.given_design("rsm")
    if not isinstance(study.rsm.factors, str):
        return list(study.rsm.factors), []
    if screening is None:
        raise UsageError(f"rsm.factors: {study.rsm.factors} needs a screening; run `stemcal screen SPEC` first")
    chosen, notes = _strongest(screening, study.rsm)
    if given is None:
        return chosen, notes
    columns = [name for name in given[0] if name in study.names]
    if set(columns) != set(chosen):
        text = f"The table varies {series(columns)}; the screening would have chosen {series(chosen)}."
        notes = [Note("table_varies", "warning", text)]
    return columns, notes


def _strongest(screening: Screened, rsm: RsmOptions) -> tuple[list[str], list[Note]]:
    """Return the significant factors, or those of largest contribution where the spec or the design want so many."""
    shares = screening.shares
    ranked = sorted(shares, key=lambda name: -shares[name])
    found = [name for name in ranked if name in screening.active_factors]
    asked, (least, most) = strongest_asked(rsm.factors), factors_taken(rsm.design)
    if asked:
        return ranked[:asked], [_strongest_asked(ranked[:asked], found)]
    if least <= len(found) <= most:
        return found, []
    chosen = ranked[: min(max(len(found), least), most)]
    if len(found) < least:
        few = f"only {series(found)}" if found else "no factor"
        text = f"The screening found {few} significant; the surface uses the strongest factors, {series(chosen)}."
        return chosen, [Note("few_significant", "caution", text)]
    text = f"The screening found {series(found)} significant; {rsm.design} uses the {most} strongest of them."
    return chosen, [Note("many_significant", "caution", text)]


def _strongest_asked(chosen: Sequence[str], significant: Sequence[str]) -> Note:
    """Return the note on the factors that `rsm.factors: strongest N` chose."""
    text = f"The surface uses the strongest factors (`rsm.factors`): {series(chosen)}."
    if weak := [name for name in chosen if name not in significant]:
        text += f" Not significant among them: {series(weak)}."
    if left := [name for name in significant if name not in chosen]:
        text += f" Significant, but left out: {series(left)}."
    return Note("strongest_asked", "caution", text)


def _given_levels(study: Study, given: Sequence[Mapping[str, float]]) -> tuple[dict[str, float], ...]:
    return tuple({**study.midlevels(), **row} for row in given)


def _given_coded(coding: Coding, given: Sequence[Mapping[str, float]]) -> Array:
    missing = [name for name in coding.names if name not in given[0]]
    if missing:
        raise UsageError(f"the solver's table does not vary {', '.join(missing)}; name its columns in rsm.factors")
    return coding.to_coded([[row[name] for name in coding.names] for row in given])


def _require_two_levels(coding: Coding, coded: Array, given: Sequence[Mapping[str, float]]) -> None:
    """Raise `UsageError` if a row is neither at low and high levels nor a centre point."""
    off = np.where(np.all(abs(coded) <= _LEVEL_TOLERANCE, axis=1)[:, None], 0.0, abs(abs(coded) - 1.0))
    for row, values in enumerate(off):
        for name, miss in zip(coding.names, values, strict=True):
            if miss > _LEVEL_TOLERANCE:
                raise UsageError(
                    f"solver.screen row {row + 1}: {name} {given[row][name]:g} is neither low nor high; "
                    f"set factors.{name}.low and high to the two levels of the table"
                )
