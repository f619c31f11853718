"""The designs of the screening and of the response surface, and what is fitted to their runs."""

import re
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, WithJsonSchema

from stemcal.study.model.factor import MOST_FACTORS
from stemcal.study.model.frozen import Flag, Frozen
from stemcal.study.types.field_types import Number, Whole, complain

_FIELD_NAMES = {
    "PB": "plackett-burman",
    "CCD": "central-composite",
    "BBD": "box-behnken",
    "DSD": "definitive-screening",
}


def _in_full(given: Any) -> Any:
    """Return the name of a design for what the field calls it."""
    return _FIELD_NAMES.get(given.upper(), given) if isinstance(given, str) else given


ScreeningDesign = Literal[
    "plackett-burman", "plackett-burman-pydoe", "fractional-factorial", "full-factorial", "definitive-screening", "none"
]
SurfaceDesign = Literal["central-composite", "box-behnken", "full-factorial", "latin-hypercube", "sobol", "i-optimal"]


def _names_of(designs: Any) -> dict[str, Any]:
    """Return the JSON schema of a design's name: in full, or what the field calls it."""
    known = get_args(designs)
    return {"enum": [*known, *(short for short, name in _FIELD_NAMES.items() if name in known)], "type": "string"}


class ScreenOptions(Frozen):
    """The screening design, what its effects are tested against, and the significance level that keeps a factor.

    PB stands for plackett-burman, DSD for definitive-screening. With none there is no screening: `rsm.factors` names
    the factors of the surface.
    """

    design: Annotated[ScreeningDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(ScreeningDesign))] = (
        "plackett-burman"
    )
    """The design; `stemcal plan` tells what it can find."""
    centre_points: Annotated[Whole, Field(ge=0, le=50)] = 0
    """Runs in the middle of all ranges: they tell whether the response is curved, and its scatter."""
    runs: Annotated[Whole, Field(ge=4, le=512)] | None = None
    """Another number of runs than the usual one: of Plackett–Burman 12 for 5 to 11 factors."""
    fold_over: Flag = False
    """Repeat every run with all signs turned: main effects clear of two-factor interactions."""
    error: Literal["residual", "pooled", "replicates", "lenth"] = "residual"
    """What effects are tested against: columns without a factor, those pooled with small effects, repeated runs, or
    Lenth's pseudo standard error."""
    alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.05
    """A factor whose p is below goes on to the surface."""


class CodingEntry(Frozen):
    """Coded 0 and coded 1 of one factor: centre, and centre + half step, in the factor's unit."""

    center: Number
    """The value that coded 0 means, in the factor's unit."""
    half_step: Annotated[Number, Field(gt=0)]
    """What coded +1 is above it."""


_STRONGEST = r"strongest ([1-9][0-9]?)"


def _chosen_or_names(given: Any) -> Any:
    if isinstance(given, list | tuple) or given == "significant":
        return given
    if isinstance(given, str) and re.fullmatch(_STRONGEST, " ".join(given.split())):
        return " ".join(given.split())
    message = "should be 'significant', 'strongest 3' or a list of factor names"
    raise complain(message, "write factors: significant")


def strongest_asked(factors: str | tuple[str, ...]) -> int:
    """Return how many of the strongest factors `rsm.factors` asks for; 0 where it says something else.

    >>> strongest_asked("strongest 3"), strongest_asked("significant")
    (3, 0)
    """
    found = re.fullmatch(_STRONGEST, factors) if isinstance(factors, str) else None
    return int(found[1]) if found else 0


def factors_taken(design: str) -> tuple[int, int]:
    """Return how few and how many factors a design for the surface takes."""
    return (3, 7) if design == "box-behnken" else (2, MOST_FACTORS)


AlphaRule = Literal["rotatable", "face", "spherical", "orthogonal", "practical"]


