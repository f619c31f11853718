"""What a stage was made from, so that no stage builds on results of another spec.

Every stage file carries ``inputs``: short hashes of the factors, of its options, of all that its solver says
determines an answer, and of the stage file before it. A stage whose hashes no longer agree is stale, and the
hashes that differ tell what has changed.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from stemcal.errors import UsageError
from stemcal.solvers.protocol import Request, Solver
from stemcal.study.durable import digest
from stemcal.study.model import Study
from stemcal.study.store import StudyFolder

logger = logging.getLogger(__name__)

_SHORT = 16
_PROBED = frozenset({"stage", "row", "levels", "diameter"})  # of the probe, not of the solver
_OPTIONS = {
    "screen": ("screen",),
    "rsm": ("rsm",),
    "invert": ("invert", "targets"),
    "validate": ("targets",),
}


def stage_before(study: Study, stage: str) -> str | None:
    """Return the stage whose file a stage reads; a surface of named factors needs no screening."""
    if stage == "rsm" and study.rsm.factors != "significant":
        return None
    return {"rsm": "screen", "invert": "rsm", "validate": "invert"}.get(stage)


def inputs_of(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> dict[str, str]:
    """Return the hash of each thing that a stage is made from."""
    dump = study.model_dump(mode="json")
    parts: dict[str, Any] = {"factors": dump["factors"], "calibrate_at": dump["targets"]["calibrate_at"]}
    parts |= {name: dump[name] for name in _OPTIONS[stage]}
    if stage == "invert":
        parts["published"] = (dump["published"] or {}).get("solution")
    else:
        parts |= _solver_parts(study, solver, stage)
    if (before := stage_before(study, stage)) is not None:
        parts[f"{before}.json"] = folder.read_stage(before)
    return {name: digest(part)[:_SHORT] for name, part in parts.items()}


def _solver_parts(study: Study, solver: Solver, stage: str) -> dict[str, Any]:
    """What determines the answers of a stage, apart from the levels, as the solver tells it."""
    probe = Request(stage, 0, study.midlevels(), study.targets.calibrate_at)
    parts: dict[str, Any] = {}
    for name, part in solver.identity(probe).items():
        if name in _PROBED:
            continue
        if isinstance(part, Mapping):
            parts |= {f"solver {name}.{inner}": value for inner, value in part.items()}
        else:
            parts[f"solver {name}"] = part
    return parts


def read_fresh(study: Study, solver: Solver, folder: StudyFolder, stage: str) -> dict[str, Any]:
    """Return a stage's JSON; raise `UsageError` if it, or one before it, is missing or stale."""
    before = stage_before(study, stage)
    if before is not None:
        read_fresh(study, solver, folder, before)
    content = folder.read_stage(stage)
    changed = differences(content.get("inputs"), inputs_of(study, solver, folder, stage))
    if changed:
        raise UsageError(
            f"{folder.path / stage}.json was made from something else ({', '.join(changed)} changed since); "
            f"run `stemcal {stage} SPEC` again"
        )
    return content


def differences(old: object, new: Mapping[str, str]) -> list[str]:
    """Name what differs between two sets of inputs.

    >>> differences({"factors": "a", "screen": "b"}, {"factors": "a", "screen": "c"})
    ['screen']
    """
    if not isinstance(old, Mapping):
        return ["everything"]
    return sorted(name for name in {*old, *new} if old.get(name) != new.get(name))


def tell_changes(folder: StudyFolder, stage: str, inputs: Mapping[str, str]) -> None:
    """Log what has changed since a stage file was written, before it is replaced."""
    if not folder.has_stage(stage):
        return
    try:
        old = folder.read_stage(stage).get("inputs")
    except UsageError:
        return
    if changed := differences(old, inputs):
        logger.info("%s is made anew: %s changed", stage, ", ".join(changed))
        folder.log("inputs_changed", stage=stage, changed=changed)
