"""Sections of the virtual shear test in a spec: specimen, blade, supports, loading, machine, contact, material."""

from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field, InstanceOf, PlainSerializer, ValidationInfo, WithJsonSchema

from stemcal.study.model.growth import Growth, Interpolated, OverDiameter, value_at
from stemcal.study.types.factor import PARAMETERS
from stemcal.study.types.field_types import (
    MOST,
    Frozen,
    Length,
    Number,
    Quantity,
    Size,
    SizeOrZero,
    Speed,
    StemLength,
    StemLengthOrZero,
    Time,
    Title,
    complain,
    field_or_none,
)
from stemcal.study.types.strict_yaml import resolve

Stress = Annotated[float | Growth, OverDiameter(Annotated[float, Quantity("stress")], only_grows=True)]
GAP: Final = 0.001  # distance of the edge from the stem at the start, mm
DAMPING: Final = 0.5  # damping of the contact, as a share of critical damping
_WHOLE_STROKE = Length(divisor=1 / 1.5)  # default stroke of a cut all the way through the stem
_Folder = Annotated[Title, Field(min_length=1, max_length=200)]
Ratio = Annotated[float | Growth, OverDiameter(Number, only_grows=True)]
_Density = Annotated[float | Growth, OverDiameter(Annotated[float, Quantity("density")], only_grows=True)]
_Rate = Annotated[float | Growth, OverDiameter(Annotated[float, Quantity("rate")], only_grows=True)]


class SpecimenSection(Frozen):
    """The piece of stem, a hollow cylinder."""

    outer_diameter: Size = 8.0
    """Outer diameter of the stem. If `targets` has a row for this diameter, the parameters are calibrated at this
    diameter."""
    diameter_ratio: Annotated[float | Growth | Interpolated, OverDiameter(Annotated[Number, Field(ge=0, lt=1)])] = 0.41
    """Bore diameter divided by outer diameter; 0 for a solid stem. The ratio may be a power of the stem diameter, such
    as `{value: 0.41, at: 8 mm, exponent: 0.5}`, or measured, such as `{7 mm: 0.38, 11 mm: 0.45}`."""
    bore: Annotated[Length | Growth | Interpolated, OverDiameter(StemLengthOrZero)] | None = None
    """Bore diameter, instead of `diameter_ratio`: a length, a fraction of the diameter such as d/2.4, a power of the
    stem diameter, or measured, such as `{7 mm: 2.7 mm, 11 mm: 5 mm}`."""
    length: Size = 50.0
    """Length of the specimen; the blade cuts the specimen in the middle."""

    def ratio_at(self, diameter: float) -> float:
        """Return the ratio of the bore diameter to the outer diameter, for a stem diameter in mm."""
        bore = value_at(self.bore, diameter, None, {})
        return float(value_at(self.diameter_ratio, diameter, None, {}) or 0.0) if bore is None else bore / diameter


class BladeSection(Frozen):
    """The rigid blade, wider than the stem."""

    width: Size = 28.0
    """Height of the blade from the edge to the back."""
    thickness: Size = 2.3
    """Thickness of the blade behind the two faces of the edge."""
    edge_angle: Annotated[float, Quantity("angle", above=0, below=180)] = 37.5
    """Angle between the two faces of the edge."""
    bevel: Literal["both", "one"] = "both"
    """Bevel of the edge: on both sides (`both`) or on one side (`one`)."""
    edge_radius: SizeOrZero = 0.1
    """Radius of the edge; 0 mm for a sharp edge."""
    sliding_angle: Annotated[float, Quantity("angle", at_least=0, below=60)] = 0.0
    """Angle between the travel of the blade and the normal to its edge, 0° for a straight cut. An oblique edge slides
    along itself during the cut."""
    edge_spread: StemLengthOrZero = Length(divisor=9.5)
    """Half-width of the zone over which the contact force of the edge is spread: a length, or a fraction of the
    diameter such as d/9.5. The calibrated failure strain depends on this half-width. With 0 mm, the force depends on
    the mesh."""


