"""Calibration and what follows it: options of the stages behind the surface, and of every run."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from stemcal.naming import FIRST
from stemcal.study.model.frozen import Flag, Frozen, Time
from stemcal.study.types.field_types import Number, Whole
from stemcal.study.types.named import OwnCondition, responses_by_name

AtSize = Annotated[float, OwnCondition("length", above=0)]

Responses = Annotated[
    tuple[str, ...],
    BeforeValidator(responses_by_name),
    WithJsonSchema({"anyOf": [{"const": "all"}, {"type": "array", "items": {"type": "string"}}]}),
]


class InvertOptions(Frozen):
    """Which of the points that give the target is called the solution; with `conditions`, the joint fit over them.

    More `responses` than the force make a joint fit even of one diameter.
    """

    rule: Literal["least_coded_distance", "others_at_centre"] = "least_coded_distance"
    """Which of the points that give the force is the solution: the nearest to the centre, or the one with all factors
    but the strongest at their centre."""
    conditions: Literal["all"] | Annotated[tuple[AtSize, ...], Field(min_length=1)] | None = Field(
        default=None, validation_alias="diameters"
    )
    """The diameters, or other conditions, that are fitted: `all` or a list. With several the surface's design is run at
    each. By default `specimen.outer_diameter` if it was measured, otherwise the first row of `targets`. The parameters
    are calibrated at the first of a list."""
    responses: Responses = (FIRST,)
    """What is fitted: the force alone, or also travel and work to the maximum."""


class ValidateOptions(Frozen):
    """The comparison with what was measured."""

    tolerance_percent: Annotated[Number, Field(gt=0, lt=100)] = 10.0
    """Up to here a simulated force counts as equal to the measured one."""


class ClimbOptions(Frozen):
    """The walk towards the target between screening and surface.

    Steps of one's own end where the ranges do; active factors without a size go along in proportion to their slopes.
    """

    steps: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Steps from the middle to the edge of the ranges."""
    step_sizes: dict[str, Annotated[Number, Field(gt=0)]] = {}
    """Steps of one's own, in the units of the factors by their names; `steps` is then the most of them."""
    at_once: Flag = False
    """Whether all steps are run together, those behind the target too: fewer rounds where people do the runs, or many
    cores. The mean of the screening then tells which way to go."""


class RunsOptions(Frozen):
    """How long a run may take, and how many must succeed."""

    time_limit: Time | None = None
    """How long one run may take, counted from its start; as long as it needs by default."""
    quorum: Annotated[Number, Field(ge=0, le=1)] = 0.5
    """Share of a stage's runs that must succeed."""
