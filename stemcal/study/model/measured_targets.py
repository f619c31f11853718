"""Measured data: the rows of `targets` in a spec, and the targets of a study that are formed from them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isclose
from typing import TYPE_CHECKING, Annotated, Any

import pydantic

from stemcal.measured.curve_modes import CurveModes
from stemcal.responses import CUT, TABLE
from stemcal.study.types.field_types import ColumnName, Frozen, Quantity, Size, Whole
from stemcal.study.types.units import parse_unit
from stemcal.vocabulary import FIRST, Variable, Vocabulary

Patterns = Annotated[
    tuple[Annotated[str, pydantic.StringConstraints(strict=True, min_length=1, max_length=300)], ...],
    pydantic.BeforeValidator(lambda raw: (raw,) if isinstance(raw, str) else raw),
    pydantic.Field(min_length=1, max_length=100),
    pydantic.WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]
Count = Annotated[Whole, pydantic.Field(ge=1)]
_SCATTER = {"anyOf": [{"type": "string"}, {"type": "number"}, {"type": "object"}]}


class _Tested(Frozen):
    test: ColumnName | None = None
    """Name of a test in the `tests` section; by default the cutting test."""
    diameter: Size | None = None
    """Outer diameter of the tested stems."""


if TYPE_CHECKING:
    _Responses = _Tested
else:
    _fields: dict[str, Any] = {}
    for _response in sorted(TABLE, key=lambda response: CUT not in response.tests):
        _kind = Annotated[float, Quantity(parse_unit(_response.unit).dimension, above=0)] | None
        _fields[_response.name] = (_kind, pydantic.Field(default=None, description=_response.meaning))
    _Responses = pydantic.create_model("_Responses", __base__=_Tested, __module__=__name__, **_fields)


class TargetRow(_Responses):
    """Measurements of one test at one condition: means over `n` specimens.

    If the spec declares `responses` and `conditions`, their names replace `force` and `diameter`.
    """

    sd: Annotated[Any, pydantic.WithJsonSchema(_SCATTER)] = None
    """Standard deviation over the specimens; for several responses, a mapping from response names to standard
    deviations. Without `sd`, the mean is treated as exact."""
    n: Count | None = None
    """Number of specimens."""
    curves: Patterns | None = None
    """Files with force–travel curves, one per specimen: names, or patterns such as `lab/8mm/*.csv`. The shape of the
    curves is also fitted. If `force`, `sd` or `n` is omitted, the value is calculated from the curves."""


class Mean(Frozen):
    """The measured mean of a further response and its standard deviation, in the unit of the response.

    `n` is the number of specimens; None if it is the same as for the first response.
    """

    value: float
    sd: float | None = None
    n: int | None = None


class Target(Frozen):
    """The measured mean of the first response at one condition, with its standard deviation over n specimens.

    In the shear test, these are the maximum force and the stem diameter. `further` has the other responses by name,
    `modes` the modes of measured curves; `row` is the index in `targets` of the spec.
    """

    condition: float
    response: float
    sd: float | None = None
    n: int | None = None
    curves: tuple[str, ...] | None = None
    further: dict[str, Mean] = {}
    modes: CurveModes | None = None
    travel_of_curves: Mean | None = pydantic.Field(default=None, exclude=True, repr=False)
    row: int = pydantic.Field(default=0, exclude=True, repr=False)

    def count_of(self, response: str) -> int | None:
        """Return the number of specimens of a response; None if unknown."""
        own = self.further[response].n if response in self.further else None
        return self.n if own is None else own

    def specimens_of(self, response: str) -> str:
        """Return a key of the specimens of a response, equal for all responses of the same curves; empty for others."""
        if self.modes is None:
            return ""
        own = isclose(self.response, self.modes.force, rel_tol=1e-4) and self.n == self.modes.specimens
        scored = response in {named.name for named in named_modes([self.modes])}
        return f"{self.condition:g}" if scored or (own and response == FIRST) else ""

    def mean_of(self, response: str) -> tuple[float | None, float | None]:
        """Return mean and standard deviation of a response by its name (or `FIRST`); None for an unknown value."""
        if response == FIRST:
            return self.response, self.sd
        mean = self.further.get(response)
        return (None, None) if mean is None else (mean.value, mean.sd)


class Targets(Frozen):
    """All targets, and the condition of the calibration, which is set by `invert`, the specimen or the first row."""

    calibrate_at: float
    means: tuple[Target, ...]

    @classmethod
    def __get_pydantic_json_schema__(cls, _schema: Any, handler: pydantic.GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(pydantic.TypeAdapter(tuple[TargetRow, ...]).core_schema)

    @property
    def modes(self) -> dict[float, CurveModes]:
        """Modes of the measured curves, by condition (`CurveModes`)."""
        return {target.condition: target.modes for target in self.means if target.modes is not None}

    def modes_at(self, condition: float) -> CurveModes | None:
        """Return the modes of the curves measured at a condition; None without curves."""
        return next((modes for there, modes in self.modes.items() if isclose(there, condition)), None)

    def with_modes(self, modes: Mapping[int, CurveModes], travels: Mapping[int, Mean] = {}) -> Targets:
        """Return the targets with results of their curves added (modes, scores, travels), by index in `means`."""
        means = list(self.means)
        for index, of_row in modes.items():
            scores = {
                named.name: Mean(value=of_row.force, sd=sd, n=of_row.specimens)
                for named, sd in zip(named_modes([of_row]), of_row.scatter, strict=True)
            }
            further = {**means[index].further, **scores}
            own = {"modes": of_row, "further": further, "travel_of_curves": travels.get(index)}
            means[index] = means[index].model_copy(update=own)
        return self.model_copy(update={"means": tuple(means)})


def named_modes(modes: Iterable[CurveModes]) -> tuple[Variable, ...]:
    """Return a variable for each score on a mode of the curves; the scores are responses of the study."""
    count = max((len(each.weights) for each in modes), default=0)
    return tuple(
        Variable(f"curve_{j}", f"Score on the {which} curve mode", f"c{j}", "N", apart=True)
        for j, which in enumerate(("first", "second", "third")[:count], 1)
    )


def fitted_responses(targets: Targets, naming: Vocabulary) -> tuple[str, ...]:
    """Return the responses that are fitted by default: the first, and all other measured responses."""
    measured = dict.fromkeys(name for target in targets.means for name in target.further)
    return (FIRST, *(name for name in measured if name in [other.name for other in naming.others]))
