"""Material parameters that are a power of the stem diameter."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, GetCoreSchemaHandler, WithJsonSchema
from pydantic_core import CoreSchema, core_schema

from stemcal.study.types.field_types import Frozen, Size, complain

MOST_EXPONENT: Final = 20.0


def _exponent(given: Any) -> Any:
    if isinstance(given, str) and given.isidentifier():
        return given
    if isinstance(given, bool) or not isinstance(given, int | float) or not abs(given) <= MOST_EXPONENT:
        message = f"the exponent is neither a number from -{MOST_EXPONENT:g} to {MOST_EXPONENT:g} nor a factor"
        raise complain(message, "write a number, as in `exponent: 0.5`, or the name of a factor")
    return float(given)


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

    def given_at(self, diameter: float, level: float | None, factors: Mapping[str, float]) -> float:
        """Return value·(d/at)^exponent; `level` is the value of a parameter that is a factor."""
        value = self.value if level is None else level
        exponent = factors[self.exponent] if isinstance(self.exponent, str) else self.exponent
        try:
            return float(value * (diameter / self.at) ** exponent)
        except OverflowError:
            return math.inf


@dataclass(frozen=True)
class MayGrow:
    """Marks a parameter of the type `plain` that may also be a `Growth`, written as a mapping."""

    plain: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def read(
            given: Any, one: core_schema.ValidatorFunctionWrapHandler, info: core_schema.ValidationInfo
        ) -> float | Growth:
            if isinstance(given, Growth):
                return given
            if not isinstance(given, Mapping):
                return float(one(given))
            grown = Growth.model_validate(given, context=info.context)
            return grown.model_copy(update={"value": None if grown.value is None else one(grown.value)})

        plain = handler.generate_schema(self.plain)
        forms = core_schema.union_schema([plain, handler.generate_schema(Growth)])
        return core_schema.json_or_python_schema(
            json_schema=core_schema.with_info_wrap_validator_function(read, forms),  # the JSON schema lists both
            python_schema=core_schema.with_info_wrap_validator_function(read, plain),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value.model_dump(mode="json") if isinstance(value, Growth) else value
            ),
        )
