"""The section `goal` of a spec, instead of `targets`: responses to minimise or maximise, and limits of responses."""

from collections.abc import Mapping
from math import nan
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError, ValidationInfo, WithJsonSchema
from pydantic_core import InitErrorDetails, PydanticCustomError

from stemcal.formats import did_you_mean
from stemcal.responses import CUT, responses_in
from stemcal.study.model.measured_targets import Mean, Target
from stemcal.study.types.field_types import Frozen, Quantity, complain
from stemcal.study.types.named import as_written, quantity
from stemcal.study.types.units import parse_unit
from stemcal.vocabulary import CUTTING, FIRST, Variable, Vocabulary

_NAMES = WithJsonSchema({"type": "array", "items": {"type": "string"}, "minItems": 1})
_VALUE = {"anyOf": [{"type": "string"}, {"type": "number"}]}
_LIMITS = WithJsonSchema({"type": "object", "additionalProperties": _VALUE})


def _response(name: Any, naming: Vocabulary) -> Variable:
    match = next((response for response in naming.responses if response.name == name), None)
    if match is None:
        known = [response.name for response in naming.responses]
        known += [each.name for each in responses_in(CUT) if naming.is_cutting and each.name not in known]
        raise complain(f"{str(name)[:60]!r} is not a response of this study", did_you_mean(str(name), known))
    return match


def _key(named: Variable, naming: Vocabulary) -> str:
    return FIRST if named == naming.response else named.name


def _listed(raw: Any, info: ValidationInfo) -> Any:
    if info.context is not None and (not isinstance(raw, list) or not raw):
        raise complain("the value is not a list of responses", "write a list, such as `[force]`")
    return raw


def _keyed(name: Any, info: ValidationInfo) -> Any:
    if info.context is None:
        return name
    naming = info.context.get("naming", CUTTING)
    return _key(_response(name, naming), naming)


def _limits(raw: Any, info: ValidationInfo) -> Any:
    if info.context is None:
        return raw
    if not isinstance(raw, Mapping):
        raise complain("the limits are not a mapping", "write a mapping, such as `{force: 150 N}`")
    naming, limits, wrong = info.context.get("naming", CUTTING), {}, []
    for name, value in raw.items():
        try:
            named = _response(name, naming)
            if naming.is_cutting:
                kind = Quantity(parse_unit(named.unit).dimension, above=0.0, unit=named.unit)
                limits[_key(named, naming)] = as_written(kind.checked(value, from_yaml=True), named.unit)
            else:
                limits[_key(named, naming)] = quantity(value, named)
        except PydanticCustomError as error:
            wrong.append(InitErrorDetails(type=error, loc=(str(name),), input=value))
    if wrong:
        raise ValidationError.from_exception_data("at_most", wrong)
    return limits


_Key = Annotated[str, BeforeValidator(_keyed)]


class GoalSection(Frozen):
    """Goal of the study, instead of `targets`: one response to optimise, or two whose Pareto front is computed.

    A study with a goal has the stages `screen`, `rsm` and `optimise`, at the diameter `specimen.outer_diameter`.
    """

    minimise: Annotated[tuple[_Key, ...], BeforeValidator(_listed), _NAMES] = ()
    """Responses to minimise, such as `[cutting_energy, force]`."""
    maximise: Annotated[tuple[_Key, ...], BeforeValidator(_listed), _NAMES] = ()
    """Responses to maximise."""
    at_most: Annotated[dict[str, float], BeforeValidator(_limits), _LIMITS] = Field(default={})
    """Largest allowed values of responses, such as `{force: 150 N}`."""

    @property
    def signs(self) -> dict[str, float]:
        """Sign of each optimised response, by name: 1 to minimise, −1 to maximise."""
        return {**dict.fromkeys(self.minimise, 1.0), **dict.fromkeys(self.maximise, -1.0)}

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the responses that require a response surface; `FIRST` is always among them."""
        return tuple(dict.fromkeys((FIRST, *self.signs, *self.at_most)))

    def unmeasured(self, condition: float) -> Target:
        """Return a target with NaN for all measured values; it defines the condition and responses of the surfaces."""
        further = {name: Mean.model_construct(value=nan) for name in self.responses if name != FIRST}
        return Target.model_construct(condition=condition, response=nan, further=further)
