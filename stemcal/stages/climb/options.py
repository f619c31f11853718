"""The `climb` section."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from stemcal.stages.screen.options import ScreenOptions
from stemcal.study.types.field_types import Flag, Frozen, Whole
from stemcal.study.types.strict_yaml import Finding

if TYPE_CHECKING:
    from stemcal.study.rules import Draft


class ClimbOptions(Frozen):
    """Steps towards the target, between the screening and the response surface.

    The significant factors change in proportion to their effects, up to the limits of their ranges.
    """

    steps: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Number of steps from the centre to the limits of the factor ranges."""
    at_once: Flag = False
    """Whether all steps are simulated at once, including steps beyond the target. The mean response of the screening
    then determines whether the steps increase or decrease the response. Use this key for manual runs, or if many cores
    are available."""


def _follows_a_slope(draft: Draft) -> Iterator[Finding]:
    if not draft.study.of(ScreenOptions).wanted and draft.study.section(ClimbOptions) is not None:
        message = "steepest ascent requires a screening, which this study does not have"
        yield Finding(("climb",), message, "remove `screen.design: none`")


ClimbOptions.rules = (_follows_a_slope,)
