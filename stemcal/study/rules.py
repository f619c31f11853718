"""What must hold between the values of a spec, one rule per function; each yields what it finds wrong.

Rules on factors and material are in `factor_rules`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from stemcal.study.draft import Draft, Finding
from stemcal.study.factor_rules import FACTOR_RULES
from stemcal.study.model import RsmOptions, Target
from stemcal.study.outside_rules import OUTSIDE_RULES
from stemcal.study.parameters import PARAMETERS
from stemcal.words import did_you_mean, listed

__all__ = ["broken_rules"]

MOST_CCD_FACTORS = 8
SPACE_FILLING = ("latin-hypercube", "sobol")
_CLOSE = 1e-9
CLAIMS = (
    "r2",
    "adjusted_r2",
    "predicted_r2",
    "adequate_precision",
    "cv_percent",
    "max_abs_error_percent",
    "mean_abs_error_percent",
)


def broken_rules(draft: Draft) -> list[Finding]:
    """Return everything the rules find wrong with `draft`."""
    return [finding for rule in RULES for finding in rule(draft)]


def diameters_differ(draft: Draft) -> Iterator[Finding]:
    """Each diameter has one target."""
    seen: dict[float, int] = {}
    for index, target in enumerate(draft.targets.forces if draft.targets else ()):
        first = seen.setdefault(round(target.diameter, 9), index)
        if first != index:
            message = f"diameter {target.diameter:g} mm has two forces"
            remedy = "keep one; give the mean force with sd and n"
            yield Finding(("targets", "forces", index, "diameter"), message, remedy)


def calibration_has_target(draft: Draft) -> Iterator[Finding]:
    """The diameter to calibrate at is one of the measured ones."""
    if draft.targets is None:
        return
    diameters = [target.diameter for target in draft.targets.forces]
    at = draft.targets.calibrate_at
    if not any(math.isclose(at, diameter, rel_tol=_CLOSE) for diameter in diameters):
        measured = ", ".join(f"{diameter:g}" for diameter in diameters[:20])
        message = f"no force is given for {at:g} mm, only for {measured} mm"
        yield Finding(("targets", "calibrate_at"), message, "add its force or calibrate at another diameter")


def stem_reaches_over_supports(draft: Draft) -> Iterator[Finding]:
    """The specimen lies on both supports."""
    if draft.supports and draft.specimen and draft.supports.clearance >= draft.specimen.length:
        message = (
            f"the supports are {draft.supports.clearance:g} mm apart, the specimen is only "
            f"{draft.specimen.length:g} mm long"
        )
        yield Finding(("supports", "clearance"), message, "move them closer or take a longer specimen")


def blade_spans_stem(draft: Draft) -> Iterator[Finding]:
    """The edge is longer than every stem is wide."""
    if draft.blade is None:
        return
    for path, diameter in draft.diameters.items():
        if draft.blade.length < diameter:
            message = f"the stem is {diameter:g} mm wide, the blade only {draft.blade.length:g} mm long"
            yield Finding(path, message, "check blade.length and the unit of the diameter")


def edge_fits_blade(draft: Draft) -> Iterator[Finding]:
    """The rounding of the edge is smaller than half the thickness."""
    if draft.blade and draft.blade.edge_radius > draft.blade.thickness / 2:
        message = f"{draft.blade.edge_radius:g} mm is more than half the blade's thickness"
        yield Finding(("blade", "edge_radius"), message, f"stay below {draft.blade.thickness / 2:g} mm")


def elements_fit_stem(draft: Draft) -> Iterator[Finding]:
    """An element is smaller than the radius of the thinnest stem."""
    if draft.embedded is None or not draft.diameters:
        return
    thinnest = min(draft.diameters.values())
    if draft.embedded.element_size.at(thinnest) > thinnest / 2:
        message = f"elements of {draft.embedded.element_size} are too large for a {thinnest:g} mm stem"
        yield Finding(("solver", "element_size"), message, f"take about {thinnest / 8:.2g} mm")


def friction_falls(draft: Draft) -> Iterator[Finding]:
    """Sliding does not rub more than sticking."""
    contact = draft.contact
    if contact and contact.dynamic_friction > contact.static_friction:
        message = f"{contact.dynamic_friction:g} is above static_friction {contact.static_friction:g}"
        yield Finding(("contact", "dynamic_friction"), message, "swap them")


def one_mesh_scatter(draft: Draft) -> Iterator[Finding]:
    """Phases sample the mesh's place evenly, a perturbation draws it: not both."""
    if draft.embedded and draft.embedded.perturb is not None and draft.embedded.phases > 1:
        message = "stands beside phases, which shift the mesh themselves"
        yield Finding(("solver", "perturb"), message, "leave out one of them")


