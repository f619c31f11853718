"""The section of the screening."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from stemcal.study.types.field_types import Flag, Frozen, Number, Whole

if TYPE_CHECKING:
    from stemcal.study.model import Study

ScreeningDesign = Literal["plackett-burman", "fractional-factorial", "full-factorial", "none"]


class ScreenOptions(Frozen):
    """The screening design and its significance level.

    With the design `none` there is no screening: `rsm.factors` lists the factors of the surface.
    """

    design: ScreeningDesign = "plackett-burman"
    """The design of the screening."""
    centre_points: Annotated[Whole, Field(ge=0, le=50)] = 0
    """Runs at the centre of all ranges, which reveal curvature and scatter."""
    runs: Annotated[Whole, Field(ge=4, le=512)] | None = None
    """Number of runs instead of the default: Plackett–Burman has 12 for 5 to 11 factors."""
    fold_over: Flag = False
    """Repeat every run with all signs reversed: main effects are then clear of two-factor interactions."""
    alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.05
    """Significance level; factors with a smaller p are significant."""


def is_screened(study: Study) -> bool:
    """Whether the study begins with a screening."""
    return study.of(ScreenOptions).design != "none"
