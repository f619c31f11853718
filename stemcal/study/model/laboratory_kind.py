"""Laboratory tests other than cutting: the keys of a test in a spec for each kind of test, and a registry of kinds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from stemcal.registry import Checked, Registry
from stemcal.responses import FURTHER_CUT, PIECE, Response, responses_in
from stemcal.study.model.measured_targets import Mean, Targets, named_modes
from stemcal.study.model.shear_test import BladeSection, LoadingSection, SupportsSection
from stemcal.study.types.field_types import ColumnName, Frozen, Length, OneOf, Speed, StemLength, complain
from stemcal.vocabulary import CUTTING, DIAMETER, FORCE, Variable, Vocabulary, capital, small


class LaboratoryMeans(Frozen):
    """Measured means of one test at one stem diameter, by response; `row` is the index in `targets` of the spec."""

    diameter: float
    means: dict[str, Mean] = {}
    row: int = Field(default=0, exclude=True, repr=False)


def _as_rows(raw: Any, info: ValidationInfo) -> Any:
    if info.context is not None:
        remedy = "write rows such as `{test: NAME, diameter: …}` in the `targets` section"
        raise complain("unknown key 'targets'", remedy)
    return raw


class LaboratorySection(Frozen):
    """A laboratory test other than cutting. The means in rows of `targets` with the name of the test are fitted. A test
    without rows is used only by `simulate --test`.
    """

    name: ColumnName
    """Name of the test in tables, files and `simulate --test`."""
    kind: str
    """Kind of the laboratory test."""
    speed: Speed = 10 / 60
    """Speed of the machine; in cutting tests, the default is the blade speed in the `loading` section."""
    targets: SkipJsonSchema[Annotated[tuple[LaboratoryMeans, ...], BeforeValidator(_as_rows)]] = Field(default=())

    is_further_cut: ClassVar[bool] = False
    """Whether the test is a further cutting test, simulated in the same way as the cutting test of the spec."""
    across_axis: ClassVar[bool | None] = None
    """True if the slope depends on the modulus across the stem's axis, False if on that along it, None for neither."""
    usual: ClassVar[tuple[str, ...]] = ("slope", "force", "work")
    """The responses that a calibration fits by default if all of them were measured."""
    plausible: ClassVar[Mapping[str, tuple[float, float]]] = {"stroke": (0.01, 500.0)}
    """Plausible range of each length in mm, by key. A length outside this range causes a warning."""

    def stroke_at(self, diameter: float) -> float:
        """Return the stroke at a stem diameter, mm; 0 for a further cut with the stroke in the `loading` section."""
        raise NotImplementedError

    def misfits(self, diameter: float, ratio: float) -> Iterator[tuple[str, str, str]]:
        """Yield (key, message, remedy) of each mistake in the section, for a stem diameter in mm; `ratio` = bore/d."""
        yield from ()

    @property
    def places(self) -> tuple[str, ...]:
        """Kinds of test whose responses (`Response.tests` in `stemcal.responses`) this test can have."""
        return (FURTHER_CUT,) if self.is_further_cut else (PIECE, self.kind)

    @property
    def responses(self) -> tuple[Response, ...]:
        """Responses that the test can have: built-in ones, and responses of other packages if they have targets."""
        return responses_in(*self.places, measured=[name for means in self.targets for name in means.means])

    def shear_over_bending(self, diameter: float, ratio: float, softness: float) -> float:
        """Return deflection by shear over deflection by bending, for `ratio` = bore/d and `softness` = E/G."""
        return 0.0

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the responses that have targets, in the order of the table of responses."""
        names = {name for means in self.targets for name in means.means}
        return tuple(response.name for response in self.responses if response.name in names)

    def means_at(self, diameter: float) -> dict[str, Mean]:
        """Return the measured means at a stem diameter, by response."""
        return {
            name: mean
            for means in self.targets
            if abs(means.diameter - diameter) < 1e-6
            for name, mean in means.means.items()
        }

    def called(self, response: str) -> str:
        """Return the name that a response of the test has in the study, such as "bend_slope"."""
        return f"{self.name}_{response}"

    def in_place_of(self, own: object) -> dict[str, Any]:
        """Return the sections, by name, with which a further cutting test replaces those of the study `own`."""
        return {}


class PieceSection(LaboratorySection):
    """A test of a piece of stem. Lengths can be fractions of the diameter, such as d/12. A subclass adds the keys of
    its kind, including `kind` with its name.
    """

    length: StemLength | None = None
    """Length of the specimen; the default is 1.2 times the span in bending tests and twice the diameter in other
    tests."""
    stroke: StemLength
    """Stroke of the machine."""
    element_size: StemLength | None = None
    """Element size: by default d/12 in bending and d/8 in axial tests. In radial compression, the default is d/64 at
    the plates and d/16 elsewhere."""

    plausible: ClassVar[Mapping[str, tuple[float, float]]] = {"stroke": (0.01, 500.0), "length": (1.0, 2000.0)}
    usual_size: ClassVar[Length] = Length(divisor=8.0)
    """Default element length if the spec does not specify the length."""

    def stroke_at(self, diameter: float) -> float:
        return self.stroke.at(diameter)

    def size(self) -> Length:
        """Return the element size of the spec, or the default."""
        return self.element_size or self.usual_size

    def long(self, diameter: float) -> float:
        """Return the length of the specimen at a stem diameter, mm."""
        return 2.0 * diameter if self.length is None else self.length.at(diameter)

    def room(self, diameter: float, ratio: float) -> float:
        """Return the length (mm) of which the stroke must be less than half; by default that of the specimen."""
        return self.long(diameter)

    def misfits(self, diameter: float, ratio: float) -> Iterator[tuple[str, str, str]]:
        stroke, room = self.stroke_at(diameter), self.room(diameter, ratio)
        if stroke >= 0.5 * room:
            message = f"the stroke of {stroke:g} mm is too long for the specimen"
            yield "stroke", message, f"use less than {0.5 * room:g} mm"


class FurtherCutSection(LaboratorySection):
    """A further cutting test with changes to the sections of the spec."""

    kind: Literal["cutting"] = "cutting"
    blade: BladeSection | None = None
    """Blade keys whose values differ from those in the `blade` section of the spec."""
    supports: SupportsSection | None = None
    """Support keys whose values differ from those in the `supports` section of the spec."""
    stroke: StemLength | None = None
    """Stroke of the machine; by default the stroke in the `loading` section."""

    is_further_cut = True
    usual = ("force",)

    def stroke_at(self, diameter: float) -> float:
        return 0.0 if self.stroke is None else self.stroke.at(diameter)

    def in_place_of(self, own: Any) -> dict[str, Any]:
        loading = self.stroke and LoadingSection.model_construct(stroke=self.stroke)
        changes = {"blade": self.blade, "supports": self.supports, "loading": loading}
        sections = {
            name: getattr(own, name).model_copy(update={key: getattr(change, key) for key in change.model_fields_set})
            for name, change in changes.items()
            if change
        }
        if self.supports and sections["supports"].kind != own.supports.kind:
            sections["supports"].model_fields_set.intersection_update(self.supports.model_fields_set)
        return sections


class LaboratoryKind(Checked):
    """A kind of laboratory test that the embedded solver simulates: its name, its keys in a spec, its model."""

    name: ClassVar[str] = ""
    options: ClassVar[type[LaboratorySection]] = LaboratorySection

    def make(self, section: Any, diameter: float) -> Any:
        """Return the `laboratory.Kind` that models a test by its section at a stem diameter (mm)."""
        raise NotImplementedError


class _FurtherCut(LaboratoryKind):
    name, options = "cutting", FurtherCutSection


TESTS: Registry[LaboratoryKind] = Registry(
    LaboratoryKind,
    "stemcal.tests",
    (
        "stemcal.study.model.laboratory_kind:_FurtherCut",
        "stemcal.laboratory.three_point_bending:Bending",
        "stemcal.laboratory.radial_compression:Radial",
        "stemcal.laboratory.axial:Compression",
        "stemcal.laboratory.axial:Tension",
    ),
)
AnyTest = Annotated[LaboratorySection, OneOf(TESTS, "laboratory test")]


def words_of(response: Response) -> str:
    """Return the noun of a response after the name of its laboratory test, as in "bend slope"."""
    return response.of_test or response.noun or small(response.label)


def naming_with(targets: Targets, tests: Sequence[LaboratorySection]) -> Vocabulary:
    """Return the vocabulary of a cutting study: the force, then further responses of cuts, tests and curves."""
    own = []
    for test in tests:
        for response in test.responses:
            if response.name in test.measured:
                label = capital(f"{test.name.replace('_', ' ')} {words_of(response)}")
                own.append(Variable(test.called(response.name), label, response.symbol, response.unit))
    own += named_modes(targets.modes.values())
    measured = dict.fromkeys(name for target in targets.means for name in target.further)
    naming = (Vocabulary(DIAMETER, (FORCE,)) if own else CUTTING).measuring(measured)
    return replace(naming, responses=(*naming.responses, *own))


def with_tests(targets: Targets, tests: Sequence[LaboratorySection]) -> Targets:
    """Add the means of laboratory tests to the targets at the same diameters, as further responses."""
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
