"""What a run is given: its folder, its seed, files, and templates with the values of the factors."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.errors import SimulationFailed, UsageError
from stemcal.files.durable import digest, make_folder
from stemcal.files.reading import open_plain
from stemcal.naming import CUTTING, Naming
from stemcal.solvers.protocol import Request
from stemcal.study.types.placeholders import REPLICATE, SEED, fill, number, template_bytes

OUTPUT = "program-output.txt"
MOST_SEED = 900_000_000  # the largest that LAMMPS takes
_KEY_LENGTH = 32


@dataclass(frozen=True)
class Inputs:
    """Files next to the spec that a run needs, each with the hash it had when the study was read."""

    templates: Mapping[Path, str]
    files: Mapping[Path, str]

    @classmethod
    def of(cls, templates: Sequence[Path], files: Sequence[Path]) -> Inputs:
        """Take note of what the files hold now."""
        return cls({path: file_hash(path) for path in templates}, {path: file_hash(path) for path in files})

    def identity(self) -> dict[str, str]:
        """Return the hash of each file by its name."""
        return {path.name: sha256 for path, sha256 in {**self.templates, **self.files}.items()}

    def write(self, folder: Path, values: Mapping[str, str]) -> None:
        """Put the files into a run folder, templates filled.

        Raises
        ------
        SimulationFailed
            If one of them has changed since the study was read: the record would name the wrong input.
        """
        for path, sha256 in {**self.templates, **self.files}.items():
            if not path.is_file() or file_hash(path) != sha256:
                raise SimulationFailed("input_changed", f"{path.name} has changed since the study was begun")
        for path in self.templates:
            (folder / path.name).write_bytes(fill(template_bytes(path), values))
        for path in self.files:
            shutil.copyfile(path, folder / path.name)


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file."""
    try:
        with open_plain(path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; name an existing file") from None


def values_of(request: Request, seed: int = 0, naming: Naming = CUTTING) -> dict[str, str]:
    """Return what each placeholder represents: the shortest text of each number; a factor's own name goes first."""
    drawn = {SEED: str(seed), REPLICATE: str(request.replicate)}
    levels = {name: number(value) for name, value in request.levels.items()}
    at = {} if naming.condition is None else {naming.condition.name: number(request.condition)}
    return {**drawn, **at, **levels}


def seed_of(request: Request) -> int:
    """Return the seed of a run, 1 to 900 000 000: another one for each stage, row, replicate, diameter and levels.

    >>> run = Request("screen", 0, {"friction": 0.3}, 1.0, replicate=1)
    >>> seed_of(run)
    409313303
    """
    run = (request.stage, request.row, request.replicate, number(request.condition), values_of(request))
    found = hashlib.sha256(json.dumps([0, *run], sort_keys=True).encode()).digest()
    return 1 + int.from_bytes(found[:8], "big") % MOST_SEED


def run_folder(place: Path | None, identity: Mapping[str, Any]) -> Path:
    """Make an empty folder: below `place`, named by the run's key, or among the temporary files."""
    if place is None:
        return Path(tempfile.mkdtemp(prefix="stemcal-run-"))
    folder = make_folder(place) / digest(dict(identity))[:_KEY_LENGTH]
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return folder


def discard(folder: Path) -> None:
    """Remove a run folder; what another program still holds open stays (Windows)."""
    shutil.rmtree(folder, ignore_errors=True)
