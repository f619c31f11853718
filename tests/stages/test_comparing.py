"""`rsm.compare`: a table beside the surface, by which nothing else changes."""

from __future__ import annotations

from pathlib import Path

import pytest

from stemcal import workflow
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.report.tables.stages import tables_of
from stemcal.stages.result import read_result
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


def test_surfaces_stand_side_by_side_and_none_is_adopted(tmp_path: Path) -> None:
    pytest.importorskip("sklearn")
    study = load_study(CONFIGS / "paper-replay.yaml")
    files = {}
    for compare in (False, True):
        folder = StudyFolder(tmp_path / str(compare))
        workflow.calibrate(study.with_(rsm={"compare": compare}), folder, InlineExecutor())
        files[compare] = {stage: folder.read_stage(stage) for stage in ("rsm", "invert", "validate")}
    found = files[True]["rsm"].pop("comparison")
    for stage in files[True]:
        for one in files.values():
            one[stage].pop("inputs")
    assert files[True] == files[False]
    assert [rival["method"] for rival in found["rivals"]] == ["quadratic", "gaussian_process", "neural_network"]
    assert (found["runs"], found["folds"], found["passed_over"]) == (20, 15, 0)  # six at the centre
    (table,) = [
        one for one in tables_of(read_result(folder, SurfaceResult)) if one.title == "Kinds of surface on the same runs"
    ]
    assert [row[0] for row in table.rows] == ["quadratic", "gaussian_process", "neural_network"]
    assert "20 runs predicted from the others in 15 folds" in table.foot[0]
