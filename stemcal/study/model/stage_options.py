"""Options of the stages, from the designs to the refinement."""

import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, WithJsonSchema
from pydantic_core import PydanticKnownError

from stemcal.naming import FIRST
from stemcal.registry import surface_designs
from stemcal.study.model.factor import MOST_FACTORS, Flag, Frozen, Time
from stemcal.study.model.solver_kind import AnySolver
from stemcal.study.types.field_types import Number, StemLengthOrZero, Whole, complain
from stemcal.study.types.named import OwnCondition, responses_by_name

_FIELD_NAMES = {"PB": "plackett-burman", "CCD": "central-composite", "BBD": "box-behnken"}


def _in_full(given: Any) -> Any:
    """Return the name of a design for what the field calls it."""
    return _FIELD_NAMES.get(given.upper(), given) if isinstance(given, str) else given


ScreeningDesign = Literal["plackett-burman", "fractional-factorial", "full-factorial", "none"]


def _names_of(known: Sequence[str]) -> dict[str, Any]:
    """Return the JSON schema of a design's name: in full, or what the field calls it."""
    return {"enum": [*known, *(short for short, name in _FIELD_NAMES.items() if name in known)], "type": "string"}


class _OfSurfaces:
    """The JSON schema of the name of a surface's design, read from the list of designs where it is wanted."""

    def __get_pydantic_json_schema__(self, _schema: Any, _handler: Any) -> dict[str, Any]:
        return _names_of([design.name for design in surface_designs().all])


def _surface_design(given: Any) -> str:
    """Return the name of a design for the surface that exists, here or in another package."""
    name = _in_full(given)
    if isinstance(name, str) and surface_designs().named(name) is not None:
        return name
    *others, last = (repr(design.name) for design in surface_designs().all)
    raise PydanticKnownError("literal_error", {"expected": f"{', '.join(others)} or {last}"})


class ScreenOptions(Frozen):
    """The screening design and its significance level.

    PB is plackett-burman. With none there is no screening: `rsm.factors` lists the factors of the surface.
    """

    design: Annotated[
        ScreeningDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(get_args(ScreeningDesign)))
    ] = "plackett-burman"
    """The design of the screening."""
    centre_points: Annotated[Whole, Field(ge=0, le=50)] = 0
    """Runs at the centre of all ranges, which show curvature and scatter."""
    runs: Annotated[Whole, Field(ge=4, le=512)] | None = None
    """Number of runs instead of the default: Plackett–Burman has 12 for 5 to 11 factors."""
    fold_over: Flag = False
    """Repeat every run with all signs reversed: main effects are then clear of two-factor interactions."""
    alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.05
    """Significance level; factors with a smaller p are significant."""


_STRONGEST = r"strongest ([1-9][0-9]?)"


def _chosen_or_names(given: Any) -> Any:
    if isinstance(given, list | tuple) or given == "significant":
        return given
    if isinstance(given, str) and re.fullmatch(_STRONGEST, " ".join(given.split())):
        return " ".join(given.split())
    message = "should be 'significant', 'strongest 3' or a list of factor names"
    raise complain(message, "write factors: significant")


def strongest_asked(factors: str | tuple[str, ...]) -> int:
    """Return how many of the strongest factors `rsm.factors` asks for; 0 for other values.

    >>> strongest_asked("strongest 3"), strongest_asked("significant")
    (3, 0)
    """
    found = re.fullmatch(_STRONGEST, factors) if isinstance(factors, str) else None
    return int(found[1]) if found else 0


def factors_taken(design: str) -> tuple[int, int]:
    """Return how few and how many factors a design for the surface takes."""
    found = surface_designs().named(design)
    return (2, MOST_FACTORS) if found is None else found.factors


AlphaRule = Literal["rotatable", "face", "spherical", "orthogonal", "practical"]


def _axial_distance(given: Any) -> Any:
    number = isinstance(given, int | float) and not isinstance(given, bool)
    if given in get_args(AlphaRule) or (number and 0 < given <= 100):
        return given
    shown = f"{given:g}" if number else repr(given)[:60]
    raise complain(f"{shown} is no axial distance", f"write {', '.join(get_args(AlphaRule))} or a number above 0")


