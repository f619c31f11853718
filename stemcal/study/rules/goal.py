"""Rules on the goal of a study."""

from collections.abc import Callable, Iterator

from stemcal.responses import CUT, FURTHER_CUT, response_of
from stemcal.study.rules import Draft
from stemcal.study.types.field_types import field_or_none
from stemcal.study.types.stage_kind import STAGES
from stemcal.study.types.strict_yaml import Finding, NodePath
from stemcal.vocabulary import DIAMETER, FIRST


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


RULES: tuple[Callable[[Draft], Iterator[Finding]], ...] = (
    _goal_is_complete,
    _goal_or_targets,
    _responses_are_simulated,
)