class SupportsSection(Frozen):
    """The supports of the stem: two rigid blocks, or a clamp at one end."""

    kind: Literal["span", "clamped", "counter_edge"] = "span"
    """Type of support: two blocks with the blade between them (`span`), a clamp at one end, as of a rooted stem
    (`clamped`), or a clamp and a fixed knife on the clamped side of the blade, as in a cutter bar (`counter_edge`)."""
    clearance: Size = 20.0
    """Gap between the two blocks; the blade moves through the middle of the gap. With `counter_edge`, gap between the
    blade and the fixed knife."""
    fillet_radius: SizeOrZero = 1.0
    """Fillet radius of the edges of the blocks or of the fixed knife."""
    height: Size = 60.0
    """Distance between the clamp and the plane of the cut, with `clamped` and `counter_edge`. The rest of the length
    of the specimen is free."""

    @property
    def keys_in_use(self) -> tuple[str, ...]:
        """Keys besides `kind` that have an effect with this kind of support."""
        blocks = ("clearance", "fillet_radius")
        return {"span": blocks, "clamped": ("height",), "counter_edge": (*blocks, "height")}[self.kind]


class LoadingSection(Frozen):
    """The motion of the blade, at constant speed."""

    speed: Speed = 100 / 60
    """Constant speed of the blade."""
    duration: Time = 0.5
    """Duration of the blade motion; the stroke is the speed times the duration."""
    stroke: StemLength | None = None
    """Travel of the blade after first contact, instead of `duration`: a length, or a fraction of the diameter. With
    `until: severed`, the default is 1.5 times the diameter if `duration` is also omitted."""
    until: Literal["first_fracture", "severed"] = "first_fracture"
    """End of the simulation: when the force has dropped after the first fracture (`first_fracture`), or when the stem
    is cut through (`severed`). The force is the maximum up to then."""

    @property
    def chosen_stroke(self) -> Length | None:
        """Stroke in the spec, or the default of a whole cut; None if the stroke follows from `duration`."""
        by_default = self.until == "severed" and "duration" not in self.model_fields_set
        return _WHOLE_STROKE if by_default and self.stroke is None else self.stroke

    def duration_at(self, diameter: float) -> float:
        """Return the duration of the motion of the blade, s, at a stem diameter in mm."""
        stroke = self.chosen_stroke
        return self.duration if stroke is None else (stroke.at(diameter) + GAP) / self.speed

    def stroke_at(self, diameter: float) -> float:
        """Return the travel of the blade after first contact, mm, at a stem diameter in mm."""
        return self.speed * self.duration_at(diameter) - GAP

    def longer(self, times: float) -> Self:
        """Return the same motion with the stroke (or duration) multiplied by `times`."""
        if (stroke := self.chosen_stroke) is None:
            return self.model_copy(update={"duration": times * self.duration})
        divisor = None if stroke.divisor is None else stroke.divisor / times
        return self.model_copy(update={"stroke": Length(times * stroke.mm, divisor)})

    @property
    def written(self) -> dict[str, str]:
        """Key of the spec that sets the stroke, with its value as text."""
        stroke = self.chosen_stroke
        return {"duration": f"{self.duration:.6g} s"} if stroke is None else {"stroke": str(stroke)}


class MachineSection(Frozen):
    """The testing machine with which `curves` were measured."""

    stiffness: Annotated[float, Quantity("force per length", above=0)] | None = None
    """Stiffness of the machine without a specimen; by default, the measured travel is not corrected."""


class ContactSection(Frozen):
    """Friction and penalty between stem, blade and supports."""

    static_friction: Annotated[Number, Field(ge=0, le=2)] = 0.15
    """Coefficient of static friction µs."""
    dynamic_friction: Annotated[Number, Field(ge=0, le=2)] = 0.10
    """Coefficient of dynamic friction µd, the limit at high sliding speeds."""
    decay: Annotated[float, Quantity("decay", at_least=0)] = 0.0
    """Decay of the friction from µs to µd with the sliding speed v: µ = µd + (µs − µd)·exp(−decay·|v|)."""
    penalty: Annotated[Number, Field(gt=0, le=1)] = 0.25
    """Contact stiffness of a node as a fraction of m/Δt²; m is the mass of the node, and Δt is the stable time step."""


@dataclass(frozen=True)
class Relative:
    """A stress across the axis in MPa, or its ratio to the stress along the axis."""

    value: float
    is_ratio: bool = False

    def of(self, along: float) -> float:
        """Return the stress across the axis, MPa, for the stress along the axis."""
        return self.value * along if self.is_ratio else self.value

    def __str__(self) -> str:
        return f"{self.value:g}" if self.is_ratio else f"{self.value:g} MPa"


