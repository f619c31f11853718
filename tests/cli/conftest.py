from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, command, undrawn

from stemcal.report.figures.plot import Plot


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """Run the replay; return its folder, not to be changed, and what the command said."""
    folder = tmp_path_factory.mktemp("finished") / "study"
    return folder, command("run", REPLAY, "--out", folder)


@pytest.fixture
def replayed(finished: tuple[Path, Any], tmp_path: Path) -> Path:
    """The folder of the replay with all its stages and none of its pictures, to be changed at will."""
    return undrawn(finished[0], tmp_path / "replayed")


@pytest.fixture
def blank_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave every figure empty where it is asked what a command says, not what it draws."""
    monkeypatch.setattr(Plot, "document", "<svg></svg>")
    monkeypatch.setattr(Plot, "pixels", b"")
