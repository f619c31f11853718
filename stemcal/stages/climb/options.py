"""The section of the climb: steps between screening and surface."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from stemcal.stages.screen.options import is_screened
from stemcal.study.types.field_types import Flag, Frozen, Number, Whole
from stemcal.study.types.strict_yaml import Finding

if TYPE_CHECKING:
    from stemcal.study.rules import Draft


class ClimbOptions(Frozen):
    """Steps towards the target between screening and surface.

    Steps end at the limits of the ranges; active factors without a size move in proportion to their slopes.
    """

    steps: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Number of steps from the centre to the limits of the ranges."""
    step_sizes: dict[str, Annotated[Number, Field(gt=0)]] = {}
    """Step of each factor in its unit; `steps` is then the maximum number."""
    at_once: Flag = False
    """Whether all steps are run at once, including those beyond the target: fewer rounds for runs by hand or many
    cores. The mean of the screening then gives the direction."""


def _follows_a_slope(draft: Draft) -> Iterator[Finding]:
    """Without a screening there is no slope to climb along."""
    if not is_screened(draft.study) and draft.study.given(ClimbOptions) is not None:
        yield Finding(
            ("climb",),
            "climb follows the slope of a screening, which this study does not have",
            "remove screen.design: none",
        )


def _steps_stay_inside(draft: Draft) -> Iterator[Finding]:
    """`climb.step_sizes` are those of factors, and the first step stays in their ranges."""
    known = {factor.name: factor for factor in draft.factors.values()}
    for name, size in draft.study.of(ClimbOptions).step_sizes.items():
        path = ("climb", "step_sizes", name)
        if name not in draft.names:
            yield draft.unknown_factor(path, name)
        elif name in known and size > known[name].half_range * (1.0 + 1e-9):
            factor = known[name]
            message = f"a step of {size:g} from {factor.centre:g} leaves the range {factor.low:g} to {factor.high:g}"
            yield Finding(path, message, f"use at most {factor.half_range:g}")


RULES = (_follows_a_slope, _steps_stay_inside)
