"""Rules on what was measured: diameters, forces, other responses."""

import math
from collections.abc import Iterator, Sequence

from stemcal.naming import FIRST, FORCE, Naming
from stemcal.study.model import OwnQuantity, Target
from stemcal.study.model.parameters import PARAMETERS
from stemcal.study.rules.draft import Draft, Finding
from stemcal.study.rules.factors import reached
from stemcal.study.types.named import declared_once
from stemcal.study.types.strict_yaml import NodePath
from stemcal.study.types.units import UnitError, convert

_CLOSE = 1e-9
_TOO_MUCH, _TOO_LITTLE = 30.0, 1000.0


def names_are_free(draft: Draft) -> Iterator[Finding]:
    """Responses and conditions have names that stand for nothing else."""
    if draft.naming.is_cutting:
        return
    clashes = dict(declared_once(draft.naming, draft.names))
    declared: list[tuple[str, OwnQuantity]] = [("responses", response) for response in draft.responses or ()]
    declared += [("conditions", condition) for condition in draft.conditions or ()]
    counts = {section: 0 for section, _ in declared}
    for section, one in declared:
        index, counts[section] = counts[section], counts[section] + 1
        if one.name in clashes:
            message = f"{one.name!r} is the name of {clashes[one.name]} already"
            yield Finding((section, index, "name"), message, "choose another name")


def conditions_differ(draft: Draft) -> Iterator[Finding]:
    """Each diameter has one target."""
    seen: dict[float, int] = {}
    for target in draft.targets.means if draft.targets else ():
        first = seen.setdefault(round(target.condition, 9), target.row)
        if first != target.row:
            named = draft.naming
            place = f"diameter {named.place(target.condition)}" if named.is_cutting else named.place(target.condition)
            message = f"{place or 'the study'} has two {named.response.plural}"
            remedy = f"keep one; give the mean {named.response.noun} with sd and n"
            at: NodePath = ("targets", target.row)
            yield Finding((*at, named.condition.name) if named.condition else at, message, remedy)


def forces_are_newtons(draft: Draft) -> Iterator[Finding]:
    """Not all forces are a thousand times what the stem can bear, or a thousandth: N written as kN, or as mN."""
    strengths = _yield_stresses(draft)
    if draft.targets is None or draft.specimen is None or not strengths:
        return
    low, high = PARAMETERS["yield_stress"].plausible
    if not draft.stem_solver or draft.naming.response != FORCE or min(strengths) < low or max(strengths) > high:
        return  # a yield stress that no plant has is told of elsewhere
    hollow = 1.0 - draft.specimen.diameter_ratio**2
    areas = [0.25 * math.pi * target.condition**2 * hollow for target in draft.targets.means]
    # two cross-sections in shear bear 2 A σy/√3
    shares = [target.response / (1.155 * area) for target, area in zip(draft.targets.means, areas, strict=True)]
    path = ("targets",)
    if min(shares) > _TOO_MUCH * max(strengths):
        message = f"every force is more than {_TOO_MUCH:g} times what the stem's whole cross-section bears"
        yield Finding(path, message, "was it measured in N and written in kN?")
    elif max(shares) < min(strengths) / _TOO_LITTLE:
        message = f"every force is less than 1/{_TOO_LITTLE:g} of what the stem's whole cross-section bears"
        yield Finding(path, message, "was it measured in kN and written in N, or in N and written in mN?")


def _yield_stresses(draft: Draft) -> list[float]:
    """Return the yield stresses that the study can take, MPa."""
    if draft.material and (fixed := draft.material.given().get("yield_stress")):
        return [fixed]
    if "yield_stress" in draft.growing:
        return reached(draft, "yield_stress")
    varied = [factor for factor in draft.factors.values() if factor.name == "yield_stress"]
    levels = [(level, factor.unit) for factor in varied for level in (factor.low, factor.high)]
    try:
        return [convert(level, unit, "stress") for level, unit in levels]
    except UnitError:  # told of elsewhere
        return []


def joint_conditions_measured(draft: Draft) -> Iterator[Finding]:
    """`invert.diameters` names measured diameters."""
    if draft.invert is None or draft.invert.conditions is None or draft.targets is None:
        return
    if draft.naming.condition is None:
        remedy = "declare one under conditions, or remove this"
        yield Finding(("invert", "diameters"), "the study has no conditions", remedy)
        return
    if draft.invert.conditions == "all":
        return
    measured = [target.condition for target in draft.targets.means]
    for index, condition in enumerate(draft.invert.conditions):
        if not any(math.isclose(condition, other, rel_tol=_CLOSE) for other in measured):
            named = draft.naming
            message = f"no {named.response.noun} is given for {named.place(condition)}, only for "
            remedy = f"add its {named.response.noun} to targets, or remove it here"
            yield Finding(("invert", "diameters", index), message + _listing(measured, draft), remedy)


def _listing(values: Sequence[float], draft: Draft) -> str:
    """List conditions with their unit."""
    unit = "" if draft.naming.condition is None else draft.naming.condition.unit_suffix
    return ", ".join(f"{value:g}" for value in values[:20]) + unit


def responses_measured(draft: Draft) -> Iterator[Finding]:
    """What is fitted beside the force is measured, with its scatter as the weight, and simulated."""
    if draft.invert is None or draft.targets is None or draft.invert.responses == (FIRST,):
        return
    path, names, named = ("invert", "responses"), draft.invert.responses, draft.naming
    if named.is_cutting and draft.solver and draft.solver.kind != "embedded":
        yield Finding(path, f"solver {draft.solver.kind} answers with a force only", "remove it")
    if FIRST not in names or len(set(names)) < len(names):
        listed = ", ".join(named.named(name).name for name in names)
        message = f"{listed}: the {named.response.noun} belongs there, and each once"
        yield Finding(path, message, f"write [{', '.join(response.name for response in named.responses)}]")
    for name in names if not draft.tests else (FIRST,):  # what tests measure is weighed there
        yield from _weighed(draft.targets.means, name, draft.naming)


def _weighed(targets: tuple[Target, ...], response: str, naming: Naming) -> Iterator[Finding]:
    """Demand a value and a standard deviation of a response at one diameter at least."""
    name = naming.named(response).name
    sd = "sd: …" if response == FIRST else f"sd: {{{name}: …}}"
    given = {one.row: one.mean_of(response)[1] for one in targets if one.mean_of(response)[0] is not None}
    if not given:
        yield Finding(("invert", "responses"), f"no {name} is given in targets", "add it, or remove it here")
    elif all(scatter is None for scatter in given.values()):
        at_any = f" at any {naming.condition_noun}" if naming.condition is not None else ""
        message = f"{name} has no sd{at_any}: there is nothing to weigh it by"
        yield Finding(("targets", min(given)), message, f"add {sd}")