def symmetry_holds(draft: Draft) -> Iterator[Finding]:
    """A blade ground on one side has no mirror plane along the stem."""
    if draft.embedded and draft.blade and draft.blade.bevel == "one" and draft.embedded.symmetry == "quarter":
        message = "a quarter model needs a blade with two bevels, blade.bevel is 'one'"
        yield Finding(("solver", "symmetry"), message, "write symmetry: half")


def surface_factors_exist(draft: Draft) -> Iterator[Finding]:
    """`rsm.factors` names factors of the study, each once."""
    if draft.rsm is None or isinstance(draft.rsm.factors, str):
        return
    chosen = draft.rsm.factors
    for index, name in enumerate(chosen):
        path = ("rsm", "factors", index)
        if name not in draft.names:
            remedy = did_you_mean(name, draft.names)
            yield Finding(path, f"{name[:60]!r} is not a factor of this study", remedy)
        elif name in chosen[:index]:
            yield Finding(path, f"{name} stands here twice", "remove one")
    if len(chosen) < 2:
        yield Finding(("rsm", "factors"), "a response surface needs two factors or more", "add another")
    if len(chosen) > MOST_CCD_FACTORS:
        message = f"{len(chosen)} factors make {2 ** min(len(chosen), 60)} corner runs"
        yield Finding(("rsm", "factors"), message, f"keep at most {MOST_CCD_FACTORS}")


def surface_design_takes_factors(draft: Draft) -> Iterator[Finding]:
    """The design of the surface exists for its factors and has runs enough for a quadratic."""
    if draft.rsm is None or isinstance(draft.rsm.factors, str):
        return
    k, rsm = len(draft.rsm.factors), draft.rsm
    if rsm.design == "box-behnken" and not 3 <= k <= 7:
        yield Finding(("rsm", "design"), f"box-behnken exists for 3 to 7 factors, not {k}", "write central-composite")
    least = (k + 1) * (k + 2) // 2
    if rsm.design in SPACE_FILLING and rsm.runs is not None and rsm.runs < least:
        message = f"{rsm.runs} runs cannot carry the {least} coefficients of {k} factors"
        yield Finding(("rsm", "runs"), message, f"take {2 * least}")


def runs_are_used(draft: Draft) -> Iterator[Finding]:
    """`rsm.runs` is for designs whose size is free."""
    if draft.rsm and draft.rsm.runs is not None and draft.rsm.design not in SPACE_FILLING:
        message = f"the size of {draft.rsm.design} follows from the factors"
        yield Finding(("rsm", "runs"), message, "leave it out or write design: " + " or ".join(SPACE_FILLING))


def surface_weights_known(draft: Draft) -> Iterator[Finding]:
    """Weights by mesh phases need phases; blocks need a composite, whose alpha they set."""
    rsm = draft.rsm
    if rsm and rsm.weights == "phases" and not (draft.embedded and draft.embedded.phases > 1):
        yield Finding(("rsm", "weights"), "the solver gives no scatter over mesh phases", "write solver.phases: 4")
    if rsm and rsm.blocks == "orthogonal" and (rsm.design != "central-composite" or rsm.alpha != "rotatable"):
        message = "orthogonal blocks are those of a central composite and set its alpha themselves"
        yield Finding(("rsm", "blocks"), message, "write design: central-composite and leave alpha out")


def coding_fits(draft: Draft) -> Iterator[Finding]:
    """`rsm.coding` belongs to factors, lies within their ranges and keeps the corners physical."""
    if draft.rsm is None:
        return
    for name in draft.rsm.coding:
        if name not in draft.names:
            message = f"{name[:60]!r} is not a factor of this study"
            yield Finding(("rsm", "coding", name), message, did_you_mean(name, draft.names), at_key=True)
    yield from _coding_in_range(draft, draft.rsm)


