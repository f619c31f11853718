from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def replayed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    """The study of the printed tables and its folder, all stages done."""
    from stemcal.executors.inline import InlineExecutor
    from stemcal.study.spec import load_study
    from stemcal.study.store import StudyFolder
    from stemcal.workflow import calibrate

    study = load_study(ROOT / "configs" / "paper-replay.yaml")
    folder = StudyFolder(tmp_path_factory.mktemp("replay"))
    calibrate(study, folder, InlineExecutor())
    return study, folder


@pytest.fixture(scope="session")
def stages(replayed: tuple[Any, Any]) -> dict[str, dict[str, Any]]:
    _, folder = replayed
    return {name: folder.read_stage(name) for name in ("screen", "rsm", "invert", "validate")}
