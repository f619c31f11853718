"""The screening: design rows → responses → effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from stemcal.doe.designs import catalogue
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.screening.analysis import Screening, analyse_screening
from stemcal.doe.screening.effects import Effect
from stemcal.errors import UsageError
from stemcal.naming import FIRST, Names
from stemcal.note import Note, Remedy
from stemcal.runs.answer import reasons_given
from stemcal.runs.record import lower_bound_notes
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Asked, Design, given_coded, given_levels, runs_of
from stemcal.stages.result import Head
from stemcal.stages.screen.options import ScreenOptions
from stemcal.stages.screen.result import ScreenResult, fields_of
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study

_LEVEL_TOLERANCE = 1e-6


@a_stage(ScreenResult)
def screen(work: Work, head: Head) -> ScreenResult:
    """Run the screening design and find the factors that move the response."""
    study, options, design = work.study, work.study.of(ScreenOptions), screening_design(work.study, work.solver)
    symbols = [factor.symbol for factor in study.factors]
    requests = design.requests(study.targets.calibrate_at)
    answers = work.answers(requests)
    with reasons_given(requests, answers):
        runs = runs_of(design, requests, answers, work.solver)
        first, *others = (
            analyse_screening(
                design.coded,
                [run.number(name) for run in runs.runs],
                design.names,
                symbols,
                options.alpha,
                Names(study.naming.with_primary(name)),
            )
            for name in (FIRST, *study.own_further)
        )
    notes = (*first.notes, *lower_bound_notes(answers), *unexpected_signs(study, first))
    further = dict(zip(study.own_further, others, strict=True)) or None
    found = fields_of(first) | {"notes": notes, "responses": further}
    return ScreenResult(head=head, design=runs, alpha=options.alpha, **found)


def unexpected_signs(study: Study, found: Screening) -> list[Note]:
    """Return a note on each significant effect whose sign is not the one that the spec expects."""
    expected = {factor.name: factor.expected_sign for factor in study.factors}
    effects = [effect for effect in found.effects if effect.factor in found.significant]
    return [
        _unexpected(study, effect, sign)
        for effect in effects
        if (sign := expected[effect.factor]) and sign != ("+" if effect.effect > 0.0 else "-")
    ]


def _unexpected(study: Study, effect: Effect, expected: str) -> Note:
    size = Names(study.naming).quantity(effect.effect, "+.4g")
    text = f"The effect of {effect.factor} is {size}, but the spec expects the sign {expected}."
    return Note(
        "unexpected_sign", "warning", text, Remedy("Check the unit of the factor, and the aliases of its effect.")
    )


# ---- the design


def screening_design(study: Study, solver: Solver) -> Design:
    """Return the screening design over all factors, or the rows the solver has."""
    factors = study.factors
    coding = Coding.from_ranges(study.names, [f.low for f in factors], [f.high for f in factors])
    given = solver.given_design("screen")
    if given is None:
        chosen = study.of(ScreenOptions)
        if chosen.design == "none":
            raise UsageError("screen.design is none; choose a design to screen factors")
        corners = catalogue.screening_runs(chosen.design, len(factors), chosen.runs, chosen.fold_over)
        coded = np.vstack([corners, np.zeros((chosen.centre_points, len(factors)))])
        kind = f"{chosen.design}, folded over" if chosen.fold_over else chosen.design
        once = Design("screen", kind, coding, coded, coding.runs(coded, study.midlevels()), order=1)
        return once.repeated(study.replicates)
    coded = given_coded(coding, given)
    _require_two_levels(coding, coded, given)
    return Design("screen", "given", coding, coded.round(), given_levels(study, given), order=1)


def foresee(study: Study, solver: Solver) -> Asked:
    """Return the runs of the screening."""
    design = screening_design(study, solver)
    return Asked("screen", design.requests(study.targets.calibrate_at), settled=True, design=design)


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
