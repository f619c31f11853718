"""What every section of a spec is made of."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from stemcal.study.types.field_types import Number, Quantity

Size = Annotated[float, Quantity("length", above=0)]
SizeOrZero = Annotated[float, Quantity("length", at_least=0)]
Time = Annotated[float, Quantity("time", above=0)]
Flag = Annotated[bool, Field(strict=True)]
Share = Annotated[Number, Field(gt=0, le=1)]


class Frozen(BaseModel):
    """Immutable, no unknown keys, finite numbers only."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
