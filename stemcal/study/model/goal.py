"""What a study optimises instead of fitting measurements: responses to minimise or maximise, and limits."""

from collections.abc import Mapping
from math import nan
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

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
    found = next((one for one in naming.responses if one.name == name), None)
    if found is None:
        known = [one.name for one in naming.responses]
        known += [one.name for one in responses_in(CUT) if naming.is_cutting]
        raise complain(f"{str(name)[:60]!r} is not a response of this study", did_you_mean(str(name), known))
    return found


def _key(named: Variable, naming: Vocabulary) -> str:
    return FIRST if named == naming.response else named.name


def _listed(given: Any, info: ValidationInfo) -> Any:
    if info.context is not None and (not isinstance(given, list) or not given):
        raise complain("the value is not a list of responses", "write a list, such as `[force]`")
    return given


def _keyed(name: Any, info: ValidationInfo) -> Any:
    if info.context is None:
        return name
    naming = info.context.get("naming", CUTTING)
    return _key(_response(name, naming), naming)


def _limits(given: Any, info: ValidationInfo) -> Any:
    """Return limits by the keys of their responses, in the units of these."""
    if info.context is None:
        return given
    if not isinstance(given, Mapping):
        raise complain("the limits are not a mapping", "write a mapping, such as `{force: 150 N}`")
    naming, found = info.context.get("naming", CUTTING), {}
    for name, value in given.items():
        named = _response(name, naming)
        found[_key(named, naming)] = _read(value, named) if naming.is_cutting else quantity(value, named)
    return found


def _read(value: Any, named: Variable) -> float:
    kind = Quantity(parse_unit(named.unit).dimension, above=0.0, unit=named.unit)
    return as_written(kind.checked(value, from_yaml=True), named.unit)


_Key = Annotated[str, BeforeValidator(_keyed)]


class GoalSection(Frozen):
    """What the study optimises, instead of `targets`: one response, or two with their Pareto front.

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
        """The optimised responses: 1 to minimise, −1 to maximise."""
        return {**dict.fromkeys(self.minimise, 1.0), **dict.fromkeys(self.maximise, -1.0)}

    @property
    def responses(self) -> tuple[str, ...]:
        """The keys of the responses that need a surface, the first one always."""
        return tuple(dict.fromkeys((FIRST, *self.signs, *self.at_most)))

    def unmeasured(self, condition: float) -> Target:
        """Return the place of the surfaces: a target without measured values (NaN)."""
        further = {name: Mean.model_construct(value=nan) for name in self.responses if name != FIRST}
        return Target.model_construct(condition=condition, response=nan, further=further)
