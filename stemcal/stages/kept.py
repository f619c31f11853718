"""A stage made of the same as before is read, not worked out again.

Beside the stage files lies a note of what each of them was made from: a hash of code, libraries, spec and the files
that the spec names, and the hashes of the stage files before it, of its records and of what it has left. Where all of
that is the same still, to the byte, the stage is kept. The note may be deleted at any time: then all is worked out
once more.
"""

from __future__ import annotations

import functools
import hashlib
import json
import platform
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from stemcal.errors import StemcalError, UsageError
from stemcal.executors.code import code_version
from stemcal.files.durable import digest
from stemcal.files.plain import MIB, open_plain, read_plain
from stemcal.files.sealed import take_as_agreed
from stemcal.folder.store import StudyFolder
from stemcal.outputs import write_output
from stemcal.runs.policy import ACCIDENTS
from stemcal.stages.base import stage_called
from stemcal.stages.result import R
from stemcal.study.model import Study

__all__ = ["any_kept", "keep", "kept"]

NOTE = ".kept"
_LIBRARIES = ("numpy", "scipy", "statsmodels", "pyDOE3")


def kept(kind: type[R], study: Study, folder: StudyFolder) -> R | None:
    """Return the result that a stage has left, None if it is to be worked out."""
    noted = _noted(folder).get(kind.name)
    if noted is None or noted != _note(noted["files"], study, folder):
        return None
    take_as_agreed(bytes.fromhex(found) for found in noted["files"].values())
    try:
        return kind.from_json(folder.read_stage(kind.name))
    except UsageError:
        return None


def any_kept(folder: StudyFolder) -> bool:
    """Tell whether there is a note of any stage."""
    return bool(_noted(folder))


def keep(result: R, study: Study, folder: StudyFolder) -> R:
    """Note what a result was made from; not of one with runs that the next command begins again."""
    noted = {stage: note for stage, note in _noted(folder).items() if stage != result.name}
    outcomes = [outcome for _, outcome in result.runs()]
    if not any(outcome.reason in ACCIDENTS for outcome in outcomes):
        stages = [f"{name}.json" for name in _with_those_before(result.name, study)]
        tables = [f"{name}.csv" for name in result.tables()]
        records = [f"runs/{key}.json" for key in dict.fromkeys(key for outcome in outcomes for key in outcome.keys)]
        noted[result.name] = _note([*stages, *tables, *records], study, folder)
    with suppress(OSError, StemcalError):  # a note that cannot be written saves no time, and harms nothing
        write_output(folder.path / NOTE, json.dumps(noted))
    return result


def _with_those_before(stage: str | None, study: Study) -> Iterator[str]:
    while stage is not None:
        yield stage
        stage = stage_called(stage).needs(study)


def _noted(folder: StudyFolder) -> dict[str, Any]:
    try:
        noted = json.loads(read_plain(folder.path / NOTE, MIB))
        return {stage: {"of": note["of"], "files": dict(note["files"])} for stage, note in noted.items()}
    except (OSError, ValueError, AttributeError, TypeError, KeyError):  # none, or none of ours
        return {}


def _note(files: Iterable[str], study: Study, folder: StudyFolder) -> dict[str, Any]:
    return {"of": _sources(study), "files": {name: _sum(folder.path / name) for name in files}}


def _sources(study: Study) -> str:
    """Return a hash of code, libraries and spec, with the files that the spec names."""
    files = {str(path): _sum(path) for path in _paths(study.model_dump())}
    return digest([_code(), study.model_dump_json(), files])


@functools.cache
def _code() -> list[str]:
    return [code_version(), platform.python_version(), *map(version, _LIBRARIES)]


def _paths(part: object) -> Iterator[Path]:
    """Yield the paths in a spec."""
    if isinstance(part, Path):
        yield part
    elif isinstance(part, dict | list | tuple):
        for inner in part.values() if isinstance(part, dict) else part:
            yield from _paths(inner)


def _sum(path: Path) -> str:
    try:
        with open_plain(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return ""
