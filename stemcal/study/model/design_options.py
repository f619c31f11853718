"""The designs of the screening and of the response surface, and what is fitted to their runs."""

import re
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, WithJsonSchema

from stemcal.study.model.factor import MOST_FACTORS
from stemcal.study.model.frozen import Flag, Frozen
from stemcal.study.types.field_types import Number, Whole, complain

_FIELD_NAMES = {"PB": "plackett-burman", "CCD": "central-composite", "BBD": "box-behnken"}


def _in_full(given: Any) -> Any:
    """Return the name of a design for what the field calls it."""
    return _FIELD_NAMES.get(given.upper(), given) if isinstance(given, str) else given


ScreeningDesign = Literal["plackett-burman", "fractional-factorial", "full-factorial", "none"]
SurfaceDesign = Literal["central-composite", "box-behnken", "full-factorial", "latin-hypercube"]


def _names_of(designs: Any) -> dict[str, Any]:
    """Return the JSON schema of a design's name: in full, or what the field calls it."""
    known = get_args(designs)
    return {"enum": [*known, *(short for short, name in _FIELD_NAMES.items() if name in known)], "type": "string"}


class ScreenOptions(Frozen):
    """The screening design, and the significance level that keeps a factor.

    PB stands for plackett-burman. With none there is no screening: `rsm.factors` names the factors of the surface.
    """

    design: Annotated[ScreeningDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(ScreeningDesign))] = (
        "plackett-burman"
    )
    """The design of the screening."""
    centre_points: Annotated[Whole, Field(ge=0, le=50)] = 0
    """Runs in the middle of all ranges: they tell whether the response is curved, and its scatter."""
    runs: Annotated[Whole, Field(ge=4, le=512)] | None = None
    """Another number of runs than the usual one: of Plackett–Burman 12 for 5 to 11 factors."""
    fold_over: Flag = False
    """Repeat every run with all signs turned: main effects clear of two-factor interactions."""
    alpha: Annotated[Number, Field(gt=0, lt=1)] = 0.05
    """A factor whose p is below goes on to the surface."""


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


class RsmOptions(Frozen):
    """The design behind the response surface, and the terms that are fitted.

    CCD stands for central-composite, BBD for box-behnken.
    """

    design: Annotated[SurfaceDesign, BeforeValidator(_in_full), WithJsonSchema(_names_of(SurfaceDesign))] = (
        "central-composite"
    )
    """The design; all but Box–Behnken (3 to 7 factors) take any number of factors. From five factors on
    central-composite has a fraction of the corners that estimates the same terms (resolution V)."""

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
    runs: Annotated[Whole, Field(ge=6, le=10_000)] | None = None
    """Number of runs of a Latin hypercube."""
    extra_runs: Annotated[Whole, Field(ge=0, le=200)] = 0
    """Further runs where the surface is least certain. A larger number reuses the runs made before."""
    reduce: Literal["none", "backward"] = "none"
    """`backward` removes terms with p above 0.1, one by one; hierarchy is kept."""
    coding: dict[str, tuple[Number, Number]] = {}
    """The values that coded −1 and +1 mean, by factor, as in `yield_stress: [12, 18]`; others get theirs from their
    range."""

    def coded(self, name: str) -> tuple[float, float]:
        """Return centre and half step of a factor in `coding`."""
        low, high = self.coding[name]
        return float(f"{0.5 * (low + high):.12g}"), float(f"{0.5 * (high - low):.12g}")
