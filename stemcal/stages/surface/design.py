"""The design of the surface: its coding and its rows; and the notes of `check` on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isclose

from stemcal.doe.designs import catalogue
from stemcal.doe.regression.coding import Coding
from stemcal.note import Note, Remedy
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Design, given_coded, given_levels
from stemcal.stages.screen.options import is_screened
from stemcal.stages.surface.options import RsmOptions, factors_taken
from stemcal.study.model import Growth, Study


def surface_design(study: Study, solver: Solver, names: Sequence[str]) -> Design:
    """Return the design of the spec over the named factors, or the rows the solver has."""
    coding, rsm = surface_coding(study, names), study.of(RsmOptions)
    given = solver.given_design("rsm")
    if given is None:
        coded = catalogue.surface_runs(len(names), rsm.chosen())
        once = Design("rsm", rsm.design, coding, coded, coding.runs(coded, study.midlevels()))
        return once.repeated(study.replicates)
    return Design("rsm", "given", coding, given_coded(coding, given), given_levels(study, given))


def surface_coding(study: Study, names: Sequence[str]) -> Coding:
    """Return the coding of the spec; factors without one have the outermost runs at low and high."""
    factors, rsm = [study.factor(name) for name in names], study.of(RsmOptions)
    ranged = Coding.from_ranges(names, [f.low for f in factors], [f.high for f in factors], reach=rsm.reach(len(names)))
    coded = {name: rsm.coded(name) for name in rsm.coding}
    return Coding(
        tuple(names),
        tuple(coded[n][0] if n in coded else c for n, c in zip(names, ranged.centre, strict=True)),
        tuple(coded[n][1] if n in coded else h for n, h in zip(names, ranged.half_step, strict=True)),
    )


def beforehand(study: Study) -> Iterator[Note]:
    """Yield notes on a design that takes other numbers of factors than may be significant, and on factors left out."""
    rsm = study.of(RsmOptions)
    least, most = factors_taken(rsm.design)
    if least > 2 and rsm.factors == "significant":
        yield _factors_wanted(rsm.design, least, most, len(study.factors))
    if not isinstance(rsm.factors, str):
        yield from _not_varied(study, rsm.factors)


def _factors_wanted(design: str, least: int, most: int, factors: int) -> Note:
    needs = f"rsm.design {design} requires {least} to {most} factors"
    if factors < least:
        text = f"{needs}, but this study has {factors}: it will stop after the screening."
        return Note("too_few_factors", "caution", text, Remedy("Use central-composite."))
    text = (
        f"{needs}. If fewer are significant, the surface uses the {least} with the largest contribution, and some of "
        f"its terms are noise; if more, the {most} strongest."
    )
    remedy = Remedy(f"Set this with `rsm.factors: strongest {least}`; central-composite needs only two.")
    return Note("factors_wanted", "caution", text, remedy)


def _not_varied(study: Study, chosen: Sequence[str]) -> Iterator[Note]:
    """Yield the factors that stay at mid-level; an exponent changes nothing where its growth is one."""
    at = study.targets.calibrate_at
    grown = [growth for growth in study.material.growing().values() if isinstance(growth, Growth)]
    unseen = {growth.exponent for growth in grown if isclose(growth.at, at)}
    for factor in study.factors:
        screened = is_screened(study) and factor.name not in unseen
        if not screened and factor.name not in chosen:
            text = (
                f"{factor.name} is neither screened nor listed in rsm.factors, so it stays at {factor.centre:g} in all "
                "runs."
            )
            remedy = Remedy("List it in rsm.factors, or set a fixed value instead of the range.")
            yield Note("not_varied", "caution", text, remedy)
