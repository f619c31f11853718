"""The refinement: where the parameters are used, what may move there, and when the loop ends."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from stemcal.study.model.frozen import Frozen, Time
from stemcal.study.model.program_options import CommandSolver, DeckSolver
from stemcal.study.model.sheet_options import SheetSolver
from stemcal.study.model.solver_options import EmbeddedSolver
from stemcal.study.types.field_types import Number, Whole
from stemcal.study.types.lengths import StemLengthOrZero

Elsewhere = EmbeddedSolver | CommandSolver | SheetSolver | DeckSolver

_NAMES = {"type": "array", "items": {"type": "string"}}
_RANGE = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_RANGES = {"type": "object", "additionalProperties": {"anyOf": [_RANGE, {"type": "null"}]}}


def _by_name(given: Any) -> Any:
    """Accept a list of names as a mapping without ranges."""
    names = isinstance(given, list) and all(isinstance(name, str) for name in given)
    return dict.fromkeys(given) if names else given


class RefineOptions(Frozen):
    """Simulate at the solution, correct it and step, until the response is right."""

    in_: Annotated[Elsewhere, Field(discriminator="kind")] | None = Field(
        default=None, validation_alias="in", serialization_alias="in"
    )
    """The program or the mesh where the parameters will be used: any solver with its keys, also `embedded` with another
    mesh. Keys that are left out are the study's if its solver is of the same kind. By default the study's own model."""
    internal_length: StemLengthOrZero | None = None
    """`material.internal_length` in `in`; `0 mm` where each element fails by itself."""
    edge_spread: StemLengthOrZero | None = None
    """`blade.edge_spread` in `in`; `0 mm` for a sharp edge."""
    duration: Time | None = None
    """`loading.duration` in `in`: without lengths the blade may need a longer stroke to the same force."""
    adjust: Annotated[
        dict[str, tuple[Number, Number] | None],
        BeforeValidator(_by_name),
        WithJsonSchema(
            {"anyOf": [_NAMES, {"type": "object", "additionalProperties": {"anyOf": [_RANGE, {"type": "null"}]}}]}
        ),
    ] = {}
    """Factors that may move in `in`, in this order: names, or `name: [low, high]`. By default the failure strain if the
    surface has it, else the strongest factor. Without a range a factor keeps the study's; the failure strain, which
    depends on mesh and lengths, may move from a tenth of its lower end to 1."""
    tolerance_percent: Annotated[Number, Field(gt=0, le=50)] = 1.0
    """The loop ends once the simulated response is within this of the target."""
    budget: Annotated[Whole, Field(ge=1, le=1000)] = 10
    """Most runs. With `in`, runs that are left simulate the other measured conditions."""

    @property
    def changes(self) -> dict[str, dict[str, object]]:
        """What is different in the test simulated by `in`, by section and key."""
        keys = (("material", "internal_length"), ("blade", "edge_spread"), ("loading", "duration"))
        return {section: {key: value} for section, key in keys if (value := getattr(self, key)) is not None}

    @property
    def elsewhere(self) -> bool:
        """Whether the parameters are used in another model than the study's own."""
        return self.in_ is not None

    def solver_there(self, own: Any) -> Any:
        """Return the solver of `in`, completed by the study's own of the same kind."""
        if self.in_ is None or not isinstance(own, type(self.in_)):
            return self.in_ or own
        return own.model_copy(update={name: getattr(self.in_, name) for name in self.in_.model_fields_set})
