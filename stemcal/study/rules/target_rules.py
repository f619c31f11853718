"""Rules on measured data, on the geometry of the cutting test, and on other laboratory tests."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from math import isclose

from stemcal.formats import listed
from stemcal.responses import responses_in
from stemcal.study.rules import Draft
from stemcal.study.rules.factors import settings_varied
from stemcal.study.types.named import CHANCE
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.vocabulary import DIAMETER, FIRST, FORCE, Wording

_OTHER = {"low": "high", "high": "low"}
Rule = Callable[[Draft], Iterator[Finding]]
_OF_ROWS = ("test", "sd", "n", "curves")


def _names_are_free(draft: Draft) -> Iterator[Finding]:
    if draft.naming.is_cutting:
        return
    in_use = {**dict.fromkeys(_OF_ROWS, "a key of `targets`"), **dict.fromkeys(CHANCE, "a placeholder")}
    in_use |= dict.fromkeys(draft.names, "a factor")
    for section in ("responses", "conditions"):
        for index, declared in enumerate(getattr(draft.study, section) or ()):
            if declared.name in in_use:
                message = f"{declared.name!r} is already {in_use[declared.name]}"
                yield Finding((section, index, "name"), message, "choose another name")
            in_use[declared.name] = "the name of another response or condition"
            if index == 0:
                in_use.setdefault(FIRST, "a reserved name")


def _conditions_differ(draft: Draft) -> Iterator[Finding]:
    seen: dict[float, int] = {}
    for target in draft.study.targets.means:
        first = seen.setdefault(round(target.condition, 9), target.row)
        if first != target.row:
            named = draft.naming
            message = f"the study has two targets{Wording(named).at(target.condition)}"
            remedy = f"keep one row with the mean {named.response.noun}, `sd` and `n`"
            at: NodePath = ("targets", target.row)
            yield Finding((*at, named.condition.name) if named.condition else at, message, remedy)


def _own_names_are_of_programs(draft: Draft) -> Iterator[Finding]:
    if draft.naming.is_cutting or draft.kind.own_responses or draft.tests or draft.study.targets.modes:
        return
    for section, is_own in (
        ("responses", draft.naming.response != FORCE or draft.naming.others),
        ("conditions", draft.naming.condition != DIAMETER),
    ):
        if is_own:
            message = f"the {draft.study.solver.title} solver returns only the maximum force of a stem"
            yield Finding((section,), message, f"remove `{section}`, or use `solver: {{kind: command}}`", at_key=True)


def _stem_reaches_over_supports(draft: Draft) -> Iterator[Finding]:
    if draft.study.supports.kind == "span" and draft.study.supports.clearance >= draft.study.specimen.length:
        message = (
            f"the supports are {draft.study.supports.clearance:g} mm apart, but the specimen is only "
            f"{draft.study.specimen.length:g} mm long"
        )
        yield Finding(("supports", "clearance"), message, "move the supports closer together or use a longer specimen")


def _clamp_is_in_place(draft: Draft) -> Iterator[Finding]:
    supports, blade, length = draft.study.supports, draft.study.blade, draft.study.specimen.length
    if supports.kind == "span":
        if "height" in supports.model_fields_set and "height" not in draft.names:
            message = "`height` has no effect with two supports"
            yield Finding(("supports", "height"), message, "remove `height`, or add `kind: clamped`", at_key=True)
        return
    half_blade, knife = (0.5 if blade.bevel == "both" else 1.0) * blade.thickness, supports.kind == "counter_edge"
    if knife and "clearance" not in {*supports.model_fields_set, *draft.names}:
        yield Finding(("supports", "kind"), "`counter_edge` requires `clearance`", "add `clearance: 1 mm`")
    elif knife and half_blade + supports.clearance + supports.fillet_radius >= supports.height:
        message = f"the fixed knife ({supports.clearance:g} mm from the blade) is beyond the clamp"
        yield Finding(("supports", "clearance"), message, "reduce `clearance`, or increase `height`")
    if supports.height <= half_blade:
        message = f"the clamp is {supports.height:g} mm from the cut, inside the blade ({blade.thickness:g} mm thick)"
        yield Finding(("supports", "height"), message, "increase `height`")
    elif supports.height >= length:
        message = f"the clamp is {supports.height:g} mm from the cut, but the specimen is only {length:g} mm long"
        remedy = "reduce `height`, or increase `specimen.length`, which includes the free part beyond the cut"
        yield Finding(("supports", "height"), message, remedy)


def _edge_fits_blade(draft: Draft) -> Iterator[Finding]:
    if draft.study.blade.edge_radius > draft.study.blade.thickness / 2:
        message = f"the edge radius of {draft.study.blade.edge_radius:g} mm exceeds half the thickness of the blade"
        yield Finding(("blade", "edge_radius"), message, f"use a radius below {draft.study.blade.thickness / 2:g} mm")


_OF_SECTIONS = (_stem_reaches_over_supports, _clamp_is_in_place, _edge_fits_blade)


def _at_ends(rule: Rule) -> Rule:
    """Return a rule that checks all combinations of `low` and `high` of the factors that are settings of the test."""

    def checked(draft: Draft) -> Iterator[Finding]:
        settings, reported = settings_varied(draft), set[NodePath]()

        def findings_at(ends: Mapping[str, str]) -> set[Finding]:
            varied = {name: draft.factors[settings[name]] for name in ends}
            values = {name: factor.internal(getattr(factor, ends[name])) for name, factor in varied.items()}
            return {*rule(replace(draft, study=draft.study.with_settings(values)))}

        if not settings:
            yield from rule(draft)
        for chosen in product(("low", "high"), repeat=len(settings)) if settings else ():
            ends = dict(zip(settings, chosen, strict=True))
            for finding in findings_at(ends):
                causes = [name for name, end in ends.items() if finding not in findings_at({**ends, name: _OTHER[end]})]
                name = next(iter(causes), next(iter(settings)))
                path: NodePath = ("factors", settings[name], ends[name])
                if path not in reported:
                    reported.add(path)
                    yield Finding(path, finding.message, "reduce `high`" if ends[name] == "high" else "increase `low`")

    return checked


def _friction_falls(draft: Draft) -> Iterator[Finding]:
    contact = draft.study.contact
    if contact.dynamic_friction > contact.static_friction:
        dynamic, static = contact.dynamic_friction, contact.static_friction
        message = f"the coefficient of dynamic friction ({dynamic:g}) exceeds that of static friction ({static:g})"
        yield Finding(("contact", "dynamic_friction"), message, "swap the two coefficients")


_CUTTING = "cutting"


def _tests_are_simulated(draft: Draft) -> Iterator[Finding]:
    if not draft.tests:
        return
    if not draft.kind.simulates_stems:
        message = f"the {draft.study.solver.title} solver cannot simulate laboratory tests"
        yield Finding(("tests",), message, "remove the tests, or use the embedded solver", at_key=True)
    for section in ("responses", "conditions"):
        if getattr(draft.study, section):
            message = f"the `{section}` section cannot be combined with laboratory tests"
            yield Finding((section,), message, f"remove `{section}` or `tests`", at_key=True)


def _curves_are_simulated(draft: Draft) -> Iterator[Finding]:
    targets = draft.study.targets
    curved = {target.row: target.condition for target in targets.means if target.curves}
    for index in curved:
        path = ("targets", index, "curves")
        if (missing := draft.study.solver.without_curve()) is not None:
            yield Finding(path, *missing)
        if not any(isclose(there, targets.calibrate_at) for there in curved.values()):
            message = f"no curves are listed for the calibration diameter of {targets.calibrate_at:g} mm"
            yield Finding(path, message, "add curves for this diameter, or fit only the force")
    machine = draft.study.machine
    if machine.model_fields_set and not curved:
        message = "without curves, the `machine` section has no effect"
        yield Finding(("machine",), message, "remove the section, or list files under `curves`", at_key=True)


def _tests_differ(draft: Draft) -> Iterator[Finding]:
    seen: set[str] = set()
    for index, test in draft.tests.items():
        key = test.name.casefold()
        if key in seen or key == _CUTTING:
            owner = "the cutting test" if key == _CUTTING else "another test"
            message = f"{test.name!r} is already the name of {owner}"
            yield Finding(("tests", index, "name"), message, "choose another name")
        seen.add(key)
        for response in test.measured:
            if test.called(response) in draft.names:
                message = f"{test.called(response)!r} is the name of both a factor and a response"
                yield Finding(("tests", index, "name"), message, "choose another name")


def _tests_have_what_they_need(draft: Draft) -> Iterator[Finding]:
    for test in draft.tests.values():
        for means in test.targets:
            own = [response.name for response in test.responses]
            for kind in responses_in(measured=means.means):
                if kind.name in means.means and kind.name not in own:
                    message = kind.why_only or f"a test of kind `{test.kind}` has no {kind.noun or kind.label}"
                    yield Finding(("targets", means.row, kind.name), message, f"use {listed(own)} instead")
            for response, mean in means.means.items():
                if mean.sd is None:
                    message = f"without `sd`, the weight of {response} in the fit is unknown"
                    yield Finding(("targets", means.row, response), message, f"add sd: {{{response}: …}}")


def _further_cuts_are_possible(draft: Draft) -> Iterator[Finding]:
    for index, test in draft.tests.items():
        changed = replace(draft, study=draft.study.model_copy(update=test.in_place_of(draft.study)))
        for rule in _OF_SECTIONS:
            for finding in set(rule(changed)).difference(rule(draft)):
                yield finding._replace(path=("tests", index, *finding.path))


def _tests_fit_the_stem(draft: Draft) -> Iterator[Finding]:
    thickest = max(draft.diameters.values(), default=None)
    for index, test in draft.tests.items():
        ratio = 0.0 if thickest is None else draft.study.specimen.ratio_at(thickest)
        for key, message, remedy in () if thickest is None else test.misfits(thickest, ratio):
            yield Finding(("tests", index, key), message, remedy)


def _test_targets_need_forces(draft: Draft) -> Iterator[Finding]:
    cut = [target.condition for target in draft.study.targets.means]
    for test in draft.tests.values():
        seen: list[float] = []
        for means in test.targets:
            place = ("targets", means.row, "diameter")
            if any(isclose(means.diameter, other) for other in seen):
                message = f"the `{test.name}` test has two rows for a diameter of {means.diameter:g} mm"
                yield Finding(place, message, "keep one row with the mean and `n`")
            if not any(isclose(means.diameter, other) for other in cut):
                listed = ", ".join(f"{other:g}" for other in cut[:20])
                message = f"no cutting force is given for a diameter of {means.diameter:g} mm, only for {listed} mm"
                yield Finding(place, message, "add a row with the cutting force, or remove this row")
            seen.append(means.diameter)


RULES: tuple[Rule, ...] = (
    _names_are_free, _conditions_differ, *map(_at_ends, _OF_SECTIONS),
    _friction_falls, _tests_are_simulated, _curves_are_simulated, _tests_differ, _tests_have_what_they_need,
    _further_cuts_are_possible, _tests_fit_the_stem, _test_targets_need_forces,
    _own_names_are_of_programs,
)  # fmt: skip
