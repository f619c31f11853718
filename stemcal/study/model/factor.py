"""What is varied and what comes out: factors, responses and conditions."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints

from stemcal.study.model.frozen import Frozen
from stemcal.study.types import units
from stemcal.study.types.field_types import ColumnName, FactorName, Label, Number, Readable, Seen, Title

MOST_FACTORS = 100


Symbol = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=12), Readable, Seen]
UnitText = Annotated[
    str,
    BeforeValidator(lambda given: "1" if given == 1 and not isinstance(given, bool) else given),
    StringConstraints(strict=True, min_length=1, max_length=24),
    Readable,
]


class PriorKnowledge(Frozen):
    """What is known of a factor before anything is measured here; it enters the calibration as one more measurement."""

    kind: Literal["normal", "lognormal"] = "normal"
    """`normal`, or `lognormal` for what cannot be below 0 and scatters by a factor."""
    mean: Number
    """Mean of its value, in the unit of the factor."""
    sd: Annotated[Number, Field(gt=0)]
    """Standard deviation of its value: of what the stems of this study may have, not of a mean elsewhere."""
    source: Annotated[Title, Field(min_length=3)]
    """Where it is from: a publication, a test; it is told beside the result."""


class Factor(Frozen):
    """One parameter to calibrate, with the range to search."""

    name: FactorName
    """Name in tables and files. The embedded solver knows its nine material parameters, `stem_friction` (friction at
    any speed) and `wall_thickness` (at the calibration diameter; other stems have the same ratio); other programs
    any name."""
    symbol: Symbol
    """Short sign in tables and equations; X1, X2, … by default."""
    label: Label
    """What page and figures write; made from the name by default."""
    unit: UnitText = "1"
    """Unit of `low` and `high`, and of its values in all results; 1 for pure numbers."""
    low: Number
    """Lower end of the range that is searched."""
    high: Number
    """Upper end of the range that is searched."""
    prior: PriorKnowledge | None = None
    """What is known of it beforehand; without one all values between low and high are alike."""
    expected_sign: Literal["+", "-"] | None = None
    """What mechanics says of its effect on the force: a screening that finds the other sign says so."""

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
    """A response, or the condition at which responses are measured, where a study has its own; values are in `unit`."""

    name: ColumnName
    """Name in tables and files; `targets` and `solver.result` give values under it, templates the condition's as
    `{{name}}`."""
    symbol: Symbol | None = None
    """Short sign in equations and along axes; Y of a response, x of the condition by default."""
    label: Label | None = None
    """Text on page, figures and in sentences; made from the name by default."""
    unit: UnitText = "1"
    """Unit of its values everywhere. Targets may be written in another unit of the same kind; a unit that stemcal
    does not know is shown as it is."""