def _coding_in_range(draft: Draft, rsm: RsmOptions) -> Iterator[Finding]:
    for factor in draft.factors.values():
        entry = rsm.coding.get(factor.name)
        if entry is None:
            continue
        path = ("rsm", "coding", factor.name)
        if factor.low < factor.high and not factor.low <= entry.center <= factor.high:
            message = f"{entry.center:g} is outside the factor's range {factor.low:g} to {factor.high:g}"
            yield Finding((*path, "center"), message, f"take {factor.centre:g} or so")
        elif draft.embedded and factor.name in PARAMETERS and entry.center - entry.half_step <= 0:
            message = f"center - half_step = {entry.center - entry.half_step:g} is not above 0"
            yield Finding((*path, "half_step"), message, "take a smaller half_step")


def published_factors_exist(draft: Draft) -> Iterator[Finding]:
    """A published solution names factors of the study."""
    for name in draft.published.solution if draft.published else ():
        if name not in draft.names:
            message = f"{name[:60]!r} is not a factor of this study"
            remedy = did_you_mean(name, draft.names)
            yield Finding(("published", "solution", name), message, remedy, at_key=True)


def joint_diameters_measured(draft: Draft) -> Iterator[Finding]:
    """`invert.diameters` names measured diameters, and the solver can answer at each."""
    if draft.invert is None or draft.invert.diameters is None or draft.targets is None:
        return
    if draft.solver and draft.solver.kind == "table":
        message = "the tables hold forces of one diameter only"
        yield Finding(("invert", "diameters"), message, "remove it, or use the embedded solver")
    if draft.invert.diameters == "all":
        return
    measured = [target.diameter for target in draft.targets.forces]
    for index, diameter in enumerate(draft.invert.diameters):
        if not any(math.isclose(diameter, other, rel_tol=_CLOSE) for other in measured):
            listing = ", ".join(f"{other:g}" for other in measured[:20])
            message = f"no force is given for {diameter:g} mm, only for {listing} mm"
            yield Finding(("invert", "diameters", index), message, "add its force to targets, or remove it here")


def responses_measured(draft: Draft) -> Iterator[Finding]:
    """What is fitted beside the force is measured, with its scatter as the weight, and simulated."""
    if draft.invert is None or draft.targets is None or draft.invert.responses == ("force",):
        return
    path, names = ("invert", "responses"), draft.invert.responses
    if draft.solver and draft.solver.kind != "embedded":
        yield Finding(path, f"solver {draft.solver.kind} answers with a force only", "remove it")
    if "force" not in names or len(set(names)) < len(names):
        message = f"{', '.join(names)}: the force belongs there, and each once"
        yield Finding(path, message, "write [force, travel, work]")
    for name in names:
        yield from _weighed(draft.targets.forces, name)


def _weighed(targets: tuple[Target, ...], name: str) -> Iterator[Finding]:
    """Demand a value and a standard deviation of a response at one diameter at least."""
    sd = "sd" if name == "force" else f"{name}_sd"
    given = [target for target in targets if getattr(target, name) is not None]
    if not given:
        yield Finding(("invert", "responses"), f"no {name} is given in targets.forces", "add it, or remove it here")
    elif all(getattr(target, sd) is None for target in given):
        message = f"{name} has no {sd} at any diameter: there is nothing to weigh it by"
        yield Finding(("invert", "responses"), message, f"add {sd} to a target")


def claims_known(draft: Draft) -> Iterator[Finding]:
    """A printed claim is about a number that the audit computes."""
    for name in draft.published.claims if draft.published else ():
        if name not in CLAIMS:
            message = f"{name[:60]!r} is no claim the audit knows"
            yield Finding(("published", "claims", name), message, did_you_mean(name, CLAIMS), at_key=True)


def table_answers_something(draft: Draft) -> Iterator[Finding]:
    """A table solver has at least one table."""
    solver = draft.solver
    if solver and solver.kind == "table" and not (solver.screen or solver.rsm or solver.validate):
        yield Finding(("solver",), "no table is given", "add " + listed(["screen", "rsm", "validate"]))


RULES: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    *FACTOR_RULES,
    diameters_differ,
    calibration_has_target,
    stem_reaches_over_supports,
    blade_spans_stem,
    edge_fits_blade,
    elements_fit_stem,
    friction_falls,
    symmetry_holds,
    one_mesh_scatter,
    surface_factors_exist,
    surface_design_takes_factors,
    runs_are_used,
    surface_weights_known,
    coding_fits,
    published_factors_exist,
    claims_known,
    joint_diameters_measured,
    responses_measured,
    table_answers_something,
    *OUTSIDE_RULES,
)
