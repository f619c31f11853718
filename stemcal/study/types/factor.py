"""Factors, the parameters that can be factors with the embedded solver, and responses that a study declares."""

from typing import Annotated, Literal, NamedTuple

from pydantic import BeforeValidator, Field, StringConstraints

from stemcal.study.types import units
from stemcal.study.types.field_types import MOST, ColumnName, FactorName, Frozen, Label, Number, Readable, Title


class Parameter(NamedTuple):
    """A parameter with its physical limits and plausible range in `unit`; `…_allowed`: the limit itself is allowed."""

    label: str
    dimension: str
    unit: str
    lowest: float
    lowest_allowed: bool
    highest: float
    highest_allowed: bool
    plausible: tuple[float, float]
    relative: bool = False
    """Whether a value without a unit is the ratio to the same parameter along the axis of the stem."""

    def outside(self, value: float) -> str | None:
        """Return the fault of `value` (in `unit`) as text; None if the value is physically possible."""
        if abs(value) > MOST:
            return f"is not between -{MOST:g} and {MOST:g}"
        if value < self.lowest or (value == self.lowest and not self.lowest_allowed):
            return f"must {'not be below' if self.lowest_allowed else 'be above'} {in_unit(self.lowest, self.unit)}"
        if value > self.highest or (value == self.highest and not self.highest_allowed):
            return f"must {'not be above' if self.highest_allowed else 'be below'} {in_unit(self.highest, self.unit)}"
        return None

    @property
    def usual(self) -> str:
        """Text of the plausible range with its unit."""
        low, high = self.plausible
        return f"{low:g} to {in_unit(high, self.unit)}"


def in_unit(value: float, unit: str) -> str:
    """Return the text of a value with its unit, such as 1100 kg/m3; without a unit for dimensionless values."""
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"


_NO_LIMIT = float("inf")

PARAMETERS: dict[str, Parameter] = {
    "density": Parameter("density", "density", "kg/m3", 0, False, _NO_LIMIT, False, (100, 3000)),
    "elastic_modulus": Parameter("elastic modulus", "stress", "MPa", 0, False, _NO_LIMIT, False, (10, 1e5)),
    "poisson_ratio": Parameter("Poisson's ratio", "dimensionless", "1", 0, True, 0.5, False, (0, 0.5)),
    "yield_stress": Parameter("yield stress", "stress", "MPa", 0, False, _NO_LIMIT, False, (0.1, 1000)),
    "tangent_modulus": Parameter("tangent modulus", "stress", "MPa", 0, True, _NO_LIMIT, False, (0, 1e4)),
    "hardening_parameter": Parameter("hardening parameter", "dimensionless", "1", 0, True, 1, True, (0, 1)),
    "strain_rate_c": Parameter("strain rate parameter C", "rate", "1/s", 0, False, _NO_LIMIT, False, (1e-3, 1e6)),
    "strain_rate_p": Parameter("strain rate parameter P", "dimensionless", "1", 0, False, _NO_LIMIT, False, (0.1, 100)),
    "failure_strain": Parameter("failure strain", "dimensionless", "1", 0, False, _NO_LIMIT, False, (1e-3, 3)),
}

TRANSVERSE: dict[str, Parameter] = {
    "elastic_modulus": PARAMETERS["elastic_modulus"]._replace(label="elastic modulus across the axis", relative=True),
    "shear_modulus": PARAMETERS["elastic_modulus"]._replace(label="axial shear modulus", relative=True),
    "poisson_ratio": PARAMETERS["poisson_ratio"]._replace(label="Poisson's ratio across the axis", highest=1),
    "yield_stress": PARAMETERS["yield_stress"]._replace(label="yield stress across the axis", relative=True),
    "shear_yield_stress": PARAMETERS["yield_stress"]._replace(label="axial shear yield stress", relative=True),
}
THICKNESS = Parameter("thickness", "length", "mm", 0, False, _NO_LIMIT, False, (0.02, 20))

FRICTION = "stem_friction"  # not a material parameter: it replaces both coefficients of friction in `contact`
_OF_STEM = Parameter("stem friction", "dimensionless", "1", 0, True, 2, True, (0.01, 1))


class Setting(NamedTuple):
    """A setting of the test that can be a factor: its `section` in a spec, which has a key with the factor's name."""

    section: str
    parameter: Parameter


def _length(label: str, *plausible: float, zero: bool = False) -> Parameter:
    low, high = plausible
    return Parameter(label, "length", "mm", 0, zero, _NO_LIMIT, False, (low, high))


