"""What a deck of stemcal's keeps in comments: what belongs to the model and has no card, the force it is to give."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from stemcal.errors import UsageError
from stemcal.solvers.deck.fixed_width import SETTINGS
from stemcal.study.model.frozen import Size, SizeOrZero, Time
from stemcal.study.types.field_types import Number


class Settings(BaseModel):
    """Values in mm, t, s and N; None is not given."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    edge_spread: SizeOrZero = 0.0
    edge_radius: SizeOrZero | None = None
    blade_length: Size | None = None
    density_factor: Annotated[Number, Field(ge=1)] = 1.0
    hardening_parameter: Number | None = None
    strain_rate_c: Annotated[Number, Field(gt=0)] | None = None
    strain_rate_p: Annotated[Number, Field(gt=0)] | None = None
    rate_law: Literal["paper", "cowper_symonds", "none"] | None = None
    mass_scaling: Annotated[Number, Field(ge=1)] = 1.0
    filter_window: Annotated[Number, Field(ge=0)] | None = None
    break_drop: Annotated[Number, Field(gt=0, le=1)] | None = None
    internal_length: SizeOrZero = 0.0
    time_step: Time | None = None
    stop_after_peak: Annotated[bool, Field(strict=True)] | None = None
    speed: Size | None = None
    gap: SizeOrZero = 0.0
    force_to_give: Size | None = None


def settings_of(text: str) -> Settings:
    """Return what the comments of a deck keep; without them, nothing is set.

    Raises
    ------
    UsageError
        If they hold anything else than these values within their bounds.
    """
    lines = [line for line in text.splitlines() if line.startswith(SETTINGS)]
    if not lines:
        return Settings()
    try:
        return Settings.model_validate_json(" ".join(line.removeprefix(SETTINGS) for line in lines))
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])[:40]
        what = f"{where!r}: {first['msg'][:200]!r}" if where else "they are not JSON"
        raise UsageError(
            f"the lines that begin with {SETTINGS.strip()} are damaged ({what}); remove them or mend them"
        ) from None