def _axial_distance(given: Any) -> Any:
    number = isinstance(given, int | float) and not isinstance(given, bool)
    if given in get_args(AlphaRule) or (number and 0 < given <= 100):
        return given
    shown = f"{given:g}" if number else repr(given)[:60]
    raise complain(f"{shown} is no axial distance", f"write {', '.join(get_args(AlphaRule))} or a number above 0")


def _batches(given: Any) -> Any:
    for count in given if isinstance(given, list | tuple) and 1 <= len(given) <= 20 else [given]:
        if not isinstance(count, int) or isinstance(count, bool) or not 0 <= count <= 200:
            remedy = "write a whole number up to 200, or a list of them"
            raise complain(f"{str(count)[:60]} is not a number of runs", remedy)
    return given


ExtraRuns = Annotated[
    int | tuple[int, ...],
    BeforeValidator(_batches),
    WithJsonSchema(
        {"anyOf": [{"type": "integer", "minimum": 0}, {"type": "array", "items": {"type": "integer", "minimum": 0}}]}
    ),
]


class Constraint(Frozen):
    """Σ coefficient·level ≤ `at_most`, in the units of the factors."""

    of: Annotated[dict[str, Number], Field(min_length=1)]
    """A coefficient for each factor in it."""
    at_most: Number
    """What the sum of coefficients times levels may not exceed."""


class RsmOptions(Frozen):
    """The design behind the response surface, and the terms that are fitted.

    CCD stands for central-composite, BBD for box-behnken.
    """

    design: Annotated[SurfaceDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(SurfaceDesign))] = (
        "central-composite"
    )
    """The design; all but Box–Behnken (3 to 7 factors) take any number of factors."""

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
    """The significant ones of the screening, `strongest 3` of it, or a list of names, which makes the screening
    unnecessary for it."""
    centre_points: Annotated[Whole, Field(ge=0, le=100)] = 6
    """Runs at the centre. The embedded solver gives the same force each time: one teaches as much as six."""
    alpha: Annotated[
        AlphaRule | float,
        BeforeValidator(_axial_distance),
        WithJsonSchema({"anyOf": [{"enum": list(get_args(AlphaRule))}, {"type": "number", "minimum": 0}]}),
    ] = "rotatable"
    """How far the axial points lie out, by a rule or in coded units."""
    core: Literal["full", "fractional"] = "full"
    """All corners, or a fraction of them from five factors on."""
    runs: Annotated[Whole, Field(ge=6, le=10_000)] | None = None
    """Number of runs of the space-filling designs."""
    seed: Annotated[Whole, Field(ge=0, le=2**31)] = 0
    """Seed of the space-filling designs."""
    extra_runs: ExtraRuns = 0
    """Further runs where they teach most (D-optimal); a list adds batch after batch."""
    axial: Annotated[Number, Field(gt=0, le=100)] | None = None
    """Adds axial points at this coded distance."""
    blocks: Literal["none", "orthogonal"] = "none"
    """`orthogonal` splits a composite into corners and axial points, each with a level of its own."""
    weights: Literal["equal", "phases"] = "equal"
    """`phases` lets runs of small scatter over `solver.phases` count more."""
    inestimable: Literal["refuse", "drop"] = "refuse"
    """Whether terms that failed runs have made inestimable are left out or end the fit."""
    reduce: Literal["none", "backward", "forward", "aicc"] = "none"
    """How terms are left out: none, backward, forward or by AICc; hierarchy is kept."""
    reduce_alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.1
    """The p from which backward and forward leave a term out."""
    sums_of_squares: Literal["partial", "sequential"] = "partial"
    """What a term of the analysis of variance is asked to explain: what all other terms leave (type III), or what
    the terms before it leave (type I, in the order of `factors`)."""
    constraints: Annotated[tuple[Constraint, ...], Field(max_length=20)] = ()
    """What an I-optimal design and the solution have to keep to, in the units of the factors."""
    coding: dict[str, CodingEntry] = {}
    """What coded 0 and +1 mean, by factor; others get theirs from their range."""
