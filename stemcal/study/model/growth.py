"""Values that depend on the stem diameter: a power of it, or values measured at several diameters."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, GetCoreSchemaHandler, ValidationError, WithJsonSchema
from pydantic_core import CoreSchema, InitErrorDetails, core_schema

from stemcal.errors import UsageError
from stemcal.study.types.field_types import Frozen, Length, Quantity, Size, complain

MOST_EXPONENT: Final = 20.0


def _exponent(raw: Any) -> Any:
    if isinstance(raw, str) and raw.isidentifier():
        return raw
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not abs(raw) <= MOST_EXPONENT:
        message = f"the exponent is neither a number from -{MOST_EXPONENT:g} to {MOST_EXPONENT:g} nor a factor"
        raise complain(message, "write a number, as in `exponent: 0.5`, or the name of a factor")
    return float(raw)


class Growth(Frozen):
    """A material parameter that is a power of the diameter: value at `at` times (diameter / at)^exponent."""

    at: Size
    """Reference diameter: at this diameter, the parameter equals `value` or the level of its factor."""
    exponent: Annotated[
        float | str,
        BeforeValidator(_exponent),
        WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "description": "Name of a factor."}]}),
    ]
    """Exponent of the diameter: a number, or the name of a factor to calibrate."""
    value: Any = None
    """Value of the parameter at the reference diameter; omit `value` if the parameter is a factor."""

    def parameter_at(self, diameter: float, level: float | None, factors: Mapping[str, float]) -> float:
        """Return the parameter at a stem diameter d (mm), value·(d/at)^exponent, in internal units.

        If the parameter is a factor, `level` replaces `value`. If the exponent is a factor, `factors` has its level.
        """
        value = self.value if level is None else level
        exponent = factors[self.exponent] if isinstance(self.exponent, str) else self.exponent
        try:
            return float(value * (diameter / self.at) ** exponent)
        except OverflowError:
            return math.inf


@dataclass(frozen=True)
class Interpolated:
    """Values measured at several stem diameters (mm, ascending), interpolated linearly and not extrapolated."""

    points: tuple[tuple[float, float], ...]

    def covers(self, diameter: float) -> bool:
        """Check that a stem diameter (mm) is within the measured range."""
        return self.points[0][0] - _SAME < diameter < self.points[-1][0] + _SAME

    def at(self, diameter: float) -> float:
        """Return the value at a stem diameter, mm; raise `UsageError` outside the measured range."""
        if not self.covers(diameter):
            raise UsageError(f"a diameter of {diameter:g} mm is outside the measured range ({self.range})")
        for (low, first), (high, second) in pairwise(self.points):
            if diameter <= high:
                share = min(max((diameter - low) / (high - low), 0.0), 1.0)
                return round(first + share * (second - first), 12)
        return self.points[-1][1]

    @property
    def range(self) -> str:
        ends = dict.fromkeys((f"{self.points[0][0]:g}", f"{self.points[-1][0]:g}"))
        return f"{' to '.join(ends)} mm"


_SAME: Final = 1e-6  # diameters that differ by less than this count as equal, mm


@dataclass(frozen=True)
class OverDiameter:
    """Type of a field that is a `plain` number or length, a `Growth` or (unless `only_grows`) an `Interpolated`."""

    plain: Any
    only_grows: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        plain = handler.generate_schema(self.plain)
        forms = [plain, handler.generate_schema(Growth)]
        if not self.only_grows:
            forms.append(core_schema.dict_schema(core_schema.str_schema(), plain))
        return core_schema.json_or_python_schema(
            # this branch serves only to list all forms of the value in the JSON schema
            json_schema=core_schema.with_info_wrap_validator_function(self._read, core_schema.union_schema([*forms])),
            python_schema=core_schema.with_info_wrap_validator_function(self._read, plain),
            serialization=core_schema.plain_serializer_function_ser_schema(_written),
        )

    def _read(self, raw: Any, plain: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo) -> Any:
        if isinstance(raw, Growth | Interpolated):
            return raw
        if not isinstance(raw, Mapping):
            return plain(raw)
        if self.only_grows or raw.keys() & Growth.model_fields.keys():
            grown = Growth.model_validate(raw, context=info.context)
            if isinstance(grown.exponent, str) and not self.only_grows:
                wrong = complain(f"the exponent {grown.exponent!r} is not a number", "write a number, such as 2")
                entry = InitErrorDetails(type=wrong, loc=("exponent",), input=raw)
                raise ValidationError.from_exception_data("exponent", [entry])
            value = None if grown.value is None else _in_mm(plain(grown.value), grown.at)
            return grown.model_copy(update={"value": value})
        points = {}
        for key, value in raw.items():
            if not isinstance(key, str):
                raise complain(f"{key} is not a diameter with a unit", "write lines such as `8 mm: 0.5 mm`")
            if (diameter := _DIAMETER.read(key, info)) in points:
                raise complain(f"the diameter {key} is given twice", "remove one of the lines")
            points[diameter] = value
        if not points:
            raise complain("no diameter is given", "write lines such as `8 mm: 0.5 mm`")
        return Interpolated(tuple((d, _in_mm(plain(value), d)) for d, value in sorted(points.items())))


_DIAMETER: Final = Quantity("length", above=0)


def _in_mm(value: Any, diameter: float) -> float:
    return float(value.at(diameter) if isinstance(value, Length) else value)


def _written(value: Any) -> Any:
    if isinstance(value, Interpolated):
        return {f"{diameter:g} mm": at_diameter for diameter, at_diameter in value.points}
    if isinstance(value, Growth):
        return value.model_dump(mode="json")
    return str(value) if isinstance(value, Length) else value


def value_at(value: Any, diameter: float, level: float | None, factors: Mapping[str, float]) -> float | None:
    """Return a parameter at a stem diameter (mm), from its value in a spec or from its `level`; None without both.

    `factors` are the levels of all factors, for a `Growth` whose exponent is one of them.
    """
    if isinstance(value, Growth):
        return value.parameter_at(diameter, level, factors)
    if level is not None or value is None:
        return level
    return float(value.at(diameter) if isinstance(value, Length | Interpolated) else value)
