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
from stemcal.folder.store import SCHEMA_VERSION, StudyFolder
from stemcal.naming import FIRST
from stemcal.solvers.protocol import Request, Solver
from stemcal.stages.base import stage_called
from stemcal.study.model import Study

logger = logging.getLogger(__name__)

VERSION = "schema_version"  # among what has changed: the file is of another version
_SHORT = 16
_PROBED = frozenset({"stage", "row", "levels", "diameter", "condition"})  # of the probe, not of the solver


def inputs_of(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> dict[str, str]:
    """Return the hash of each thing that a stage is made from."""
    dump = study.model_dump(mode="json")
    parts: dict[str, object] = {"factors": dump["factors"], "calibrate_at": study.targets.calibrate_at}
    parts |= {name: dump[name] for name in stage_called(stage).options}
    if not study.naming.is_cutting:
        parts["named"] = [dump["responses"], dump["conditions"]]
    if stage == "rsm" and study.joint_targets:
        parts["conditions"] = [target.condition for target in study.joint_targets]
        parts |= {"responses": study.invert.responses} if study.invert.responses != (FIRST,) else {}
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


def _solver_parts(study: Study, solver: Solver, stage: str) -> dict[str, object]:
    """What determines the answers of a stage, apart from the levels, as the solver tells it."""
    probe = Request(stage, 0, study.midlevels(), study.targets.calibrate_at)
    parts: dict[str, object] = {}
    for name, part in solver.identity(probe).items():
        if name not in _PROBED:
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
    """Name what has changed since a stage file was written; of a file of another version only that it is one."""
    content, _ = folder.examine_stage(stage)
    if content.get("schema_version") != SCHEMA_VERSION:
        return [VERSION]
    try:
        now = inputs_of(study, solver, folder, stage)
    except UsageError:
        return [f"{stage_called(stage).needs(study)}.json"]
    return differences(content.get("inputs"), now)


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
        content, _ = folder.examine_stage(stage)
    except UsageError:
        return
    old_version = content.get("schema_version") != SCHEMA_VERSION
    if changed := [VERSION] if old_version else differences(content.get("inputs"), inputs):
        logger.warning("%s is made anew: %s changed", stage, ", ".join(changed))
        folder.log("inputs_changed", stage=stage, changed=changed)
