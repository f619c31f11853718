"""The `screen` section."""

from typing import Annotated, Literal

from pydantic import Field

from stemcal.study.types.field_types import Flag, Frozen, Number, Whole

_ScreeningDesign = Literal["plackett-burman", "fractional-factorial", "full-factorial", "none"]


class ScreenOptions(Frozen):
    """The screening design and its significance level.

    If `design` is `none`, list the factors of the response surface in `rsm.factors`.
    """

    design: _ScreeningDesign = "plackett-burman"
    """The design of the screening."""
    centre_points: Annotated[Whole, Field(ge=0, le=50)] = 0
    """Number of runs at the centre of all ranges, to detect curvature and estimate the scatter."""
    runs: Annotated[Whole, Field(ge=4, le=512)] | None = None
    """Number of runs. The default for a Plackett–Burman design is 12 runs for 5 to 11 factors."""
    fold_over: Flag = False
    """Whether every run is repeated with reversed signs, so that main effects are not aliased with two-factor
    interactions."""
    alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.05
    """Significance level. Factors with a smaller p-value are significant."""

    @property
    def wanted(self) -> bool:
        """Whether the study has a screening."""
        return self.design != "none"
