"""What a run is given: copies of files, with the values of the factors in those that are templates."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from stemcal.errors import SimulationFailed, UsageError
from stemcal.files.plain import open_plain
from stemcal.naming import CUTTING, Naming
from stemcal.solvers.protocol import Request
from stemcal.study.types.placeholders import REPLICATE, SEED, fill, number, template_bytes


@dataclass(frozen=True)
class Inputs:
    """Files beside the spec that a run needs, each with the hash it had when the study was read."""

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
        raise UsageError(f"{path}: {error.strerror}; name a file that is there") from None


def values_of(request: Request, seed: int = 0, naming: Naming = CUTTING) -> dict[str, str]:
    """Return what each placeholder stands for: the shortest text of each number; a factor's own name goes first."""
    drawn = {SEED: str(seed), REPLICATE: str(request.replicate)}
    levels = {name: number(value) for name, value in request.levels.items()}
    at = {} if naming.condition is None else {naming.condition.name: number(request.condition)}
    return {**drawn, **at, **levels}
