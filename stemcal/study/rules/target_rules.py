"""Rules on measured data or the goal of a study, on the geometry of the cutting test, and on other laboratory tests."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from math import isclose, radians, tan

from stemcal.formats import listed
from stemcal.responses import CUT, FURTHER_CUT, response_of, responses_in
from stemcal.study.rules import Draft
from stemcal.study.rules.factors import settings_varied
from stemcal.study.types.field_types import field_or_none
from stemcal.study.types.named import CHANCE
from stemcal.study.types.stage_kind import STAGES
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
    supports, blade, length = draft.study.supports, draft.study.blade, draft.study.specimen.length
    if supports.kind != "span":
        return
    if supports.clearance + 0.6 * supports.fillet_radius >= length:  # the ends would slide off the fillets
        sizes = f"clearance {supports.clearance:g} mm, fillets {supports.fillet_radius:g} mm"
        message = f"the specimen is only {length:g} mm long, too short for these supports ({sizes})"
        yield Finding(("supports", "clearance"), message, "move the supports closer together or use a longer specimen")
    if draft.study.loading.until == "severed" and blade.thickness >= supports.clearance:
        message = f"the blade ({blade.thickness:g} mm thick) does not fit into the gap of {supports.clearance:g} mm"
        yield Finding(("supports", "clearance"), message, "increase `clearance`, or use a thinner blade")


def _clamp_is_in_place(draft: Draft) -> Iterator[Finding]:
    supports, blade, length = draft.study.supports, draft.study.blade, draft.study.specimen.length
    for key in sorted(supports.model_fields_set - {"kind", *supports.keys_in_use}):
        message, factor = f"`{key}` has no effect with `kind: {supports.kind}`", settings_varied(draft).get(key)
        place: NodePath = ("supports", key) if factor is None else ("factors", factor, "name")
        remedy = f"remove this {'key' if factor is None else 'factor'}, or write another `kind` under `supports`"
        yield Finding(place, message, remedy, at_key=factor is None)
    if supports.kind == "span":
        return
    # a blade with one bevel is entirely on the free side of the cut, one with two bevels is centred over the cut
    near = 0.5 * blade.thickness if blade.bevel == "both" else 0.0
    far, knife = blade.thickness - near, supports.kind == "counter_edge"
    if knife and supports.clearance and "clearance" not in {*supports.model_fields_set, *draft.names}:
        yield Finding(("supports", "kind"), "`counter_edge` requires `clearance`", "add `clearance: 1 mm`")
    elif knife and near + supports.clearance + supports.fillet_radius >= supports.height:
        message = f"the fixed knife ({supports.clearance:g} mm from the blade) is beyond the clamp"
        yield Finding(("supports", "clearance"), message, "reduce `clearance`, or increase `height`")
    if supports.height <= near:
        message = f"the clamp is {supports.height:g} mm from the cut, inside the blade ({blade.thickness:g} mm thick)"
        yield Finding(("supports", "height"), message, "increase `height`")
    elif supports.height >= length:
        message = f"the clamp is {supports.height:g} mm from the cut, but the specimen is only {length:g} mm long"
        remedy = "reduce `height`, or increase `specimen.length`, which includes the free part beyond the cut"
        yield Finding(("supports", "height"), message, remedy)
    elif length - supports.height <= far:
        message = f"only {length - supports.height:.3g} mm of the specimen are beyond the cut, within the blade"
        yield Finding(("specimen", "length"), message, "increase `length`, or reduce `height`")


def _edge_fits_blade(draft: Draft) -> Iterator[Finding]:
    blade = draft.study.blade
    if blade.edge_radius > blade.thickness / 2:
        message = f"the edge radius of {blade.edge_radius:g} mm exceeds half the thickness of the blade"
        yield Finding(("blade", "edge_radius"), message, f"use a radius below {blade.thickness / 2:g} mm")
    if blade.bevel == "one" and blade.edge_angle >= 90.0:
        message = f"with one bevel, the edge angle of {blade.edge_angle:g} deg must be below 90 deg"
        yield Finding(("blade", "edge_angle"), message, "write a smaller value, or `bevel: both`")
    faces, t = (1.0 if blade.bevel == "one" else 2.0), blade.thickness - 2.0 * blade.edge_radius
    shoulder = blade.edge_radius + t / faces / tan(radians(blade.edge_angle / faces))
    if shoulder >= blade.width:
        message = f"the faces of the edge are {shoulder:.3g} mm high, but the blade is only {blade.width:g} mm wide"
        yield Finding(("blade", "width"), message, "increase `width` or `edge_angle`")


_OF_SECTIONS = (_stem_reaches_over_supports, _clamp_is_in_place, _edge_fits_blade)


def _at_ends(rule: Rule) -> Rule:
    """Apply a rule at all limits of settings that are factors; report a mistake at the limit that causes it."""

    def checked(draft: Draft) -> Iterator[Finding]:
        settings, reported = settings_varied(draft), set[NodePath]()
        varied = [(name, index, draft.factors[index]) for name, index in settings.items()]
        at: dict[tuple[str, ...], dict[NodePath, Finding]] = {}
        for ends in product(("low", "high"), repeat=len(varied)):
            pairs = zip(varied, ends, strict=True)
            values = {name: factor.internal(getattr(factor, end)) for (name, _, factor), end in pairs}
            findings = rule(replace(draft, study=draft.study.with_settings(values)))
            at[ends] = {finding.path: finding for finding in findings}
        for ends, path, finding in ((ends, *each) for ends, findings in at.items() for each in findings.items()):
            place = path
            if any(path not in findings for findings in at.values()):
                others = ((*ends[:i], _OTHER[end], *ends[i + 1 :]) for i, end in enumerate(ends))
                causes = [i for i, other in enumerate(others) if path not in at[other]]
                if not causes:
                    continue  # two limits cause the mistake; a combination with only one of them reports it
                place = ("factors", varied[causes[0]][1], end := ends[causes[0]])
                finding = Finding(place, finding.message, "reduce `high`" if end == "high" else "increase `low`")
            if place not in reported:
                reported.add(place)
                yield finding

    return checked


def _friction_falls(draft: Draft) -> Iterator[Finding]:
    dynamic, static = draft.study.contact.dynamic_friction, draft.study.contact.static_friction
    if dynamic > static:
        message = f"the coefficient of dynamic friction ({dynamic:g}) exceeds that of static friction ({static:g})"
        yield Finding(("contact", "dynamic_friction"), message, "swap the two coefficients")


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
    if draft.study.machine.model_fields_set and not curved:
        message = "without curves, the `machine` section has no effect"
        yield Finding(("machine",), message, "remove the section, or list files under `curves`", at_key=True)


def _tests_differ(draft: Draft) -> Iterator[Finding]:
    seen: set[str] = set()
    for index, test in draft.tests.items():
        key = test.name.casefold()
        if (reserved := key == "cutting") or key in seen:
            owner = "the cutting test" if reserved else "another test"
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
    solver = field_or_none(draft.study, "solver")
    of_solver = () if solver is None else (lambda cut, rule=rule: rule(cut, solver) for rule in draft.kind.rules)
    for rule, (index, test) in product((*_OF_SECTIONS, *of_solver), draft.tests.items()):
        changed = replace(draft, study=draft.study.model_copy(update=test.in_place_of(draft.study)))
        for finding in set(rule(changed)).difference(rule(draft)):
            keys = finding.path[finding.path[0] == "loading" :]  # `stroke` and `speed` are keys of the test itself
            yield finding if keys[0] == "solver" else finding._replace(path=("tests", index, *keys))


def _tests_fit_the_stem(draft: Draft) -> Iterator[Finding]:
    for thickest, (index, test) in product(sorted(draft.diameters.values())[-1:], draft.tests.items()):
        for key, message, remedy in test.misfits(thickest, draft.study.specimen.ratio_at(thickest)):
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


def _goal_is_complete(draft: Draft) -> Iterator[Finding]:
    if (goal := draft.study.goal) is None:
        return
    listed = [*goal.minimise, *goal.maximise]
    if not listed:
        yield Finding(("goal",), "no response is optimised", f"add `minimise: [{draft.naming.response.name}]`")
    for name in {response for response in listed if listed.count(response) > 1}:
        yield Finding(("goal",), f"{draft.naming.named(name).name} is listed twice", "remove one")
    if len(set(listed)) > 2:
        message = f"{len(set(listed))} responses are optimised, but a Pareto front has two"
        path = ("goal", "maximise" if goal.maximise else "minimise")
        yield Finding(path, message, "remove one response, or limit it with `at_most`")


def _goal_or_targets(draft: Draft) -> Iterator[Finding]:
    if draft.study.goal is None:
        return
    if draft.study.targets.means:
        yield Finding(("targets",), "a study has a `goal` or `targets`, not both", "remove one of them", at_key=True)
    if draft.tests:
        yield Finding(("tests",), "laboratory tests require `targets`", "remove this key", at_key=True)
    if draft.naming.condition not in (None, DIAMETER):
        message = "a study with a goal has no condition"
        yield Finding(("conditions",), message, "remove `conditions`, and set its value in the program", at_key=True)
    for stage in (stage for stage in STAGES.built_in if "targets" in stage.reads):
        if (section := field_or_none(draft.study, stage.name)) is not None and section.model_fields_set:
            message = f"the `{stage.name}` stage requires `targets`, but this study has a goal"
            yield Finding((stage.name,), message, "remove this key", at_key=True)


def _responses_are_simulated(draft: Draft) -> Iterator[Finding]:
    if not draft.naming.is_cutting:
        return
    goal, severed, means = draft.study.goal, draft.study.loading.until == "severed", draft.study.targets.means
    places: list[tuple[str, NodePath]] = [(name, ("targets", m.row, name)) for m in means for name in m.further]
    if goal is not None:
        places += [(name, ("goal", "at_most", draft.naming.named(name).name)) for name in goal.at_most]
        places += [(name, ("goal", key)) for key in ("minimise", "maximise") for name in getattr(goal, key)]
    for name, path in places:
        if goal is not None and name != FIRST and not draft.kind.gives_curve:
            message = f"a solver of kind `{draft.study.solver.kind}` returns only the force"
            yield Finding(path, message, f"declare both under `responses`, such as `- {{name: {name}, unit: mJ}}`")
        elif (response := response_of(name, CUT)) and FURTHER_CUT not in response.tests and not severed:
            message = f"{name} requires a cut all the way through the stem"
            yield Finding(path, message, "write `until: severed` in the `loading` section")


RULES: tuple[Rule, ...] = (
    _names_are_free, _conditions_differ, *map(_at_ends, _OF_SECTIONS),
    _friction_falls, _tests_are_simulated, _curves_are_simulated, _tests_differ, _tests_have_what_they_need,
    _further_cuts_are_possible, _tests_fit_the_stem, _test_targets_need_forces,
    _own_names_are_of_programs, _goal_is_complete, _goal_or_targets, _responses_are_simulated,
)  # fmt: skip