def _relative(raw: Any, info: ValidationInfo) -> Any:
    if isinstance(raw, Relative):
        return raw
    text = raw.strip() if isinstance(raw, str) else ""
    if isinstance(resolve(text), int | float):
        raise complain(f"{text} has no unit", f'write {text} without quotes for a ratio, or "{text} MPa"')
    if text.endswith("%"):
        raw = Quantity("dimensionless").read(raw, info)
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        return Relative(Quantity("stress", above=0).read(raw, info))
    if not 0.0 < raw <= MOST:
        raise complain(f"{raw:g} is not a ratio above 0", "write a number, such as 0.1, or a stress, such as 80 MPa")
    return Relative(float(raw), is_ratio=True)


StressOrRatio = Annotated[
    InstanceOf[Relative],
    BeforeValidator(_relative),
    PlainSerializer(lambda value: value.value if value.is_ratio else str(value)),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "examples": ["80 MPa"]}]}),
]


class TransverseSection(Frozen):
    """Properties across the axis of the stem, for stems with fibres; the other material keys are those along the axis.

    Stresses may be written as a ratio to the value along the axis, such as 0.1 or 10 %.
    """

    elastic_modulus: StressOrRatio | None = None
    """Young's modulus across the axis; by default that along the axis."""
    shear_modulus: StressOrRatio | None = None
    """Shear modulus G between the axis and a direction across it; a ratio refers to `elastic_modulus` along the axis.
    By default 1/G = 1/Et + (1 + 2ν)/E with Young's moduli E along and Et across the axis."""
    poisson_ratio: Annotated[Number, Field(ge=0, lt=1)] | None = None
    """Poisson's ratio between two directions across the axis; by default `poisson_ratio` of the material, which is for
    tension along the axis."""
    yield_stress: StressOrRatio | None = None
    """Yield stress across the axis; by default that along the axis. It must be less than twice that along the axis."""
    shear_yield_stress: StressOrRatio | None = None
    """Yield stress in shear between the axis and a direction across it; a ratio refers to `yield_stress` along the
    axis. By default the yield stress across the axis divided by √3."""


class MaterialSection(Frozen):
    """The material parameters of a stem or of a layer that are not factors."""

    density: _Density | None = None
    """Mass density."""
    elastic_modulus: Stress | None = None
    """Young's modulus E."""
    poisson_ratio: Ratio | None = None
    """Poisson's ratio."""
    yield_stress: Stress | None = None
    """Stress at which plastic flow starts at zero strain rate."""
    tangent_modulus: Stress | None = None
    """Slope Et of the stress–strain curve beyond yield."""
    hardening_parameter: Ratio | None = None
    """Type of hardening: 0 is kinematic, 1 is isotropic, and values in between are mixed."""
    strain_rate_c: _Rate | None = None
    """Parameter C of the strain-rate law; a larger C reduces the effect of the strain rate on the yield stress."""
    strain_rate_p: Ratio | None = None
    """Parameter P of the strain-rate law."""
    failure_strain: Ratio | None = None
    """Plastic strain, averaged over the internal length, at which an element is deleted."""
    internal_length: StemLengthOrZero = Length(divisor=4.5)
    """Length over which the plastic strain for failure is averaged: a length, or a fraction of the diameter such as
    d/4.5. With 0 mm, the strain is not averaged, and the force depends on the mesh."""
    transverse: TransverseSection | None = None
    """Properties across the axis of the stem; without this section, the material is isotropic."""

    def fixed(self) -> dict[str, float]:
        """Return the parameters with the same value at all stem diameters, by name."""
        return {name: value for name in PARAMETERS if isinstance(value := field_or_none(self, name), int | float)}

    def growing(self) -> dict[str, Growth]:
        """Return the parameters that are powers of the diameter, by name."""
        return {name: value for name in PARAMETERS if isinstance(value := field_or_none(self, name), Growth)}


class StemMaterialSection(MaterialSection):
    """Values of the material parameters that are not factors, or the material of a finished study.

    Each value except `internal_length` and `transverse` may be a power of the stem diameter, for example
    `{value: 15 MPa, at: 8 mm, exponent: 0.5}`. If such a parameter is a factor, omit `value`: its levels apply at `at`.
    """

    from_: _Folder | None = Field(default=None, validation_alias="from", serialization_alias="from", exclude=True)
    """Folder of a finished calibration, relative to the spec, such as `../runs/wild-chrysanthemum`. Its calibrated
    values are used, with its stem, friction, lengths, law and mesh. Keys set in this spec must have the same values."""
