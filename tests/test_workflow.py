"""Whole studies with a solver whose answers are known."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest
import workflow
from fakes import FakeSolver, lines, make_study

from stemcal.errors import RunsFailed, UsageError
from stemcal.overview.plan import plan
from stemcal.runs.answer import Progress
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fresh import CODE, changes_since
from stemcal.storage.typed import to_json

CONFIGS = Path(__file__).parent.parent / "configs"
STAGES = ("screen", "rsm", "invert", "validate")
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"


@pytest.fixture
def folder(tmp_path: Path) -> StudyFolder:
    return StudyFolder(tmp_path / "out")


@pytest.fixture
def witness(tmp_path: Path) -> Path:
    return tmp_path / "witness"


def stage_bytes(folder: StudyFolder) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in sorted(folder.path.iterdir()) if p.suffix in (".json", ".csv")}


# ---- known answers


def test_calibrates_to_the_known_point(tmp_path: Path, folder: StudyFolder) -> None:
    """F = 100 + 20·a + 8·b + 3·b² + 0.5·a·b, least distance to the centre in half steps of the design.

    With α = √2 the coded variables are √2·(a, b): both are scaled alike, so the nearest point of F = 110 in
    (a, b) is the one in coded units too. Lagrange: a = λ(20 + b/2)/2, b = λ(8 + 6b + a/2)/2.
    """
    workflow.calibrate(make_study(tmp_path, TWO), folder, InlineExecutor(), solver=FakeSolver())
    found = folder.read_stage("invert")
    a = (found["solution"]["yield_stress"] - 15.0) / 5.0
    b = (found["solution"]["failure_strain"] - 0.03) / 0.02
    assert 100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b + 0.5 * a * b == pytest.approx(110.0, abs=1e-6)
    assert a / (20.0 + 0.5 * b) == pytest.approx(b / (8.0 + 6.0 * b + 0.5 * a), rel=1e-4)
    assert found["coded_radius"] == pytest.approx(2**0.5 * (a * a + b * b) ** 0.5)
    assert found["parameters"]["density"] == pytest.approx(1100.0)
    assert found["target"] == 110.0 and found["condition"] == 8.0


def test_surface_recovers_the_coefficients(tmp_path: Path, folder: StudyFolder) -> None:
    study = make_study(tmp_path, TWO)
    stage = workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver()).to_json()
    values = {row["term"]: row["value"] for row in stage["coefficients"]}
    alpha = 2**0.5
    assert values["1"] == pytest.approx(100.0, abs=1e-9)
    assert values["yield_stress"] == pytest.approx(20.0 / alpha, abs=1e-9)
    assert values["failure_strain^2"] == pytest.approx(3.0 / 2.0, abs=1e-9)
    assert values["yield_stress:failure_strain"] == pytest.approx(0.5 / 2.0, abs=1e-9)
    assert stage["lack_of_fit_testable"] is False and stage["pure_error"]["kind"] == "equal_repeats"
    axial = [run["levels"]["yield_stress"] for run in stage["design"]["runs"]]
    assert min(axial) == 10.0 and max(axial) == 20.0  # exactly, not 19.999999999999996


def test_fewer_than_two_significant_takes_the_two_largest(tmp_path: Path, folder: StudyFolder) -> None:
    study = make_study(tmp_path, "screen: {alpha: 1e-12}\n")
    workflow.run_stage("screen", study, folder, InlineExecutor(), solver=FakeSolver())
    stage = workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver()).to_json()
    assert stage["names"] == ["yield_stress", "failure_strain"]
    assert stage["notes"][0]["kind"] == "strongest_factors"
    assert stage["fixed"]["strain_rate_c"] == 90.0


@pytest.mark.parametrize(("alpha", "radius"), [("face", 2**0.5), ("1.2", 2**0.5), ("1.8", 1.8)])
def test_design_radius(tmp_path: Path, folder: StudyFolder, alpha: str, radius: float) -> None:
    extra = f"rsm: {{factors: [yield_stress, failure_strain], alpha: {alpha}}}\n"
    stage = workflow.run_stage(
        "rsm", make_study(tmp_path, extra), folder, InlineExecutor(), solver=FakeSolver()
    ).to_json()
    assert stage["radius"] == pytest.approx(radius)
    levels = [run["levels"]["yield_stress"] for run in stage["design"]["runs"]]
    assert (min(levels), max(levels)) == (10.0, 20.0)


# ---- the paper's runs


# ---- records


def test_a_folder_of_another_version_is_told_and_its_runs_are_used(
    tmp_path: Path, folder: StudyFolder, witness: Path, caplog: pytest.LogCaptureFixture
) -> None:
    study, solver = make_study(tmp_path), FakeSolver(witness)
    workflow.calibrate(study, folder, InlineExecutor(), solver=solver)
    first, files = len(lines(witness)), stage_bytes(folder)
    for stage in ("screen", "rsm", "invert", "validate"):
        content = folder.read_stage(stage)
        folder.write_stage(stage, {**content, "schema_version": 1, "inputs": {**content["inputs"], CODE: "0.0 abc"}})
    for stage in ("screen", "validate"):
        assert changes_since(study, solver, folder, stage) == [CODE]
    workflow.calibrate(study, folder, InlineExecutor(), solver=solver)
    assert f"screen is recomputed (changed: {CODE})" in caplog.messages
    assert len(lines(witness)) == first and stage_bytes(folder) == files


def test_equal_centre_points_are_computed_once(tmp_path: Path, folder: StudyFolder, witness: Path) -> None:
    """4 factorial, 4 axial, 3 centre points: 11 rows, 9 runs."""
    workflow.run_stage("rsm", make_study(tmp_path, TWO), folder, InlineExecutor(), solver=FakeSolver(witness))
    assert len(lines(witness)) == 9
    assert len(folder.keys()) == 9
    assert len(folder.read_stage("rsm")["design"]["runs"]) == 11


def test_progress_counts_each_run_once(tmp_path: Path, folder: StudyFolder) -> None:
    seen: list[Progress] = []
    study = make_study(tmp_path, TWO)
    workflow.run_stage("rsm", study, folder, InlineExecutor(), seen.append, FakeSolver())
    assert (seen[0].done, seen[-1].done, seen[-1].total, seen[-1].cached, seen[-1].points) == (0, 9, 9, 0, 11)
    assert seen[1].last_response is not None
    seen.clear()
    workflow.run_stage("rsm", study, folder, InlineExecutor(), seen.append, FakeSolver())
    assert [(p.done, p.cached, p.points) for p in seen] == [(9, 9, 11)]


def test_a_new_solver_version_reuses_nothing(tmp_path: Path, folder: StudyFolder, witness: Path) -> None:
    study = make_study(tmp_path, TWO)
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver(witness))
    with pytest.raises(UsageError, match="solver version changed"):
        workflow.run_stage("invert", study, folder, solver=FakeSolver(witness, version=2))
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver(witness, version=2))
    assert len(lines(witness)) == 18
    log = (folder.path / "log.jsonl").read_text(encoding="utf-8")
    assert '"changed": ["solver version"]' in log


def test_provenance_is_recorded(tmp_path: Path, folder: StudyFolder) -> None:
    workflow.run_stage("rsm", make_study(tmp_path, TWO), folder, InlineExecutor(), solver=FakeSolver())
    record = folder.load(folder.keys()[0])
    assert record is not None
    assert record["details"] == {"steps": 7} and record["request"]["stage"] == "rsm"
    assert {"stemcal", "python", "numpy", "host", "started", "wall_seconds"} <= set(record["provenance"])


# ---- order of stages


@pytest.mark.parametrize(("stage", "missing"), [("rsm", "screen"), ("invert", "screen"), ("validate", "screen")])
def test_a_stage_needs_the_one_before(tmp_path: Path, folder: StudyFolder, stage: str, missing: str) -> None:
    study, solver, executor = make_study(tmp_path), FakeSolver(), InlineExecutor()
    commands: dict[str, Any] = {
        "rsm": lambda: workflow.run_stage("rsm", study, folder, executor, solver=solver),
        "invert": lambda: workflow.run_stage("invert", study, folder, solver=solver),
        "validate": lambda: workflow.run_stage("validate", study, folder, executor, solver=solver),
    }
    with pytest.raises(UsageError, match=f"run `stemcal {missing} SPEC` first"):
        commands[stage]()


# ---- failed runs


@pytest.mark.parametrize(
    ("trouble", "reason"),
    [("nan", "nan"), ("failed", "inverted"), ("simulation", "energy_drift"), ("raise", "exception")],
)
def test_a_failed_run_is_no_number(tmp_path: Path, folder: StudyFolder, trouble: str, reason: str) -> None:
    """One of twelve runs fails: ten coefficients from eleven runs leave one residual df."""
    stage = workflow.run_stage(
        "screen", make_study(tmp_path), folder, InlineExecutor(), solver=FakeSolver(trouble={3: trouble})
    ).to_json()
    run = stage["design"]["runs"][3]
    assert (run["status"], run["reason"], run["response"]) == ("failed", reason, None)
    assert stage["residual"]["df"] == 1
    lost = stage["notes"][0]
    assert (lost["kind"], lost["severity"]) == ("screening_runs_failed", "warning") and "1 of 12 runs" in lost["text"]
    with (folder.path / "screen_runs.csv").open(encoding="utf-8", newline="") as file:
        assert [row["force"] == "" for row in csv.DictReader(file)].index(True) == 3


def test_too_many_failed_runs_are_named(tmp_path: Path, folder: StudyFolder) -> None:
    solver = FakeSolver(trouble=dict.fromkeys((1, 4, 7), "failed"))
    with pytest.raises(RunsFailed, match=r"3 of 12[\s\S]*run 2: inverted: element 17[\s\S]*run 5[\s\S]*run 8"):
        workflow.run_stage("screen", make_study(tmp_path), folder, InlineExecutor(), solver=solver)
    assert not folder.has_stage("screen")
    assert len(folder.keys()) == 12


def test_physical_failures_stand_accidents_are_tried_again(tmp_path: Path, folder: StudyFolder, witness: Path) -> None:
    solver = FakeSolver(witness, trouble={2: "failed", 5: "raise"})
    study = make_study(tmp_path)
    with pytest.raises(RunsFailed):
        workflow.run_stage("screen", study, folder, InlineExecutor(), solver=solver)
    before = len(lines(witness))
    with pytest.raises(RunsFailed):
        workflow.run_stage("screen", study, folder, InlineExecutor(), solver=solver)
    assert lines(witness)[before:] == ["screen 5"] * 2  # each command begins an accident twice


# ---- interruption


# ---- plan


def test_plan_counts_and_runs_nothing(tmp_path: Path, folder: StudyFolder, witness: Path) -> None:
    study, solver = make_study(tmp_path, TWO), FakeSolver(witness)
    planned = to_json(plan(study, folder, solver))
    assert [s["to_run"] for s in planned["stages"]] == [12, 9, 3]
    assert planned["stages"][0]["seconds"] == pytest.approx(120.0)
    assert planned["stages"][2]["seconds"] == pytest.approx(10.0 * (49 + 64 + 100) / 64)
    assert not folder.path.exists() and not witness.exists()
    workflow.calibrate(study, folder, InlineExecutor(), solver=solver)
    assert plan(study, folder, solver).to_run == 0
    json.dumps(planned)


def test_plan_before_the_screening_assumes_three_factors(tmp_path: Path, folder: StudyFolder) -> None:
    planned = to_json(plan(make_study(tmp_path), folder, FakeSolver()))
    assert planned["stages"][1]["rows"] == 8 + 6 + 6
    assert any(note["kind"] == "factors_assumed" and "3 factors" in note["text"] for note in planned["notes"])
