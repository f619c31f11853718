"""Rules on the virtual test, the response surface, the climb to it and the refinement."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from stemcal.study.model import PARAMETERS, RsmOptions, factors_taken, kind_of, strongest_asked
from stemcal.study.rules.draft import Draft, Finding


def stem_reaches_over_supports(draft: Draft) -> Iterator[Finding]:
    """The specimen is on both supports."""
    if draft.study.supports.clearance >= draft.study.specimen.length:
        message = (
            f"the supports are {draft.study.supports.clearance:g} mm apart, the specimen is only "
            f"{draft.study.specimen.length:g} mm long"
        )
        yield Finding(("supports", "clearance"), message, "move them closer or use a longer specimen")


def edge_fits_blade(draft: Draft) -> Iterator[Finding]:
    """The rounding of the edge is smaller than half the thickness."""
    if draft.study.blade.edge_radius > draft.study.blade.thickness / 2:
        message = f"{draft.study.blade.edge_radius:g} mm is more than half the blade's thickness"
        yield Finding(("blade", "edge_radius"), message, f"stay below {draft.study.blade.thickness / 2:g} mm")


def friction_falls(draft: Draft) -> Iterator[Finding]:
    """Sliding does not rub more than sticking."""
    contact = draft.study.contact
    if contact.dynamic_friction > contact.static_friction:
        message = f"{contact.dynamic_friction:g} is above static_friction {contact.static_friction:g}"
        yield Finding(("contact", "dynamic_friction"), message, "swap them")


MOST_CCD_FACTORS = 8
LATIN_HYPERCUBE = "latin-hypercube"


def surface_factors_exist(draft: Draft) -> Iterator[Finding]:
    """`rsm.factors` names factors of the study, each once."""
    if isinstance(draft.study.rsm.factors, str):
        return
    chosen = draft.study.rsm.factors
    for index, name in enumerate(chosen):
        path = ("rsm", "factors", index)
        if name not in draft.names:
            yield draft.unknown_factor(path, name, at_key=False)
        elif name in chosen[:index]:
            yield Finding(path, f"{name} is listed twice", "remove one")
    if not chosen:
        yield Finding(("rsm", "factors"), "a response surface needs a factor", "name one")
    if len(chosen) > MOST_CCD_FACTORS:
        message = f"{len(chosen)} factors make too many corner runs"
        yield Finding(("rsm", "factors"), message, f"keep at most {MOST_CCD_FACTORS}")


def factors_are_found(draft: Draft) -> Iterator[Finding]:
    """Without a screening the spec names the surface's factors, and there is no slope to climb along."""
    if draft.study.screen.design != "none":
        return
    if isinstance(draft.study.rsm.factors, str):
        names = ", ".join(draft.names[:3])
        message = f"without a screening it is unknown which factors are {draft.study.rsm.factors}"
        yield Finding(("rsm",), message, f"name them, as in factors: [{names}], or remove screen.design: none")
    if draft.study.climb is not None:
        yield Finding(("climb",), "a climb follows the slope that a screening finds", "remove screen.design: none")


def strongest_are_enough(draft: Draft) -> Iterator[Finding]:
    """`rsm.factors: strongest 3` asks for as many factors as the design takes and the study has."""
    if not (asked := strongest_asked(draft.study.rsm.factors)):
        return
    least, most = factors_taken(draft.study.rsm.design)
    most = min(most, MOST_CCD_FACTORS, len(draft.names))
    if not least <= asked <= most:
        message = f"{draft.study.rsm.design} takes {least} to {most} of these {len(draft.names)} factors, not {asked}"
        yield Finding(("rsm", "factors"), message, f"write strongest {least}")


def surface_design_takes_factors(draft: Draft) -> Iterator[Finding]:
    """The design of the surface exists for its factors and has enough runs for a quadratic."""
    if isinstance(draft.study.rsm.factors, str):
        return
    k, rsm = len(draft.study.rsm.factors), draft.study.rsm
    fewest, most = factors_taken(rsm.design)
    if (fewest > 2 and k < fewest) or k > most:
        message = f"{rsm.design} exists for {fewest} to {most} factors, not {k}"
        yield Finding(("rsm", "design"), message, "write central-composite")
    least = (k + 1) * (k + 2) // 2
    if rsm.design == LATIN_HYPERCUBE and rsm.runs is not None and rsm.runs < least:
        message = f"{rsm.runs} runs cannot determine the {least} coefficients of {k} factors"
        yield Finding(("rsm", "runs"), message, f"take {2 * least}")


