"""Factors, the parameters of the embedded solver, and own responses."""

from typing import Annotated, Literal, NamedTuple

from pydantic import BeforeValidator, Field, StringConstraints

from stemcal.study.types import units
from stemcal.study.types.field_types import MOST, ColumnName, FactorName, Frozen, Label, Number, Readable, Seen, Title


class Parameter(NamedTuple):
    """What one parameter is, and which values make sense.

    Bounds and plausible values are in `unit`; `lowest_allowed` and `highest_allowed` say whether the bound
    itself may be taken.
    """

    label: str
    dimension: str
    unit: str
    lowest: float
    lowest_allowed: bool
    highest: float
    highest_allowed: bool
    plausible: tuple[float, float]

    def outside(self, value: float) -> str | None:
        """Return what is wrong with `value` (in `unit`), or None if physics allows it."""
        if abs(value) > MOST:
            return "is outside the computable range"
        if value < self.lowest or (value == self.lowest and not self.lowest_allowed):
            return f"must {'not be below' if self.lowest_allowed else 'be above'} {in_unit(self.lowest, self.unit)}"
        if value > self.highest or (value == self.highest and not self.highest_allowed):
            return f"must {'not be above' if self.highest_allowed else 'be below'} {in_unit(self.highest, self.unit)}"
        return None

    @property
    def usual(self) -> str:
        """The plausible values."""
        low, high = self.plausible
        return f"{low:g} to {in_unit(high, self.unit)}"


def in_unit(value: float, unit: str) -> str:
    """Return a value with its unit as a spec has it; pure numbers have none.

    >>> in_unit(1100, "kg/m3"), in_unit(0.3, "1")
    ('1100 kg/m3', '0.3')
    """
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

# What is no property of the material; each takes the place of the keys of a section.
AROUND: dict[str, tuple[Parameter, str, tuple[str, ...]]] = {
    "stem_friction": (
        Parameter("friction of the stem", "dimensionless", "1", 0, True, 2, True, (0.01, 1)),
        "contact",
        ("static_friction", "dynamic_friction", "decay"),
    ),
    "wall_thickness": (
        Parameter("wall thickness", "length", "mm", 0, False, _NO_LIMIT, False, (0.1, 20)),
        "specimen",
        ("diameter_ratio",),
    ),
}
EMBEDDED = {**PARAMETERS, **{name: parameter for name, (parameter, _, _) in AROUND.items()}}


MOST_FACTORS = 100


Symbol = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=12), Readable, Seen]
UnitText = Annotated[
    str,
    BeforeValidator(lambda given: "1" if given == 1 and not isinstance(given, bool) else given),
    StringConstraints(strict=True, min_length=1, max_length=24),
    Readable,
]


class PriorKnowledge(Frozen):
    """Knowledge of a factor from other sources, normally distributed; the calibration uses it as a measurement."""

    mean: Number
    """Mean of its value, in the unit of the factor."""
    sd: Annotated[Number, Field(gt=0)]
    """Standard deviation of its value among the stems of this study, not the standard error of a mean."""
    source: Annotated[Title, Field(min_length=3), Seen]
    """Source of the distribution: a publication or a test; the report shows it."""


class Factor(Frozen):
    """One parameter to calibrate, with the range to search."""

    name: FactorName
    """Name in tables and files. With the embedded solver: one of its nine material parameters, `stem_friction`
    (friction at any speed) or `wall_thickness` (at the calibration diameter; other stems have the same ratio). With
    other programs: any name."""
    symbol: Symbol
    """Symbol in tables and equations; X1, X2, … by default."""
    label: Label
    """Name in the report and in figures; by default derived from `name`."""
    unit: UnitText = "1"
    """Unit of `low`, `high` and all results; 1 for pure numbers."""
    low: Number
    """Lower limit of the search range."""
    high: Number
    """Upper limit of the search range."""
    prior: PriorKnowledge | None = None
    """Prior knowledge; by default all values between low and high are equally likely."""
    expected_sign: Literal["+", "-"] | None = None
    """Sign of the effect expected from mechanics; the opposite sign in the screening gives a warning."""

    @property
    def centre(self) -> float:
        """The mid-level, in `unit`."""
        # twelve digits: the middle of 0.2 and 0.4 is 0.3
        return float(f"{0.5 * (self.low + self.high):.12g}")

    @property
    def half_range(self) -> float:
        """Half the distance from low to high, in `unit`."""
        return 0.5 * (self.high - self.low)

    def internal(self, value: float) -> float:
        """Convert a value in `unit` to internal units."""
        return units.convert(value, self.unit)


class OwnQuantity(Frozen):
    """A response, or the condition at which responses are measured, declared by a study; values are in `unit`."""

    name: ColumnName
    """Name in tables and files; also the key in `targets` and `solver.result`; templates contain a condition as
    `{{name}}`."""
    symbol: Symbol | None = None
    """Symbol in equations and on axes; by default Y for a response, x for the condition."""
    label: Label | None = None
    """Name in the report, figures and sentences; by default derived from `name`."""
    unit: UnitText = "1"
    """Unit of its values everywhere. Targets may have another unit of the same kind; an unknown unit is shown
    unchanged."""
