"""Rules on the response surface and the climb to it: factors, design, coding, steps."""

from collections.abc import Iterator

from stemcal.study.model import PARAMETERS, RsmOptions, factors_taken, strongest_asked
from stemcal.study.rules.draft import Draft, Finding

MOST_CCD_FACTORS = 8
LATIN_HYPERCUBE = "latin-hypercube"


def surface_factors_exist(draft: Draft) -> Iterator[Finding]:
    """`rsm.factors` names factors of the study, each once."""
    if draft.rsm is None or isinstance(draft.rsm.factors, str):
        return
    chosen = draft.rsm.factors
    for index, name in enumerate(chosen):
        path = ("rsm", "factors", index)
        if name not in draft.names:
            yield draft.unknown_factor(path, name, at_key=False)
        elif name in chosen[:index]:
            yield Finding(path, f"{name} stands here twice", "remove one")
    if not chosen:
        yield Finding(("rsm", "factors"), "a response surface needs a factor", "name one")
    if len(chosen) > MOST_CCD_FACTORS:
        message = f"{len(chosen)} factors make too many corner runs"
        yield Finding(("rsm", "factors"), message, f"keep at most {MOST_CCD_FACTORS}")


def factors_are_found(draft: Draft) -> Iterator[Finding]:
    """Without a screening the spec names the surface's factors, and there is no slope to climb along."""
    if draft.screen is None or draft.screen.design != "none":
        return
    if draft.rsm is not None and isinstance(draft.rsm.factors, str):
        names = ", ".join(draft.names[:3])
        message = f"without a screening nothing tells which factors are {draft.rsm.factors}"
        yield Finding(("rsm",), message, f"name them, as in factors: [{names}], or leave out screen.design: none")
    if draft.climb is not None:
        yield Finding(("climb",), "a climb follows the slope that a screening finds", "leave out screen.design: none")


def strongest_are_enough(draft: Draft) -> Iterator[Finding]:
    """`rsm.factors: strongest 3` asks for as many factors as the design takes and the study has."""
    if draft.rsm is None or not (asked := strongest_asked(draft.rsm.factors)):
        return
    least, most = factors_taken(draft.rsm.design)
    most = min(most, MOST_CCD_FACTORS, len(draft.names))
    if not least <= asked <= most:
        message = f"{draft.rsm.design} takes {least} to {most} of these {len(draft.names)} factors, not {asked}"
        yield Finding(("rsm", "factors"), message, f"write strongest {least}")


def surface_design_takes_factors(draft: Draft) -> Iterator[Finding]:
    """The design of the surface exists for its factors and has enough runs for a quadratic."""
    if draft.rsm is None or isinstance(draft.rsm.factors, str):
        return
    k, rsm = len(draft.rsm.factors), draft.rsm
    if rsm.design == "box-behnken" and not 3 <= k <= 7:
        yield Finding(("rsm", "design"), f"box-behnken exists for 3 to 7 factors, not {k}", "write central-composite")
    least = (k + 1) * (k + 2) // 2
    if rsm.design == LATIN_HYPERCUBE and rsm.runs is not None and rsm.runs < least:
        message = f"{rsm.runs} runs cannot carry the {least} coefficients of {k} factors"
        yield Finding(("rsm", "runs"), message, f"take {2 * least}")


def runs_are_used(draft: Draft) -> Iterator[Finding]:
    """`rsm.runs` is for the design whose size is free."""
    if draft.rsm and draft.rsm.runs is not None and draft.rsm.design != LATIN_HYPERCUBE:
        message = f"the size of {draft.rsm.design} follows from the factors"
        yield Finding(("rsm", "runs"), message, f"leave it out or write design: {LATIN_HYPERCUBE}")


def coding_fits(draft: Draft) -> Iterator[Finding]:
    """`rsm.coding` belongs to factors, lies within their ranges and keeps the corners physical."""
    if draft.rsm is None:
        return
    for name in draft.rsm.coding:
        if name not in draft.names:
            yield draft.unknown_factor(("rsm", "coding", name), name)
    yield from _coding_in_range(draft, draft.rsm)


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
            yield Finding(path, message, f"centre it at {factor.centre:g} or so")
        elif draft.embedded and factor.name in PARAMETERS and low <= 0:
            yield Finding((*path, 0), f"{low:g} is not above 0", "write a larger value")


def steps_stay_inside(draft: Draft) -> Iterator[Finding]:
    """`climb.step_sizes` belong to factors, and the first step stays in their ranges."""
    if draft.climb is None:
        return
    known = {factor.name: factor for factor in draft.factors.values()}
    for name, size in draft.climb.step_sizes.items():
        path = ("climb", "step_sizes", name)
        if name not in draft.names:
            yield draft.unknown_factor(path, name)
        elif name in known and size > known[name].half_range * (1.0 + 1e-9):
            factor = known[name]
            message = f"a step of {size:g} from the middle, {factor.centre:g}, leaves {factor.low:g} to {factor.high:g}"
            yield Finding(path, message, f"take at most {factor.half_range:g}")
