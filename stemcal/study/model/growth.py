"""Material parameters that follow the stem: a power of its diameter, or a table by grade."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, GetCoreSchemaHandler, WithJsonSchema
from pydantic_core import CoreSchema, core_schema

from stemcal.errors import UsageError
from stemcal.study.types.field_types import Frozen, Quantity, Size, complain

MOST_EXPONENT: Final = 20.0
_DIAMETER = Quantity("length", above=0)


def _exponent(given: Any) -> Any:
    if isinstance(given, str) and given.isidentifier():
        return given
    if isinstance(given, bool) or not isinstance(given, int | float) or not abs(given) <= MOST_EXPONENT:
        raise complain("should be a number or the name of a factor", "write exponent: 0.5, or the name of a factor")
    return float(given)


class Growth(Frozen):
    """A material parameter that is a power of the diameter: value at `at` times (diameter / at)^exponent."""

    at: Size
    """Diameter at which the parameter has its value, or the level of the factor with its name."""
    exponent: Annotated[
        float | str,
        BeforeValidator(_exponent),
        WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "description": "the name of a factor"}]}),
    ]
    """Exponent: a number, or the name of a factor, which is then calibrated with the others."""
    value: Any = None
    """Value at that diameter; omit it if the parameter is a factor."""

    def given_at(self, diameter: float, level: float | None, factors: Mapping[str, float]) -> float:
        """Return value·(d/at)^exponent; `level` is the value of a parameter that is a factor."""
        value = self.value if level is None else level
        exponent = factors[self.exponent] if isinstance(self.exponent, str) else self.exponent
        try:
            return float(value * (diameter / self.at) ** exponent)
        except OverflowError:
            return math.inf

    @property
    def known_between(self) -> tuple[float, float]:
        """The diameters between which it is known."""
        return 0.0, float("inf")


@dataclass(frozen=True)
class Grades:
    """A material parameter by grades of the stem, (diameter, value) in rising order; linear between them.

    >>> Grades(((7.0, 17.0), (9.0, 19.0))).given_at(8.0, None, {})
    18.0
    """

    rows: tuple[tuple[float, float], ...]

    def given_at(self, diameter: float, _level: float | None, _factors: Mapping[str, float]) -> float:
        """Return the value at a diameter; raise `UsageError` outside the grades."""
        low, high = self.known_between
        if not low * (1 - 1e-9) <= diameter <= high * (1 + 1e-9):
            message = f"a stem of {diameter:g} mm is outside the grades of a material parameter"
            raise UsageError(f"{message}, {low:g} to {high:g} mm; add a grade to its table under material")
        for (d0, v0), (d1, v1) in pairwise(self.rows):
            if diameter <= d1 or d1 == high:
                return v0 + (v1 - v0) * (min(max(diameter, d0), d1) - d0) / (d1 - d0)
        raise AssertionError("there are two grades or more")

    @property
    def known_between(self) -> tuple[float, float]:
        """The diameters between which it is known."""
        return self.rows[0][0], self.rows[-1][0]

    @property
    def value(self) -> float:
        """Value of the first grade."""
        return self.rows[0][1]


@dataclass(frozen=True)
class MayGrow:
    """Marks a parameter of the type `plain` that may also be a `Growth` or `Grades`, written as mappings."""

    plain: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def read(
            given: Any, one: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo
        ) -> float | Growth | Grades:
            if isinstance(given, Growth | Grades):
                return given
            if not isinstance(given, Mapping):
                return float(one(given))
            if not (given and all(str(key)[:1] in "+-.0123456789" for key in given)):  # keys of a table are numbers
                grown = Growth.model_validate(given, context=info.context)
                return grown.model_copy(update={"value": None if grown.value is None else one(grown.value)})
            rows = sorted((_DIAMETER.read(key, info), one(value)) for key, value in given.items())
            if len(rows) < 2 or any(d0 == d1 for (d0, _), (d1, _) in pairwise(rows)):
                raise complain("a table by grade needs at least two different diameters", "write {7 mm: …, 9 mm: …}")
            return Grades(tuple(rows))

        plain = handler.generate_schema(self.plain)
        grades = core_schema.dict_schema(core_schema.str_schema(), plain, min_length=2)
        forms = core_schema.union_schema([plain, handler.generate_schema(Growth), grades])
        return core_schema.json_or_python_schema(
            json_schema=core_schema.with_info_wrap_validator_function(read, forms),  # the JSON schema lists all
            python_schema=core_schema.with_info_wrap_validator_function(read, plain),
            serialization=core_schema.plain_serializer_function_ser_schema(_plainly),
        )


def exponents_in(growing: Iterable[Growth | Grades]) -> tuple[str, ...]:
    """Return the names of the factors that are exponents, each once."""
    named = (growth.exponent for growth in growing if isinstance(growth, Growth))
    return tuple(dict.fromkeys(exponent for exponent in named if isinstance(exponent, str)))


def _plainly(value: Any) -> Any:
    """Return a parameter as JSON has it."""
    if isinstance(value, Grades):
        return {f"{diameter:g} mm": one for diameter, one in value.rows}
    return value.model_dump(mode="json") if isinstance(value, Growth) else value
