"""What results are compared with: the laboratory's means."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isclose
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StringConstraints, ValidationInfo, WithJsonSchema
from pydantic.json_schema import SkipJsonSchema

from stemcal.measured.curve_modes import CurveModes, Machine
from stemcal.naming import CUTTING, FIRST, Named
from stemcal.study.model.frozen import Frozen, Size, SizeOrZero
from stemcal.study.types.field_types import Number, Quantity, Whole, complain
from stemcal.study.types.named import OwnCondition, OwnResponse

AtSize = Annotated[float, OwnCondition("length", above=0)]
FirstResponse = Annotated[float, OwnResponse("force", above=0)]
Work = Annotated[float, Quantity("energy", above=0)]


def _not_from_yaml(given: Any, info: ValidationInfo) -> Any:
    """Refuse what a spec writes in another way."""
    if info.context is not None and info.context.get("naming", CUTTING).is_cutting:
        raise complain("unknown key 'further'", "name each response under responses, and give its mean by that name")
    return given


def _not_in_spec(given: Any, info: ValidationInfo) -> Any:
    if info.context is not None:
        raise complain("unknown key 'modes'", "name the files under curves")
    return given


Patterns = Annotated[
    tuple[Annotated[str, StringConstraints(strict=True, min_length=1, max_length=300)], ...],
    BeforeValidator(lambda given: (given,) if isinstance(given, str) else given),
    Field(min_length=1, max_length=100),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]


class MachineSection(Frozen):
    """What is known of the testing machine, for `curves`."""

    stiffness: Annotated[float, Quantity("force per length", above=0)] | None = None
    """Force over the travel that the machine itself takes; without it the travel is taken as it stands."""
    stiffness_sd: Annotated[float, Quantity("force per length", at_least=0)] = 0.0
    """Standard deviation of what is known of it."""
    toe_sd: SizeOrZero = 0.0
    """Standard deviation of where the curves really begin, those of all diameters alike: play in the grips, a preload
    that comes late."""

    @property
    def known(self) -> Machine:
        """The same for those who read the curves."""
        return Machine(self.stiffness, self.stiffness_sd, self.toe_sd)


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
    curves: Patterns | None = None
    """Files of force over travel, beside the spec, a specimen each: names or patterns such as lab/8mm/*.csv. What they
    tell beside their maximum is fitted too; `force`, `sd` and `n` are theirs where they are not given."""
    further: SkipJsonSchema[Annotated[dict[str, Mean], BeforeValidator(_not_from_yaml)]] = Field(default={})
    modes: SkipJsonSchema[Annotated[CurveModes | None, BeforeValidator(_not_in_spec)]] = Field(default=None)

    def count_of(self, response: str) -> int | None:
        """Return over how many specimens a response was measured."""
        own = self.further[response].n if response in self.further else None
        return self.n if own is None else own

    def systematic_of(self, response: str) -> dict[str, float]:
        """Return by how much a standard deviation of what moves all specimens alike moves a response."""
        return self.further[response].systematic if response in self.further else {}

    def specimens_of(self, response: str) -> str:
        """Return a name for the specimens of a response if their curves tell it, nothing else."""
        if self.modes is None:
            return ""
        own = isclose(self.response, self.modes.force, rel_tol=1e-4) and self.n == self.modes.specimens
        scored = response in {named.name for named in named_modes([self.modes])}
        return f"{self.condition:g}" if scored or (own and response == FIRST) else ""

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
    machine: MachineSection = MachineSection()
    """The testing machine that measured `curves`."""
    tolerance_percent: Annotated[Number, Field(gt=0, lt=100)] = 10.0
    """Up to here a simulated force counts as equal to the measured one."""

    @property
    def modes(self) -> dict[float, CurveModes]:
        """The components of the curves that were measured, by condition."""
        return {target.condition: target.modes for target in self.means if target.modes is not None}

    def modes_at(self, condition: float) -> CurveModes | None:
        """Return the components of the curves that were measured at a condition, if any were."""
        return next((modes for there, modes in self.modes.items() if isclose(there, condition)), None)

    def with_modes(self, modes: Mapping[int, CurveModes]) -> Targets:
        """Return the targets with what curves tell, by the place of their entry."""
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
