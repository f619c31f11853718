from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, command, undrawn
from fakes import leave_blank

from stemcal.runs.executors import InlineExecutor
from stemcal.runs.executors.local import LocalExecutor


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Run the replay; return its folder, not to be changed, and what the command said. Its figures are blank."""
    folder = tmp_path_factory.mktemp("finished") / "study"
    with pytest.MonkeyPatch.context() as patch:
        leave_blank(patch)
        return folder, command("run", REPLAY, "--out", folder)


@pytest.fixture
def replayed(finished: tuple[Path, Any], tmp_path: Path) -> Path:
    """The folder of the replay with all its stages and none of its pictures, to be changed at will."""
    return undrawn(finished[0], tmp_path / "replayed")


class Here(LocalExecutor):
    """Passes for workers on this machine, and computes in this process."""

    ahead, submit = InlineExecutor.ahead, InlineExecutor.submit


@pytest.fixture
def without_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start no processes where it is not asked what they do."""
    monkeypatch.setattr("stemcal.runs.executors.local.LocalExecutor", Here)


@pytest.fixture(autouse=True)
def _blank(blank_figures: None) -> None:
    """What is asked here is what a command says, not what it draws."""
