"""The `optimise` section: the levels of the present cutter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pydantic_core import PydanticCustomError

from stemcal.stages.rsm.options import RsmOptions
from stemcal.study.types import units
from stemcal.study.types.factor import SETTINGS, Factor
from stemcal.study.types.field_types import Frozen, Number
from stemcal.study.types.named import quantity
from stemcal.study.types.strict_yaml import Finding
from stemcal.vocabulary import Variable

if TYPE_CHECKING:
    from stemcal.study.model.study import Study
    from stemcal.study.rules import Draft


class OptimiseOptions(Frozen):
    """Options of the stage optimise: the present cutter, with which the optimum is compared."""

    present: dict[str, Number | str] = {}
    """Levels of factors at the present cutter, such as `{edge_angle: 30 deg}`. By default, a setting of the test has
    its default value if the range of the factor contains it. All other factors are at the middle of their ranges."""


def _level(factor: Factor, value: float | str) -> float:
    """Return a level of the spec in the unit of the factor; raise `PydanticCustomError` if it is invalid."""
    return quantity(value, Variable(factor.name, factor.name, "", factor.unit))


def _present_is_possible(draft: Draft) -> Iterator[Finding]:
    present, known = draft.study.of(OptimiseOptions).present, {f.name: f for f in draft.factors.values()}
    if present and draft.study.goal is None:
        yield Finding(("optimise",), "the study has no goal", "add `goal: {minimise: [force]}`, or remove this key")
    for name, value in present.items():
        path = ("optimise", "present", name)
        if name not in draft.names:
            yield draft.unknown_factor(path, name)
        elif (factor := known.get(name)) is not None:
            try:
                level = _level(factor, value)
            except PydanticCustomError as error:
                context = error.context or {}
                yield Finding(path, str(context.get("message", "")), str(context.get("remedy", "")))
                continue
            if not factor.low <= level <= factor.high:
                ends = f"{factor.low:g} to {factor.high:g} {factor.unit}".removesuffix(" 1")
                message = f"{value} is outside the range of the factor ({ends})"
                yield Finding(path, message, "remove this key, or widen the range")


def _surface_is_made(draft: Draft) -> Iterator[Finding]:
    if draft.study.goal is not None and draft.study.of(RsmOptions).design == "none":
        message = "a goal requires a response surface, but the spec has `rsm.design: none`"
        yield Finding(("goal",), message, "choose a design, or use no `--quick`")


OptimiseOptions.rules = (_present_is_possible, _surface_is_made)


def present_levels(study: Study) -> dict[str, float]:
    """Return the levels of the present cutter: `optimise.present`, else the settings of the test, else mid-range."""
    levels, present = study.midlevels(), study.of(OptimiseOptions).present
    for factor in study.factors:
        if factor.name in present:
            levels[factor.name] = _level(factor, present[factor.name])
        elif factor.name in SETTINGS.keys() & study.kind.parameters.keys():
            usual = getattr(getattr(study, SETTINGS[factor.name].section), factor.name, None)
            level = units.from_internal(usual, factor.unit) if isinstance(usual, int | float) else None
            if level is not None and factor.low <= level <= factor.high:
                levels[factor.name] = float(f"{level:.12g}")
    return levels