SETTINGS: dict[str, Setting] = {
    "edge_angle": Setting("blade", Parameter("edge angle", "angle", "deg", 0, False, 180, False, (5, 120))),
    "sliding_angle": Setting("blade", Parameter("sliding angle", "angle", "deg", 0, True, 60, False, (0, 60))),
    "edge_radius": Setting("blade", _length("edge radius", 1e-3, 2, zero=True)),
    "thickness": Setting("blade", _length("blade thickness", 0.1, 50)),
    "speed": Setting("loading", Parameter("blade speed", "speed", "mm/s", 0, False, _NO_LIMIT, False, (0.01, 1e5))),
    "clearance": Setting("supports", _length("clearance", 0.1, 500)),
    "fillet_radius": Setting("supports", _length("fillet radius of the supports", 0.01, 50, zero=True)),
    "height": Setting("supports", _length("cutting height", 1, 2000)),
    "outer_diameter": Setting("specimen", _length("outer diameter", 1, 100)),
    "diameter_ratio": Setting("specimen", Parameter("diameter ratio", "dimensionless", "1", 0, True, 1, False, (0, 1))),
}
IN_DECKS = {**PARAMETERS, **{name: setting.parameter for name, setting in SETTINGS.items()}}
EMBEDDED = {**IN_DECKS, FRICTION: _OF_STEM}

MOST_FACTORS = 100
Symbol = Annotated[str, StringConstraints(strict=True, strip_whitespace=True, min_length=1, max_length=12), Readable]
UnitText = Annotated[
    str,
    BeforeValidator(lambda raw: "1" if raw == 1 and not isinstance(raw, bool) else raw),
    StringConstraints(strict=True, min_length=1, max_length=24),
    Readable,
]


class PriorKnowledge(Frozen):
    """Prior knowledge of a factor as a normal distribution; the calibration treats the prior as a measurement."""

    mean: Number
    """Mean of the prior distribution, in the unit of the factor."""
    sd: Annotated[Number, Field(gt=0)]
    """Standard deviation of the factor among the stems of this study, not the standard error of the mean."""
    source: Annotated[Title, Field(min_length=3)]
    """Source of the prior distribution, such as a publication; the report shows the source."""


class Factor(Frozen):
    """One parameter to calibrate, with its search range."""

    name: FactorName
    """Name of the factor in tables and files. The `embedded` and `deck` solvers accept nine material parameters and
    ten settings of the test, which have the names of their keys: `edge_angle`, `sliding_angle`, `edge_radius`,
    `thickness` (of the blade), `speed`, `clearance`, `fillet_radius`, `height`, `outer_diameter` and `diameter_ratio`.
    With layers, also their thicknesses, such as `skin_thickness`. `bevel` cannot be a factor because it is a word, not
    a range. The `embedded` solver also accepts the coefficient of friction `stem_friction`. With the other solvers, any
    name is allowed."""
    symbol: Symbol
    """Symbol of the factor in tables and equations; by default X1 for the first factor, X2 for the second, and so
    on."""
    label: Label
    """Label of the factor in the report and in figures; by default derived from `name`."""
    unit: UnitText = "1"
    """Unit of `low`, `high` and all levels of the factor; 1 for a dimensionless factor."""
    low: Number
    """Lower limit of the search range."""
    high: Number
    """Upper limit of the search range."""
    prior: PriorKnowledge | None = None
    """Prior knowledge of the factor; by default all values from `low` to `high` are equally likely."""
    expected_sign: Literal["+", "-"] | None = None
    """Expected sign of the effect of the factor; the opposite sign in the screening causes a warning."""

    @property
    def centre(self) -> float:
        """Mid-level in `unit`, rounded to twelve digits: the middle of 0.2 and 0.4 is exactly 0.3."""
        return float(f"{0.5 * (self.low + self.high):.12g}")

    @property
    def half_range(self) -> float:
        """Half of `high` − `low`, in `unit`."""
        return 0.5 * (self.high - self.low)

    def internal(self, value: float) -> float:
        """Convert a value in `unit` to internal units."""
        return units.convert(value, self.unit)


class OwnQuantity(Frozen):
    """A response or a condition of the measurements that a study declares; values are in `unit`."""

    name: ColumnName
    """Name of the response or condition in tables, in files, in `targets` and in `solver.result`. In a template,
    `{{name}}` is replaced by the value of the condition."""
    symbol: Symbol | None = None
    """Symbol in equations and on axes; by default Y for a response and x for a condition."""
    label: Label | None = None
    """Label of the response or condition in the report and in figures; by default derived from `name`."""
    unit: UnitText = "1"
    """Unit of the response or condition in all results. A target can have another unit of the same dimension. An
    unknown unit is shown unchanged."""
