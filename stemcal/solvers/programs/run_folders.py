"""The folder a run works in: its own, gone after a success, kept after a failure."""

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stemcal.files.durable import digest
from stemcal.outputs import make_folder

OUTPUT = "program-output.txt"
_KEY_LENGTH = 32


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
