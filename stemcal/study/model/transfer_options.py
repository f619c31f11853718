"""The calibrated parameters taken to another program or another mesh: what answers there, what may move."""

from typing import Annotated, Any, Literal

from pydantic import AliasChoices, BeforeValidator, Field

from stemcal.study.model.frozen import Frozen, Time
from stemcal.study.model.program_options import CommandSolver, DeckSolver
from stemcal.study.model.sheet_options import SheetSolver
from stemcal.study.model.solver_options import EmbeddedSolver
from stemcal.study.types.field_types import Number, Whole
from stemcal.study.types.lengths import StemLengthOrZero

Target = EmbeddedSolver | CommandSolver | SheetSolver | DeckSolver


class OwnRange(Frozen):
    """Between which values a factor may move there; in the factor's unit."""

    low: Number | None = None
    """The lowest value; that of the factor's range by default."""
    high: Number | None = None
    """The highest value; that of the factor's range by default."""


def _by_name(given: Any) -> Any:
    """Take a list of names as a mapping without ranges."""
    names = isinstance(given, list) and all(isinstance(name, str) for name in given)
    return {name: {} for name in given} if names else given


class TransferTest(Frozen):
    """What else is different in the virtual test there."""

    internal_length: StemLengthOrZero | None = None
    """`material.internal_length` there; `0 mm` where elements fail each by itself."""
    edge_spread: StemLengthOrZero | None = None
    """`blade.edge_spread` there; `0 mm` for a sharp edge."""
    duration: Time | None = None
    """`loading.duration` there: elements that fail each by themselves may need a longer stroke to the same force."""

    @property
    def changes(self) -> dict[str, dict[str, object]]:
        """The values that change, by section and key."""
        keys = (("material", "internal_length"), ("blade", "edge_spread"), ("loading", "duration"))
        return {section: {key: value} for section, key in keys if (value := getattr(self, key)) is not None}


class TransferOptions(Frozen):
    """The program or mesh that the parameters are for, in which the calibrated point is run and corrected."""

    solver: Annotated[Target, Field(discriminator="kind")]
    """What answers there: any solver with its keys, also the embedded one with another mesh. Keys that are left out are
    the study's where its solver is of the same kind."""
    test: TransferTest = TransferTest()
    """What else is different there; as in the study by default."""
    adjust: Annotated[dict[str, OwnRange], BeforeValidator(_by_name)] = {}
    """What may move, in this order: names of factors, or a range of its own for each. By default the failure strain if
    the surface has it, else the strongest factor. Without a range of its own a factor keeps to the study's; but the
    failure strain, which belongs to mesh and lengths, may go from a tenth of its lower end to 1."""
    conditions: Literal["all", "calibrate_at"] = Field(
        default="all", validation_alias=AliasChoices("diameters", "conditions")
    )
    """Where the result is run too: at `all` that were measured, or nowhere but at the one of the calibration."""
    tolerance_percent: Annotated[Number, Field(gt=0, le=50)] = 2.0
    """Done once the response there is within this of what it is fitted to."""
    budget: Annotated[Whole, Field(ge=1, le=1000)] = 8
    """Most runs of that program: the search goes first, then the other diameters with the result, then with the values
    as they were calibrated."""

    def solver_beside(self, own: object) -> Target:
        """Return what answers there, beside the study's own solver."""
        if not isinstance(own, type(self.solver)):
            return self.solver
        given = {name: getattr(self.solver, name) for name in self.solver.model_fields_set}
        return own.model_copy(update=given)
