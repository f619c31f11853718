"""The `validate` section."""

from typing import Annotated

from pydantic import Field

from stemcal.study.types.field_types import Frozen, Number


class ValidateOptions(Frozen):
    """Comparison of simulated and measured responses."""

    tolerance_percent: Annotated[Number, Field(gt=0, lt=100)] = 10.0
    """Largest error, in percent, at which simulated and measured responses are considered to agree."""
