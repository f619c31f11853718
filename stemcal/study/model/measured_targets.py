"""What results are compared with: the laboratory's means, and what a paper prints."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from stemcal.naming import CUTTING, FIRST
from stemcal.study.model.frozen import Frozen, Size, SizeOrZero
from stemcal.study.types.field_types import Number, Quantity, Readable, SpecFile, Whole, complain
from stemcal.study.types.named import OwnCondition, OwnResponse

AtSize = Annotated[float, OwnCondition("length", above=0)]
FirstResponse = Annotated[float, OwnResponse("force", above=0)]
Work = Annotated[float, Quantity("energy", above=0)]
PrintedText = Annotated[str, StringConstraints(strict=True, min_length=1, max_length=40), Readable]


def _not_from_yaml(given: Any, info: ValidationInfo) -> Any:
    """Refuse what a spec writes in another way."""
    if info.context is not None and info.context.get("naming", CUTTING).is_cutting:
        raise complain("unknown key 'further'", "name each response under responses, and give its mean by that name")
    return given


class Mean(Frozen):
    """The measured mean of a further response, with its standard deviation, in its own unit.

    `n` are the specimens where they are not those of the first response.
    """

    value: float
    sd: float | None = None
    n: int | None = None


class Target(Frozen):
    """The measured mean of the first response at one condition, with its standard deviation over n specimens.

    In the shear test these are the maximum force at a stem diameter, as a spec calls them. `further` has the other
    responses that a study declares itself.
    """

    condition: AtSize = Field(alias="diameter")
    """Outer diameter of the stems."""
    response: FirstResponse = Field(alias="force")
    """Mean of their maximum shear force."""
    sd: Annotated[float, OwnResponse("force", at_least=0)] | None = None
    """Standard deviation of it over the stems; without it the mean is treated as exact."""
    n: Annotated[Whole, Field(ge=1)] | None = None
    """Number of stems."""
    travel: Size | None = None
    """How far the blade had come from first touch to the maximum, mean."""
    travel_sd: SizeOrZero | None = None
    """Standard deviation of the travel."""
    work: Work | None = None
    """Work the blade had done by then, mean."""
    work_sd: Annotated[float, Quantity("energy", at_least=0)] | None = None
    """Standard deviation of the work."""
    further: SkipJsonSchema[Annotated[dict[str, Mean], BeforeValidator(_not_from_yaml)]] = Field(default={})

    def count_of(self, response: str) -> int | None:
        """Return over how many specimens a response was measured."""
        own = self.further[response].n if response in self.further else None
        return self.n if own is None else own

    def mean_of(self, response: str) -> tuple[float | None, float | None]:
        """Return mean and standard deviation of a response by its name, or of the first one for `FIRST`."""
        if response in self.further:
            return self.further[response].value, self.further[response].sd
        known = {
            FIRST: (self.response, self.sd),
            "travel": (self.travel, self.travel_sd),
            "work": (self.work, self.work_sd),
        }
        return known.get(response, (None, None))


class Targets(Frozen):
    """What the laboratory measured, and the condition at which the parameters are calibrated."""

    calibrate_at: AtSize
    """The diameter whose force the parameters are fitted to; the others check them."""
    means: Annotated[tuple[Target, ...], Field(min_length=1, max_length=1000)] = Field(alias="forces")
    """The measured forces, an entry per diameter."""
    equivalent_within_percent: Annotated[Number, Field(gt=0, lt=100)] = 10.0
    """Up to here a simulated force counts as equal to the measured one: in the verdict, and as the margin of the
    equivalence test."""


class Published(Frozen):
    """Printed results to compare with, when a published study is analysed again."""

    screening: SpecFile | None = None
    """CSV of the printed effects."""
    coefficients: SpecFile | None = None
    """CSV of the printed coefficients."""
    anova: SpecFile | None = None
    """CSV of the printed analysis of variance."""
    solution: dict[str, Number] = {}
    """The printed parameters, by factor."""
    validation: SpecFile | None = None
    """CSV of the printed validation."""
    levels: SpecFile | None = None
    """CSV of the printed low and high levels."""
    design: SpecFile | None = None
    """CSV of the printed design."""
    claims: dict[str, PrintedText] = {}
    """Single printed numbers, by name, as text just as printed."""
    runs: Literal["computed", "measured"] | None = None
    """Whether the printed forces were `computed` (repeated runs must then agree) or `measured`."""
    bounds: Literal["coded", "natural"] | None = None
    """Whether the printed equation was searched within bounds in `coded` or in `natural` values."""
    rate_law: Literal["paper", "cowper_symonds"] | None = None
    """What the paper calls its rate law, held against the exponent that it prints."""
    called: dict[str, PrintedText] = {}
    """What the paper calls a factor, by its name here."""
