"""What was measured: the rows of `targets`, and laboratory tests besides cutting."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isclose
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    StringConstraints,
    TypeAdapter,
    ValidationInfo,
    WithJsonSchema,
)
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import CoreSchema

from stemcal.measured.curve_modes import CurveModes
from stemcal.naming import FIRST, Named, Naming, capital
from stemcal.study.model.factor import Frozen, Size
from stemcal.study.model.shear_test import BladeSection, SupportsSection
from stemcal.study.types.field_types import ColumnName, Length, Quantity, StemLength, Whole, complain

Patterns = Annotated[
    tuple[Annotated[str, StringConstraints(strict=True, min_length=1, max_length=300)], ...],
    BeforeValidator(lambda given: (given,) if isinstance(given, str) else given),
    Field(min_length=1, max_length=100),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]
_SCATTER = {"anyOf": [{"type": "string"}, {"type": "number"}, {"type": "object"}]}


class TargetRow(Frozen):
    """What was measured in one test at one condition: means over `n` specimens.

    Where the spec declares `responses` and `conditions`, their names take the place of `force` and `diameter`.
    """

    test: ColumnName | None = None
    """Name of the test under `tests` in which it was measured; the cutting test without it."""
    diameter: Size | None = None
    """Outer diameter of the stems."""
    force: Annotated[float, Quantity("force", above=0)] | None = None
    """Mean of their maximum force."""
    travel: Size | None = None
    """Mean travel from first touch to the maximum force."""
    work: Annotated[float, Quantity("energy", above=0)] | None = None
    """Mean work: in cutting up to the maximum force, in a test until the break or the end of the stroke."""
    slope: Annotated[float, Quantity("force per length", above=0)] | None = None
    """Of a test: mean slope of the force over the travel of the machine, from 20 to 50 % of the maximum."""
    sd: Annotated[Any, WithJsonSchema(_SCATTER)] = None
    """Standard deviation over the specimens; of several responses a mapping by their names. Without it the mean is
    treated as exact."""
    n: Annotated[Whole, Field(ge=1)] | None = None
    """Number of specimens."""
    curves: Patterns | None = None
    """Files of force over travel, a specimen each: names or patterns such as lab/8mm/*.csv. The shape of the curves is
    fitted too; `force`, `sd` and `n` are calculated from them where they are not given."""


class Mean(Frozen):
    """The measured mean of a further response, with its standard deviation, in its own unit.

    `n` are the specimens where they are not those of the first response; `systematic` has by how much
    one standard deviation of what moves them all alike moves the mean.
    """

    value: float
    sd: float | None = None
    n: int | None = None
    systematic: dict[str, float] = {}


class Target(Frozen):
    """The measured mean of the first response at one condition, with its standard deviation over n specimens.

    In the shear test these are the maximum force at a stem diameter. `further` has the other responses by name, `row`
    is the place in the spec.
    """

    condition: float
    response: float
    sd: float | None = None
    n: int | None = None
    curves: tuple[str, ...] | None = None
    further: dict[str, Mean] = {}
    modes: CurveModes | None = None
    row: int = Field(default=0, exclude=True, repr=False)

    def count_of(self, response: str) -> int | None:
        """Return over how many specimens a response was measured."""
        own = self.further[response].n if response in self.further else None
        return self.n if own is None else own

    def systematic_of(self, response: str) -> dict[str, float]:
        """Return by how much a standard deviation of what moves all specimens alike moves a response."""
        return self.further[response].systematic if response in self.further else {}

    def specimens_of(self, response: str) -> str:
        """Return a name for the specimens of a response if their curves give it, otherwise nothing."""
        if self.modes is None:
            return ""
        own = isclose(self.response, self.modes.force, rel_tol=1e-4) and self.n == self.modes.specimens
        scored = response in {named.name for named in named_modes([self.modes])}
        return f"{self.condition:g}" if scored or (own and response == FIRST) else ""

    def mean_of(self, response: str) -> tuple[float | None, float | None]:
        """Return mean and standard deviation of a response by its name, or of the first one for `FIRST`."""
        if response == FIRST:
            return self.response, self.sd
        mean = self.further.get(response)
        return (None, None) if mean is None else (mean.value, mean.sd)


class Targets(Frozen):
    """What the laboratory measured, and the condition at which the parameters are calibrated.

    A spec writes `TargetRow`s. Parameters are calibrated at the first of `invert.diameters`; otherwise at
    `specimen.outer_diameter` where that was measured; otherwise at the first row.
    """

    calibrate_at: float
    means: tuple[Target, ...]

    @classmethod
    def __get_pydantic_json_schema__(cls, _schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(TypeAdapter(tuple[TargetRow, ...]).core_schema)

    @property
    def modes(self) -> dict[float, CurveModes]:
        """The components of the curves that were measured, by condition."""
        return {target.condition: target.modes for target in self.means if target.modes is not None}

    def modes_at(self, condition: float) -> CurveModes | None:
        """Return the components of the curves that were measured at a condition, if any were."""
        return next((modes for there, modes in self.modes.items() if isclose(there, condition)), None)

    def with_modes(self, modes: Mapping[int, CurveModes]) -> Targets:
        """Return the targets with the responses of curves, by the place of their entry."""
        means = list(self.means)
        for index, found in modes.items():
            scores = {
                named.name: Mean(
                    value=found.force,
                    sd=sd,
                    n=found.specimens,
                    systematic={by: alike[j] for by, alike in found.systematic.items()},
                )
                for j, (named, sd) in enumerate(zip(named_modes([found]), found.scatter, strict=True))
            }
            further = {**means[index].further, **scores}
            means[index] = means[index].model_copy(update={"modes": found, "further": further})
        return self.model_copy(update={"means": tuple(means)})


def named_modes(modes: Iterable[CurveModes]) -> tuple[Named, ...]:
    """Return the scores of curves as responses of a study."""
    count = max((len(one.weights) for one in modes), default=0)
    return tuple(
        Named(f"curve_{j}", f"Score of the {which} curve mode", f"c{j}", "N", apart=True)
        for j, which in enumerate(("first", "second", "third")[:count], 1)
    )


TestKind = Literal[
    "cutting",
    "three-point-bending",
    "radial-compression",
    "axial-compression",
    "axial-tension",
]
# Responses by name: symbol, unit and what they are called behind the test's name.
RESPONSES = {
    "slope": ("k", "N/mm", "slope"),
    "force": ("F", "N", "maximum force"),
    "travel": ("u", "mm", "travel"),
    "work": ("W", "mJ", "work"),
}
# Those that a test simulated here is usually done for.
USUAL = ("slope", "force", "work")
# Those that do not depend on whether the maximum was passed.
BEFORE_MAXIMUM = frozenset({"slope"})
_SMALL, _COARSE, _PLATE = (Length(divisor=parts) for parts in (12.0, 8.0, 64.0))


class LaboratoryMeans(Frozen):
    """Measured means of one test at one stem diameter by response; `row` is their place in the spec."""

    diameter: float
    means: dict[str, Mean] = {}
    row: int = Field(default=0, exclude=True, repr=False)


def _as_rows(given: Any, info: ValidationInfo) -> Any:
    if info.context is not None:
        raise complain("unknown key 'targets'", "write rows under the targets of the spec: {test: NAME, diameter: …}")
    return given


class LaboratorySection(Frozen):
    """A test of a piece of stem besides cutting. Lengths may be shares of the diameter, such as d/12.

    Rows of `targets` with its name hold what was measured in it, which is then fitted. Without rows the test is there
    for `simulate --test`.
    """

    name: ColumnName
    """Name in tables, files and `simulate --test`."""
    kind: TestKind
    """What is done: the cut of the sections above in another way, a nose between two rollers, plates across the stem,
    or ends that move along its axis."""
    blade: BladeSection | None = None
    """What differs from the spec's blade, in cutting: keys that are not given here are the spec's."""
    supports: SupportsSection | None = None
    """What differs from the spec's supports, in cutting."""
    length: StemLength | None = None
    """Length of the piece; by default 1.2 times the span in bending, otherwise two diameters."""
    span: StemLength | None = None
    """Distance between the axes of the supports, in bending."""
    radius: Size = 5.0
    """Radius of the nose and of the supports, in bending."""
    ends: Literal["held", "lubricated"] = "held"
    """Ends of axial tests: `held` ends keep the size of their section, `lubricated` ends can expand about a fixed
    middle."""
    stroke: StemLength | None = None
    """How far the machine moves; in cutting as far as the spec's blade by default."""
    speed: Annotated[float, Quantity("speed", above=0)] = 10 / 60
    """Speed of the machine; in cutting that of the spec's blade by default."""
    element_size: StemLength | None = None
    """Length of the elements: d/12 in bending, d/8 in axial tests; in radial compression, d/64, their width at the
    plates, and four times that elsewhere."""
    targets: SkipJsonSchema[Annotated[tuple[LaboratoryMeans, ...], BeforeValidator(_as_rows)]] = Field(default=())

    def stroke_at(self, diameter: float) -> float:
        """Return how far the machine moves at a stem diameter, mm; 0 where a further cut has the spec's own stroke."""
        return 0.0 if self.stroke is None else self.stroke.at(diameter)

    @property
    def is_further_cut(self) -> bool:
        """Whether it is the spec's own cutting test in another way, simulated as that is."""
        return self.kind == "cutting"

    def in_place_of(self, own: object) -> dict[str, Any]:
        """Return the sections that a further cutting test changes, of its study or draft."""
        given = {"blade": _given(self.blade), "supports": _given(self.supports)}
        sections = {name: getattr(own, name) for name in given}
        return {name: one.model_copy(update=given[name]) for name, one in sections.items() if one is not None}

    def size(self) -> Length:
        """Return the length of the elements."""
        usual = {"three-point-bending": _SMALL, "radial-compression": _PLATE}
        return self.element_size or usual.get(self.kind, _COARSE)

    def long(self, diameter: float) -> float:
        """Return the length of the piece at a stem diameter, mm."""
        if self.length is not None:
            return self.length.at(diameter)
        return 2.0 * diameter if self.span is None else 1.2 * self.span.at(diameter)

    @property
    def told(self) -> tuple[str, ...]:
        """The responses that a calibration would use if all were measured."""
        return ("force",) if self.is_further_cut else USUAL

    @property
    def measured(self) -> tuple[str, ...]:
        """The responses that have targets, in the order of `RESPONSES`."""
        given = {name for means in self.targets for name in means.means}
        return tuple(name for name in RESPONSES if name in given)

    def means_at(self, diameter: float) -> dict[str, Mean]:
        """Return what was measured at a stem diameter, by response."""
        return {
            name: mean
            for means in self.targets
            if abs(means.diameter - diameter) < 1e-6
            for name, mean in means.means.items()
        }

    def called(self, response: str) -> str:
        """Return what the study calls one of its responses."""
        return f"{self.name}_{response}"


def _given(section: Frozen | None) -> dict[str, object]:
    """Return the keys of a section that its author wrote."""
    return {} if section is None else {name: getattr(section, name) for name in section.model_fields_set}


def named_responses(tests: Sequence[LaboratorySection]) -> tuple[Named, ...]:
    """Return the measured responses of all tests as the study's own."""
    found = []
    for test in tests:
        for response in test.measured:
            symbol, unit, words = RESPONSES[response]
            label = f"{test.name.replace('_', ' ')} {words}"
            found.append(Named(test.called(response), capital(label), symbol, unit))
    return tuple(found)


def with_tests(targets: Targets, tests: Sequence[LaboratorySection]) -> Targets:
    """Return the targets with what was measured in the tests at the same diameters."""
    further: dict[float, dict[str, Mean]] = {}
    for test in tests:
        for means in test.targets:
            named = {test.called(response): mean for response, mean in means.means.items()}
            further.setdefault(round(means.diameter, 9), {}).update(named)
    merged = [
        target.model_copy(update={"further": {**target.further, **further.get(round(target.condition, 9), {})}})
        for target in targets.means
    ]
    return targets.model_copy(update={"means": tuple(merged)})


def fitted_responses(targets: Targets, naming: Naming) -> tuple[str, ...]:
    """Return the responses that are fitted unless a spec chooses: the first, and all others that are measured."""
    measured = dict.fromkeys(name for target in targets.means for name in target.further)
    return (FIRST, *(name for name in measured if name in [other.name for other in naming.others]))
