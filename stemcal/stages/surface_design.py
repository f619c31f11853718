"""The design of the surface: its factors, chosen by the screening or by name, their coding, and its rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from stemcal.doe.designs import catalogue
from stemcal.doe.regression.coding import Coding
from stemcal.errors import UsageError
from stemcal.note import Note
from stemcal.solvers.protocol import Solver
from stemcal.stages.design import Design, given_coded, given_levels
from stemcal.study.model import RsmOptions, Study, factors_taken, strongest_asked
from stemcal.words import series


class Screened(Protocol):
    """A screening, or a climb that hands on what it found."""

    @property
    def shares(self) -> Mapping[str, float]:
        """What each factor contributes, %; of several responses to the one it moves most."""

    @property
    def active_factors(self) -> Sequence[str]:
        """Names of the factors that matter."""


def surface_design(study: Study, solver: Solver, names: Sequence[str]) -> Design:
    """Return the design of the spec over the named factors, or the rows the solver has."""
    coding = surface_coding(study, names)
    given = solver.given_design("rsm")
    if given is None:
        coded = catalogue.surface_runs(len(names), surface_options(study))
        once = Design("rsm", study.rsm.design, coding, coded, coding.runs(coded, study.midlevels()))
        return once.repeated(study.replicates)
    return Design("rsm", "given", coding, given_coded(coding, given), given_levels(study, given))


def surface_coding(study: Study, names: Sequence[str]) -> Coding:
    """Return the coding of the spec; factors without one have the outermost runs at low and high."""
    factors = [study.factor(name) for name in names]
    reach = catalogue.surface_design(study.rsm.design).reach(len(names), surface_options(study))
    ranged = Coding.from_ranges(names, [f.low for f in factors], [f.high for f in factors], reach=reach)
    coded = {name: study.rsm.coded(name) for name in study.rsm.coding}
    return Coding(
        tuple(names),
        tuple(coded[n][0] if n in coded else c for n, c in zip(names, ranged.centre, strict=True)),
        tuple(coded[n][1] if n in coded else h for n, h in zip(names, ranged.half_step, strict=True)),
    )


def design_radius(study: Study, k: int) -> float:
    """Return how far from the centre the surface may be trusted, in coded units."""
    return catalogue.surface_design(study.rsm.design).radius(k, surface_options(study))


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
    """Return the significant factors, or those of largest contribution if the spec or the design requires a number."""
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