def runs_are_used(draft: Draft) -> Iterator[Finding]:
    """`rsm.runs` is for the design whose size is free."""
    if draft.study.rsm.runs is not None and draft.study.rsm.design != LATIN_HYPERCUBE:
        message = f"the size of {draft.study.rsm.design} follows from the factors"
        yield Finding(("rsm", "runs"), message, f"leave it out or write design: {LATIN_HYPERCUBE}")


def coding_fits(draft: Draft) -> Iterator[Finding]:
    """`rsm.coding` has keys for factors, is within their ranges and keeps the corners physical."""
    for name in draft.study.rsm.coding:
        if name not in draft.names:
            yield draft.unknown_factor(("rsm", "coding", name), name)
    yield from _coding_in_range(draft, draft.study.rsm)


def _coding_in_range(draft: Draft, rsm: RsmOptions) -> Iterator[Finding]:
    for factor in draft.factors.values():
        entry = rsm.coding.get(factor.name)
        if entry is None:
            continue
        path, (low, high) = ("rsm", "coding", factor.name), entry
        if low >= high:
            yield Finding(path, f"low {low:g} is not below high {high:g}", "swap them")
        elif factor.low < factor.high and not factor.low <= 0.5 * (low + high) <= factor.high:
            message = f"centre {0.5 * (low + high):g} is outside the factor's range {factor.low:g} to {factor.high:g}"
            yield Finding(path, message, f"centre it near {factor.centre:g}")
        elif factor.name in draft.kind.parameters and factor.name in PARAMETERS and low <= 0:
            yield Finding((*path, 0), f"{low:g} is not above 0", "write a larger value")


def steps_stay_inside(draft: Draft) -> Iterator[Finding]:
    """`climb.step_sizes` are those of factors, and the first step stays in their ranges."""
    if draft.study.climb is None:
        return
    known = {factor.name: factor for factor in draft.factors.values()}
    for name, size in draft.study.climb.step_sizes.items():
        path = ("climb", "step_sizes", name)
        if name not in draft.names:
            yield draft.unknown_factor(path, name)
        elif name in known and size > known[name].half_range * (1.0 + 1e-9):
            factor = known[name]
            message = f"a step of {size:g} from the middle, {factor.centre:g}, leaves {factor.low:g} to {factor.high:g}"
            yield Finding(path, message, f"use at most {factor.half_range:g}")


def refinement_is_possible(draft: Draft) -> Iterator[Finding]:
    """Only factors with rising ranges can move, and only in another model; people run one of two programs."""
    if draft.study.refine is None:
        return
    by_name = {factor.name: factor for factor in draft.factors.values()}
    for name, ends in draft.study.refine.adjust.items():
        if name not in draft.names:
            yield draft.unknown_factor(("refine", "adjust", name), name)
        elif name in by_name and ends is not None and ends[0] >= ends[1]:
            message = f"low {ends[0]:g} is not below high {ends[1]:g}"
            yield Finding(("refine", "adjust", name), message, "widen the range")
    if not draft.study.refine.elsewhere and (draft.study.refine.adjust or draft.study.refine.changes):
        key = "adjust" if draft.study.refine.adjust else next(iter(next(iter(draft.study.refine.changes.values()))))
        message = "it applies to another model only, and there is no key `in`"
        yield Finding(("refine", key), message, "add refine.in, or remove it", at_key=True)
    there = draft.study.refine.in_
    if there is not None and draft.kind.answers == kind_of(there).answers == "asks_people":
        message = "the study's runs are entered by hand already, and a sheet asks for one program only"
        yield Finding(("refine", "in", "kind"), message, "make a separate study for it")


def seen_there(draft: Draft) -> Draft | None:
    """Return the study as `refine.in` simulates it; None without it, or where the sections are not valid."""
    try:
        return replace(draft, study=draft.study.there) if draft.study.there is not draft.study else None
    except AttributeError:
        return None


def wrong_there(draft: Draft, broken: Sequence[Finding]) -> Iterator[Finding]:
    """Yield what is wrong with the study in `refine.in`, at the keys of that section.

    A factor that does not move may have no effect there.
    """
    for finding in broken:
        section = finding.path[0] if finding.path else ""
        if section == "solver":
            yield finding._replace(path=("refine", "in", *finding.path[1:]))
        elif section in ("responses", "conditions") and draft.kind.own_responses:
            yield finding._replace(path=("refine", "in"), at_key=False)
        elif section == "factors" and draft.study.refine and isinstance(index := finding.path[1], int):
            factor = draft.factors.get(index)
            if factor is not None and factor.name in draft.study.refine.adjust and finding.path[2:] == ("name",):
                yield finding._replace(path=("refine", "adjust", factor.name))
