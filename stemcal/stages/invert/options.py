"""The `invert` section: the fitted values, and the rule that selects a solution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isclose
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema

from stemcal.stages.rsm.options import RsmOptions
from stemcal.study.types.factor import EMBEDDED
from stemcal.study.types.field_types import Frozen
from stemcal.study.types.named import OwnCondition, responses_by_name
from stemcal.study.types.strict_yaml import Finding
from stemcal.vocabulary import FIRST, Wording

if TYPE_CHECKING:
    from stemcal.study.model.measured_targets import Target
    from stemcal.study.model.study import Study
    from stemcal.study.rules import Draft


_MANY_MEANS = 100  # number of means from which a fit takes more than a few seconds
_AtSize = Annotated[float, OwnCondition("length", above=0)]

Responses = Annotated[
    tuple[str, ...],
    BeforeValidator(responses_by_name),
    WithJsonSchema({"anyOf": [{"const": "all"}, {"type": "array", "items": {"type": "string"}}]}),
]


class InvertOptions(Frozen):
    """The fitted conditions and responses, and the rule that selects the solution.

    Several conditions or responses are fitted jointly.
    """

    rule: Literal["least_coded_distance", "others_at_centre"] = "least_coded_distance"
    """Rule that selects the solution: the point nearest to the centre, or the point with all factors except the
    strongest at the centre."""
    conditions: Literal["all"] | Annotated[tuple[_AtSize, ...], Field(min_length=1)] | None = Field(
        default=None, validation_alias="diameters", serialization_alias="diameters"
    )
    """The fitted diameters or other conditions: `all` or a list. The response surface design is simulated at every
    fitted condition. The parameters are calibrated at the first condition of the list. The default is
    `specimen.outer_diameter` if a target has this diameter, otherwise the diameter in the first row of `targets`."""
    responses: Responses = (FIRST,)
    """The fitted responses: a list, or `all` for all measured responses. By default only the force of the cutting test
    is fitted, together with the responses that the spec declares and those of other tests and of curves."""


def _joint_conditions_measured(draft: Draft) -> Iterator[Finding]:
    if (wanted := draft.study.of(InvertOptions).conditions) is None:
        return
    if draft.naming.condition is None:
        remedy = "declare a condition in the `conditions` section, or remove this key"
        yield Finding(("invert", "diameters"), "the study has no conditions", remedy)
        return
    if wanted == "all":
        return
    measured = [target.condition for target in draft.study.targets.means]
    for index, condition in enumerate(wanted):
        if any(isclose(condition, other) for other in wanted[:index]):
            message = f"{Wording(draft.naming).conditions([condition])} is listed twice"
            yield Finding(("invert", "diameters", index), message, "remove one")
        if not any(isclose(condition, other) for other in measured):
            named, listed = draft.naming, ", ".join(f"{value:g}" for value in measured[:20])
            place = Wording(named).conditions([condition])
            message = f"no {named.response.noun} is given for {place}; values are given only for {listed}"
            remedy = f"add the {named.response.noun} to `targets`, or remove this value"
            yield Finding(("invert", "diameters", index), message + draft.naming.condition.unit_suffix, remedy)


def _responses_measured(draft: Draft) -> Iterator[Finding]:
    path, names, named = ("invert", "responses"), draft.study.of(InvertOptions).responses, draft.naming
    if names == (FIRST,):
        return
    if named.is_cutting and not draft.kind.gives_curve:
        yield Finding(path, f"a solver of kind `{draft.study.solver.kind}` returns only the force", "remove the key")
    if FIRST not in names or len(set(names)) < len(names):
        listed = [named.named(name).name for name in names]
        message = f"the list must contain the {named.response.noun} and must not repeat a response"
        yield Finding(path, message, f"write [{', '.join(dict.fromkeys((named.response.name, *listed)))}]")
    for key in (name for name in names if name == FIRST or not draft.tests or named.named(name).in_table):
        name = named.named(key).name
        means = ((target.row, *target.mean_of(key)) for target in draft.study.targets.means)
        scatters = {row: sd for row, mean, sd in means if mean is not None}
        if not scatters:
            remedy = "add the response to `targets`, or remove the response from this list"
            yield Finding(path, f"`targets` contains no value for {name}", remedy)
        elif all(sd is None for sd in scatters.values()):
            at_any = f" at any {named.condition.noun}" if named.condition is not None else ""
            message = f"no `sd` is given for {name}{at_any}, so its weight in the fit is unknown"
            remedy = "add sd: …" if key == FIRST else f"add sd: {{{name}: …}}"
            yield Finding(("targets", min(scatters)), message, remedy)


def _rule_uses_priors(draft: Draft) -> Iterator[Finding]:
    known = any(factor.prior is not None for factor in draft.factors.values())
    if known and draft.study.of(InvertOptions).rule != "least_coded_distance":
        remedy = "remove this key: with priors, the solution is the best fit to measurements and priors"
        yield Finding(("invert", "rule"), f"the `{draft.study.of(InvertOptions).rule}` rule ignores the priors", remedy)


def _doubts(study: Study) -> Iterator[Finding]:
    """Yield doubts about fitted responses that depend on the mesh (travel, work) and about very many means."""
    from stemcal.study.rules.plausible import FALL

    means = sum(bool(target.mean_of(name)[0]) for target in study.joint_targets for name in study.fitted_responses)
    if means > _MANY_MEANS:
        size = f"about {5e-4 * means**2:.0f} s and {7.5e-6 * means**2:.1f} GB"
        message = f"the fit of {means} means, also without each condition, takes {size} in each stage that fits"
        yield Finding(("invert", "diameters"), message, "list fewer conditions")
    own = [response for named in study.naming.further if (response := named.in_table) is not None]
    chosen = study.of(InvertOptions).responses
    fitted = [response.name for response in own if response.varies_with_mesh and response.name in chosen]
    if fitted and study.kind.gives_curve:
        depend = " and ".join(fitted) + (" depend" if len(fitted) > 1 else " depends")
        message = f"{depend} on the mesh: {FALL}"
        yield Finding(("invert", "responses"), message, "fit only the force, or include the mesh error in `sd`")


InvertOptions.doubts = _doubts


def _growth_is_seen(draft: Draft) -> Iterator[Finding]:
    if isinstance(chosen := draft.study.of(RsmOptions).factors, str):
        return
    joint: Sequence[float] | str = draft.study.of(InvertOptions).conditions or [draft.study.targets.calibrate_at]
    fitted = [target.condition for target in draft.study.targets.means] if isinstance(joint, str) else joint
    for name, growth in draft.growing.items():
        exponent, at = getattr(growth, "exponent", None), getattr(growth, "at", 0.0)
        if exponent in chosen and exponent not in EMBEDDED and all(isclose(d, at) for d in fitted):
            message = f"{exponent} has no effect because {at:g} mm is the only diameter in the fit"
            remedy = "write `diameters: all` in the `invert` section, or another diameter for `at`"
            yield Finding(("material", name, "at"), message, remedy)


def _surface_over_conditions(draft: Draft) -> Iterator[Finding]:
    if draft.study.of(RsmOptions).over == "factors" or not draft.study.of(RsmOptions).wanted:
        return
    remedy = "remove `rsm.over`"
    wanted = draft.study.of(InvertOptions).conditions
    measured = {target.condition for target in draft.study.targets.means}
    if len(measured if wanted == "all" else wanted or ()) < 2:
        condition = "condition" if draft.naming.condition is None else draft.naming.condition.noun
        message = f"`rsm.over` requires several fitted values of the {condition}"
        yield Finding(("invert", "diameters"), message, "write `diameters: all`, or remove `rsm.over`")
    if draft.tests:
        yield Finding(("tests",), "`rsm.over` has runs at other diameters than those of laboratory tests", remedy)
    if draft.kind.answers == "looks_up":
        yield Finding(("solver", "kind"), "a table does not contain the runs that `rsm.over` requires", remedy)


InvertOptions.rules = (
    *(_joint_conditions_measured, _responses_measured, _rule_uses_priors, _growth_is_seen),
    _surface_over_conditions,
)


def fitted_together(study: Study) -> tuple[Target, ...]:
    """Return the targets that are fitted jointly, at one or more conditions; none if a single value is fitted."""
    options, means = study.of(InvertOptions), study.targets.means
    wanted = options.conditions
    if wanted is None or (wanted != "all" and len(wanted) == 1):
        several = len(options.responses) > 1 or any(factor.prior is not None for factor in study.factors)
        return (study.calibration_target,) if several else ()
    return tuple(t for t in means if wanted == "all" or any(abs(t.condition - d) < 1e-6 for d in wanted))


def chose_conditions(study: Study) -> bool:
    """Whether the spec lists the conditions to fit; advice must not change such a list."""
    return study.of(InvertOptions).conditions not in (None, "all")
