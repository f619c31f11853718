"""The `refine` section of a spec, and the study in the other model that `refine.in` describes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from stemcal.stages.stage import has_surface
from stemcal.study.types.field_types import Frozen, Number, StemLengthOrZero, Time, Whole, complain
from stemcal.study.types.solver_kind import AnySolver, kind_of
from stemcal.study.types.strict_yaml import Finding

if TYPE_CHECKING:
    from stemcal.study.model.study import Study
    from stemcal.study.rules import Draft


_BEYOND_FACTORS = 5  # default budget per condition without a surface: runs in addition to the number of factors
_NAMES = {"type": "array", "items": {"type": "string"}}
_RANGE = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_RANGES = {"type": "object", "additionalProperties": {"anyOf": [_RANGE, {"type": "null"}]}}


def _by_name(value: Any) -> Any:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        return value
    if twice := [name for name in value if value.count(name) > 1]:
        raise complain(f"{twice[0][:60]} is listed twice", "remove one")
    return dict.fromkeys(value)


class RefineOptions(Frozen):
    """Options of the refinement: the solution is simulated and corrected until the response is within the tolerance."""

    in_: AnySolver | None = Field(default=None, validation_alias="in", serialization_alias="in")
    """The program or mesh in which the parameters will be used: any solver with its keys, or `embedded` with another
    mesh. If the solver kind is the same, omitted keys take their values from the study. The default is the model of
    the study."""
    internal_length: StemLengthOrZero | None = None
    """Value of `material.internal_length` in the model specified by `in`; `0 mm` for local failure."""
    edge_spread: StemLengthOrZero | None = None
    """Value of `blade.edge_spread` in the model specified by `in`; `0 mm` for a sharp edge."""
    duration: Time | None = None
    """Value of `loading.duration` in the model specified by `in`. Without characteristic lengths, the same force may
    require a longer stroke."""
    adjust: Annotated[
        dict[str, tuple[Number, Number] | None], BeforeValidator(_by_name), WithJsonSchema({"anyOf": [_NAMES, _RANGES]})
    ] = {}
    """Factors that may change in the model specified by `in`, in this order: names, or `name: [low, high]`. The default
    is the failure strain if the response surface varies it, otherwise the strongest factor. If a factor has no limits,
    its range in the study is used; the range of the failure strain extends from a tenth of its lower limit to 1."""
    tolerance_percent: Annotated[Number, Field(gt=0, le=50)] = 1.0
    """Largest allowed error in the simulated response at the calibrated values, in percent."""
    budget: Annotated[Whole, Field(ge=1, le=1000)] = 10
    """Maximum number of runs. With `in`, the remaining runs are used to simulate the other measured conditions. With
    `rsm: {design: none}`, the default is 5 runs more than there are factors, at each fitted condition."""

    @property
    def changes(self) -> dict[str, dict[str, object]]:
        """Settings of the test that differ in the model of `in`, by section and key."""
        keys = (("material", "internal_length"), ("blade", "edge_spread"))
        changes = {section: {key: value} for section, key in keys if (value := getattr(self, key)) is not None}
        return changes | ({"loading": {"duration": self.duration, "stroke": None}} if self.duration is not None else {})

    @property
    def elsewhere(self) -> bool:
        """Whether the parameters will be used in another model than the study's own."""
        return self.in_ is not None


def most_runs(study: Study) -> int:
    """Return the largest number of runs of the refinement."""
    options = study.of(RefineOptions)
    if has_surface(study) or "budget" in options.model_fields_set:
        return options.budget
    return (len(study.factors) + _BEYOND_FACTORS) * max(len({target.condition for target in study.joint_targets}), 1)


def seen(study: Study) -> Study:
    """Return the study with the solver and settings of `refine.in`; the study itself without this key."""
    options = study.section(RefineOptions)
    if options is None or (solver := options.in_) is None:
        return study
    if solver.kind == study.solver.kind:  # omitted keys have the values of the study
        solver = study.solver.model_copy(update={name: getattr(solver, name) for name in solver.model_fields_set})
    sections = {name: getattr(study, name).model_copy(update=change) for name, change in options.changes.items()}
    return study.model_copy(update={"solver": solver, "refine": None, **sections})


def _refinement_is_possible(draft: Draft) -> Iterator[Finding]:
    if (refine := draft.study.section(RefineOptions)) is None:
        return
    if refine.elsewhere and not has_surface(draft.study):
        message = "the refinement cannot calibrate the parameters in another model (`rsm.design: none`)"
        yield Finding(("refine", "in"), message, "remove `refine.in`", at_key=True)
    by_name = {factor.name: factor for factor in draft.factors.values()}
    for name, ends in refine.adjust.items():
        if name not in draft.names:
            yield draft.unknown_factor(("refine", "adjust", name), name)
        elif name in by_name and ends is not None and ends[0] >= ends[1]:
            message = f"low {ends[0]:g} is not below high {ends[1]:g}"
            yield Finding(("refine", "adjust", name), message, "widen the range")
    if not refine.elsewhere and (refine.adjust or refine.changes):
        key = "adjust" if refine.adjust else next(iter(next(iter(refine.changes.values()))))
        message = "this key requires `refine.in`, which is missing"
        yield Finding(("refine", key), message, "add `refine.in`, or remove this key", at_key=True)
    if refine.in_ is not None and draft.kind.answers == kind_of(refine.in_).answers == "asks_people":
        message = "this study's results are entered by hand; a run sheet can contain the results of only one program"
        yield Finding(("refine", "in", "kind"), message, "create a separate study for the other program")


def _tests_and_curves_stay_here(draft: Draft) -> Iterator[Finding]:
    if not draft.study.of(RefineOptions).elsewhere:
        return
    if draft.tests:
        message = "the laboratory tests cannot be simulated in another model"
        yield Finding(("refine", "in"), message, "remove `refine.in` or the tests", at_key=True)
    if any(target.curves for target in draft.study.targets.means):
        message = "measured curves cannot be compared with simulations in another model"
        yield Finding(("refine", "in"), message, "remove `refine.in` or the curves", at_key=True)


def _the_model_is_possible(draft: Draft) -> Iterator[Finding]:
    """Yield mistakes of the study in the model of `refine.in`, where a factor may be without effect unless it moves."""
    from stemcal.study.reading.read import broken_rules

    if (there := seen(draft.study)) is draft.study:
        return
    for finding in broken_rules(replace(draft, study=there)):
        section = finding.path[0] if finding.path else ""
        if section == "solver":
            yield finding._replace(path=("refine", "in", *finding.path[1:]))
        elif section in ("responses", "conditions") and draft.kind.own_responses:
            yield finding._replace(path=("refine", "in"), at_key=False)
        elif section == "factors" and isinstance(index := finding.path[1], int):
            factor = draft.factors.get(index)
            moving = draft.study.of(RefineOptions).adjust
            if factor is not None and factor.name in moving and finding.path[2:] == ("name",):
                yield finding._replace(path=("refine", "adjust", factor.name))


RefineOptions.rules = (_refinement_is_possible, _tests_and_curves_stay_here, _the_model_is_possible)


def _doubts(study: Study) -> Iterator[Finding]:
    from stemcal.study.rules.plausible import doubt

    if duration := study.of(RefineOptions).duration:
        yield from doubt(("refine", "duration"), duration, 1e-5, 1000, "s")


RefineOptions.doubts = _doubts