class RsmOptions(Frozen):
    """The design of the response surface and its terms.

    CCD is central-composite, BBD is box-behnken.
    """

    design: Annotated[str, BeforeValidator(_surface_design), _OfSurfaces()] = "central-composite"
    """The design. Box–Behnken requires 3 to 7 factors, full-factorial at most 7, others any number. From five factors
    on, central-composite uses a fraction of the corners that estimates the same terms (resolution V)."""

    factors: Annotated[
        str | tuple[str, ...],
        BeforeValidator(_chosen_or_names),
        WithJsonSchema(
            {
                "anyOf": [
                    {"const": "significant"},
                    {"type": "string", "pattern": f"^{_STRONGEST}$"},
                    {"type": "array", "items": {"type": "string"}},
                ]
            }
        ),
    ] = "significant"
    """The significant factors of the screening, its `strongest 3`, or a list of names without a screening."""
    centre_points: Annotated[Whole, Field(ge=0, le=100)] = 6
    """Runs at the centre. The embedded solver is deterministic, so further runs add no information."""
    alpha: Annotated[
        AlphaRule | float,
        BeforeValidator(_axial_distance),
        WithJsonSchema({"anyOf": [{"enum": list(get_args(AlphaRule))}, {"type": "number", "minimum": 0}]}),
    ] = "rotatable"
    """Distance of the axial points from the centre, by a rule or in coded units."""
    runs: Annotated[Whole, Field(ge=6, le=10_000)] | None = None
    """Number of runs of a Latin hypercube."""
    extra_runs: Annotated[Whole, Field(ge=0, le=200)] = 0
    """Further runs where the surface is least certain. A larger number reuses the runs made before."""
    reduce: Literal["none", "backward"] = "none"
    """`backward` removes terms with p above 0.1, one by one; the hierarchy of terms is kept."""
    coding: dict[str, tuple[Number, Number]] = {}
    """Values at coded −1 and +1 by factor, as in `yield_stress: [12, 18]`; other factors use their range."""

    def coded(self, name: str) -> tuple[float, float]:
        """Return centre and half step of a factor in `coding`."""
        low, high = self.coding[name]
        return float(f"{0.5 * (low + high):.12g}"), float(f"{0.5 * (high - low):.12g}")


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
    """Rule that selects one of the solutions: the nearest to the centre, or the one with all factors
    but the strongest at their centre."""
    conditions: Literal["all"] | Annotated[tuple[AtSize, ...], Field(min_length=1)] | None = Field(
        default=None, validation_alias="diameters", serialization_alias="diameters"
    )
    """The diameters, or other conditions, that are fitted: `all` or a list. With several the surface's design is run at
    each. By default `specimen.outer_diameter` if it was measured, otherwise the first row of `targets`. The parameters
    are calibrated at the first of a list."""
    responses: Responses = (FIRST,)
    """What is fitted: only the force, or also travel and work to the maximum."""


class ValidateOptions(Frozen):
    """The comparison with what was measured."""

    tolerance_percent: Annotated[Number, Field(gt=0, lt=100)] = 10.0
    """Largest error at which simulated and measured response agree."""


class ClimbOptions(Frozen):
    """Steps towards the target between screening and surface.

    Steps end at the ends of the ranges; active factors without a size move in proportion to their slopes.
    """

    steps: Annotated[Whole, Field(ge=1, le=50)] = 5
    """Number of steps from the centre to the ends of the ranges."""
    step_sizes: dict[str, Annotated[Number, Field(gt=0)]] = {}
    """Step of each factor in its unit; `steps` is then the maximum number."""
    at_once: Flag = False
    """Whether all steps are run at once, also those beyond the target: fewer rounds for runs by hand or many cores. The
    mean of the screening then gives the direction."""


class RunsOptions(Frozen):
    """Time limit of a run, and the number that must succeed."""

    time_limit: Time | None = None
    """Time limit of one run, from its start; unlimited by default."""
    quorum: Annotated[Number, Field(ge=0, le=1)] = 0.5
    """Fraction of the runs of a stage that must succeed."""


_NAMES = {"type": "array", "items": {"type": "string"}}
_RANGE = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_RANGES = {"type": "object", "additionalProperties": {"anyOf": [_RANGE, {"type": "null"}]}}


def _by_name(given: Any) -> Any:
    """Accept a list of names as a mapping without ranges."""
    if not isinstance(given, list) or not all(isinstance(name, str) for name in given):
        return given
    if twice := [name for name in given if given.count(name) > 1]:
        raise complain(f"{twice[0][:60]} is listed twice", "remove one")
    return dict.fromkeys(given)


class RefineOptions(Frozen):
    """Simulate the solution and correct it until the response is within the tolerance."""

    in_: AnySolver | None = Field(default=None, validation_alias="in", serialization_alias="in")
    """The program or mesh in which the parameters will be used: any solver with its keys, also `embedded` with another
    mesh. Omitted keys are those of the study if its solver has the same kind. By default the study's own model."""
    internal_length: StemLengthOrZero | None = None
    """`material.internal_length` in `in`; `0 mm` for local failure."""
    edge_spread: StemLengthOrZero | None = None
    """`blade.edge_spread` in `in`; `0 mm` for a sharp edge."""
    duration: Time | None = None
    """`loading.duration` in `in`: without lengths the same force may require a longer stroke."""
    adjust: Annotated[
        dict[str, tuple[Number, Number] | None],
        BeforeValidator(_by_name),
        WithJsonSchema(
            {"anyOf": [_NAMES, {"type": "object", "additionalProperties": {"anyOf": [_RANGE, {"type": "null"}]}}]}
        ),
    ] = {}
    """Factors that may change in `in`, in this order: names, or `name: [low, high]`. By default the failure strain if
    the surface has it, otherwise the strongest factor. By default a factor keeps the range of the study; the failure
    strain may change from a tenth of its lower end to 1."""
    tolerance_percent: Annotated[Number, Field(gt=0, le=50)] = 1.0
    """Largest error of the simulated response at the solution."""
    budget: Annotated[Whole, Field(ge=1, le=1000)] = 10
    """Maximum number of runs. With `in`, remaining runs simulate the other measured conditions."""

    @property
    def changes(self) -> dict[str, dict[str, object]]:
        """What is different in the test simulated by `in`, by section and key."""
        keys = (("material", "internal_length"), ("blade", "edge_spread"))
        found = {section: {key: value} for section, key in keys if (value := getattr(self, key)) is not None}
        return found | ({"loading": {"duration": self.duration, "stroke": None}} if self.duration is not None else {})

    @property
    def elsewhere(self) -> bool:
        """Whether the parameters are used in another model than the study's own."""
        return self.in_ is not None

    def solver_there(self, own: Any) -> Any:
        """Return the solver of `in`, completed by the study's own of the same kind."""
        if self.in_ is None or own.kind != self.in_.kind:
            return self.in_ or own
        return own.model_copy(update={name: getattr(self.in_, name) for name in self.in_.model_fields_set})
