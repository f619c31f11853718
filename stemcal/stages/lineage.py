"""What a stage was made from, so that no stage builds on results of another spec.

Every stage file carries ``inputs``: short hashes of the factors, of its options, of all that its solver says
determines an answer, and of the stage file before it. A stage whose hashes no longer agree is stale, and the
hashes that differ tell what has changed.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping

from stemcal.errors import UsageError
from stemcal.files.durable import digest
from stemcal.folder.store import StudyFolder
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.base import stage_called
from stemcal.study.model import Study

logger = logging.getLogger(__name__)

_SHORT = 16
_PROBED = frozenset({"stage", "row", "levels", "diameter"})  # of the probe, not of the solver
# Keys that earlier versions did not know, and what they hold where nobody uses them: then they are no input, so that
# stage files of those versions stay fresh.
_UNUSED_RSM: dict[str, object] = {
    "axial": None,
    "blocks": "none",
    "weights": "equal",
    "inestimable": "refuse",
    "sums_of_squares": "partial",
    "constraints": [],
}
_UNUSED_SCREEN = {"centre_points": 0}
_UNUSED_CLIMB: dict[str, object] = {"step_sizes": {}}
_UNUSED_INVERT = {"responses": ["force"], "ranges_chosen": "before", "discrepancy": "none",
                  "desirability": None}  # fmt: skip
_UNUSED_REFINE = {"model": "quadratic", "batch": 4}
_UNUSED_TARGET: dict[str, object] = {"travel": None, "travel_sd": None, "work": None, "work_sd": None, "further": {}}


def inputs_of(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> dict[str, str]:
    """Return the hash of each thing that a stage is made from."""
    dump = _used_options(study)
    parts: dict[str, object] = {"factors": dump["factors"], "calibrate_at": study.targets.calibrate_at}
    parts |= {name: dump[name] for name in stage_called(stage).options}
    if not study.naming.is_cutting:
        parts["named"] = [dump["responses"], dump["conditions"]]
    if stage == "rsm" and study.joint_targets:
        parts["diameters" if study.naming.is_cutting else "conditions"] = [
            target.diameter for target in study.joint_targets
        ]
        parts |= {"responses": study.invert.responses} if study.invert.responses != ("force",) else {}
    if stage == "audit":
        parts["published"] = dump["published"]
    elif stage == "invert":
        parts["published"] = study.published.solution if study.published else None
    else:
        parts |= _solver_parts(study, solver, stage) | {"runs.censored": study.runs.censored}
        parts |= {"solver.replicates": study.replicates} if study.replicates else {}
    if (before := stage_called(stage).needs(study)) is not None:
        parts[f"{before}.json"] = folder.read_stage(before)
    return {name: digest(part)[:_SHORT] for name, part in parts.items()}


def _used_options(study: Study) -> dict[str, object]:
    dump = study.model_dump(mode="json")
    targets = dump["targets"]
    return {
        **dump,
        "screen": _without(dump["screen"], _UNUSED_SCREEN),
        "climb": dump["climb"] and _without(dump["climb"], _UNUSED_CLIMB),
        "rsm": _without(dump["rsm"], _UNUSED_RSM),
        "invert": _without(dump["invert"], _UNUSED_INVERT),
        "refine": dump["refine"] and _without(dump["refine"], _UNUSED_REFINE),
        "targets": {**targets, "forces": [_without(target, _UNUSED_TARGET) for target in targets["forces"]]},
    }


def _without(options: Mapping[str, object], unused: Mapping[str, object]) -> dict[str, object]:
    """Leave out the options that hold what they hold when nobody uses them.

    >>> _without({"alpha": "face", "axial": None}, {"axial": None})
    {'alpha': 'face'}
    """
    return {name: value for name, value in options.items() if name not in unused or value != unused[name]}


def _solver_parts(study: Study, solver: Solver, stage: str) -> dict[str, object]:
    """What determines the answers of a stage, apart from the levels, as the solver tells it."""
    probe = Request(stage, 0, study.midlevels(), study.targets.calibrate_at)
    parts: dict[str, object] = {}
    condition = study.naming.condition
    probed = _PROBED if condition is None else _PROBED | {condition.name}
    for name, part in solver.identity(probe).items():
        if name not in probed:
            parts |= _leaves(f"solver {name}", part)
    return parts


def _leaves(name: str, part: object) -> dict[str, object]:
    """Return the values of a nested mapping by the path to them, so that a change can be named.

    >>> _leaves("solver test", {"mesh": {"size": 1.0}, "speed": 2.0})
    {'solver test.mesh.size': 1.0, 'solver test.speed': 2.0}
    """
    if isinstance(part, Mapping) and part:
        return {path: leaf for inner, value in part.items() for path, leaf in _leaves(f"{name}.{inner}", value).items()}
    if isinstance(part, list | tuple) and len(part) == 1:
        return _leaves(name, part[0])
    return {name: part}


def require_fresh(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> None:
    """Raise `UsageError` if a stage's file, or one before it, is missing or stale."""
    before = stage_called(stage).needs(study)
    if before is not None:
        require_fresh(study, solver, folder, before)
    folder.read_stage(stage)
    if changed := changes_since(study, solver, folder, stage):
        raise UsageError(
            f"{folder.path / stage}.json was made from something else ({', '.join(changed)} changed since); "
            f"run `stemcal {stage} SPEC` again"
        )


def changes_since(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> list[str]:
    """Name what has changed since a stage file was written."""
    try:
        now = inputs_of(study, solver, folder, stage)
    except UsageError:
        return [f"{stage_called(stage).needs(study)}.json"]
    return differences(folder.read_stage(stage).get("inputs"), now)


def differences(old: object, new: Mapping[str, str]) -> list[str]:
    """Name what differs between two sets of inputs.

    >>> differences({"factors": "a", "screen": "b"}, {"factors": "a", "screen": "c"})
    ['screen']
    """
    if not isinstance(old, Mapping):
        return ["everything"]
    return sorted(name for name in {*old, *new} if old.get(name) != new.get(name))


def tell_changes(folder: StudyFolder, stage: str, inputs: Mapping[str, str]) -> None:
    """Say what has changed since a stage file was written, before anything is computed for it."""
    if not folder.has_stage(stage):
        return
    try:
        old = folder.examine_stage(stage)[0].get("inputs")
    except UsageError:
        return
    if changed := differences(old, inputs):
        logger.warning("%s is made anew: %s changed", stage, ", ".join(changed))
        folder.log("inputs_changed", stage=stage, changed=changed)
