"""Laboratory tests of pieces of stem besides cutting, as a spec describes them, and what was measured in them."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from stemcal.naming import FIRST, Named, capital
from stemcal.study.model.frozen import Frozen, Size
from stemcal.study.model.measured_targets import Mean, Targets
from stemcal.study.model.program_options import CommandSolver
from stemcal.study.model.shear_test import BladeSection, SupportsSection
from stemcal.study.types.field_types import ColumnName, Quantity, complain
from stemcal.study.types.lengths import Length, StemLength

TestKind = Literal[
    "cutting",
    "three-point-bending",
    "radial-compression",
    "axial-compression",
    "axial-tension",
    "other",
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
    or ends that move along its axis; `other` what the program under `solver` alone knows."""
    solver: CommandSolver | None = None
    """A program of your own that does this test in place of the embedded solver. Its `result` is a mapping of readers
    by response, `slope: {file: …}`; no keys but `name` and `kind` are given with it."""
    blade: BladeSection | None = None
    """What differs from the spec's blade, in cutting: keys that are not given here are the spec's."""
    supports: SupportsSection | None = None
    """What differs from the spec's supports, in cutting."""
    length: StemLength | None = None
    """Length of the piece; by default 1.2 times the span in bending, else two diameters."""
    span: StemLength | None = None
    """Distance between the axes of the supports, in bending."""
    radius: Size = 5.0
    """Radius of the nose and of the supports, in bending."""
    ends: Literal["held", "lubricated"] = "held"
    """Ends of axial tests: `held` ones keep the size of their section, `lubricated` ones let it change about its
    middle, which does not slide."""
    stroke: StemLength | None = None
    """How far the machine moves; in cutting as far as the spec's blade by default."""
    speed: Annotated[float, Quantity("speed", above=0)] = 10 / 60
    """Speed of the machine; in cutting that of the spec's blade by default."""
    element_size: StemLength | None = None
    """Length of the elements: d/12 in bending, d/8 in axial tests; in radial compression, d/64, their width at the
    plates, and four times that elsewhere."""
    targets: SkipJsonSchema[Annotated[tuple[LaboratoryMeans, ...], BeforeValidator(_as_rows)]] = Field(default=())

    def stroke_at(self, diameter: float) -> float:
        """Return how far the machine moves at a stem diameter, mm; 0 where that is a program's matter."""
        return 0.0 if self.stroke is None else self.stroke.at(diameter)

    @property
    def is_further_cut(self) -> bool:
        """Whether it is the spec's own cutting test in another way, simulated as that is."""
        return self.kind == "cutting" and self.solver is None

    def in_place_of(self, own: object) -> dict[str, Any]:
        """Return the sections that a further cutting test changes, of the study or the draft that it belongs to."""
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
        """The responses that a calibration would use if all were measured: of a program all that are read."""
        if self.solver is not None:
            return tuple(self.solver.results)
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


def fitted_responses(targets: Targets) -> tuple[str, ...]:
    """Return the responses that are fitted unless a spec chooses: the first, and all further ones that are measured."""
    return (FIRST, *dict.fromkeys(name for target in targets.means for name in target.further))
