"""The published study taken to a program whose force is known."""

from __future__ import annotations

import json
import math
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest
from fakes import FakeSolver, make_study
from typer.testing import CliRunner, Result

import stemcal
from stemcal import workflow
from stemcal.cli.app import app
from stemcal.errors import RunsFailed, UsageError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.study.model import CommandSolver, EmbeddedSolver
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
# F = 0.5·160·(εf/0.0387)^0.9·(d/8)²: half of what the study has, and it follows the strain twice as strongly.
PROGRAM = """
import json, sys
strain, d = float(sys.argv[1]), float(sys.argv[2])
open({witness!r}, "a").write(f"{{d}}\\n")
{trouble}
json.dump({{"force": {law}}}, open("out.json", "w"))
"""
LAW = "0.5 * 160.0 * (strain / 0.0387) ** 0.9 * (d / 8.0) ** 2"
TRANSFER = """
transfer:
  solver:
    kind: command
    command: [{python}, program.py, "{{{{failure_strain}}}}", "{{{{diameter}}}}"]
    files: [program.py]
    version: "7.1"
    result: {{kind: json, file: out.json, path: force}}
  adjust: {adjust}
  {more}
"""


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of the published study, calibrated and validated."""
    folder = tmp_path_factory.mktemp("published")
    workflow.calibrate(load_study(CONFIGS / "paper-replay.yaml"), StudyFolder(folder / "out"), InlineExecutor())
    return folder


@pytest.fixture(autouse=True)
def _begun(tmp_path: Path, calibrated: Path) -> None:
    """Every study here goes on from there."""
    shutil.copytree(calibrated / "out", tmp_path / "out")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, calibrated: Path) -> Path:
    """A folder of the published study, taken to the program as `spec_of` has it."""
    folder = tmp_path_factory.mktemp("whole")
    shutil.copytree(calibrated / "out", folder / "out")
    transferred(folder)
    return folder


def published(folder: Path) -> str:
    """Put the printed tables into a folder; return the spec that reads them."""
    shutil.copytree(CONFIGS / "data", folder / "data", dirs_exist_ok=True)
    return (CONFIGS / "paper-replay.yaml").read_text("utf-8")


def spec_of(
    folder: Path,
    law: str = LAW,
    trouble: str = "",
    adjust: str = "{failure_strain: {high: 0.3}}",
    more: str = "budget: 12",
) -> Path:
    """Write the published study with a transfer to a program of this law, its tables beside it."""
    text = published(folder)
    program = PROGRAM.format(law=law, trouble=trouble, witness=str(folder / "witness"))
    (folder / "program.py").write_text(program, encoding="utf-8")
    python, path = json.dumps(sys.executable), folder / "study.yaml"
    there = TRANSFER.format(python=python, adjust=adjust, more=more)
    path.write_text(text + there, encoding="utf-8")
    return path


def transferred(folder: Path, **options: str) -> dict[str, Any]:
    """Return the file of the stage, the whole study run."""
    work = StudyFolder(folder / "out")
    workflow.calibrate(load_study(spec_of(folder, **options)), work, InlineExecutor())
    return work.read_stage("transfer")


def started(folder: Path) -> list[float]:
    """Return the diameter of each run that the program was begun for."""
    return [float(line) for line in (folder / "witness").read_text("utf-8").split()]


def test_the_parameters_are_those_of_the_program(whole: Path) -> None:
    """159.2 = 80·(ε/0.0387)^0.9 at ε = 0.0387·1.99^(1/0.9); elsewhere the force is 159.2·(d/8)²."""
    stage = StudyFolder(whole / "out").read_stage("transfer")
    strain = 0.0387 * (159.2 / 80.0) ** (1.0 / 0.9)
    assert stage["converged"] and stage["stopped"] == "tolerance" and stage["aim"] == 159.2
    assert stage["parameters"]["failure_strain"] == pytest.approx(strain, rel=0.02)
    assert stage["solver"] == {"kind": "command", "version": "7.1"}
    at = {row["condition"]: row for row in stage["rows"]}
    assert list(at) == [7.0, 8.0, 9.0, 10.0, 11.0]
    assert at[8.0]["after"] == pytest.approx(159.2, rel=0.02)
    scale = at[8.0]["after"] / 64.0
    assert [at[d]["after"] for d in at] == pytest.approx([scale * d * d for d in at])
    assert at[11.0]["error_percent"] == pytest.approx(100.0 * (1.0 - at[11.0]["after"] / 378.2))
    (moved,) = stage["adjusted"]
    assert moved["beyond"] and (moved["low"], moved["high"]) == (0.001, 0.3) and moved["interval"] is None
    before = 80.0 * (moved["calibrated"] / 0.0387) ** 0.9
    assert at[8.0]["before"] == pytest.approx(before)
    assert [run["role"] for run in stage["runs"]] == ["search"] * 3 + ["after"] * 4 + ["before"] * 4
    assert all(stage["parameters"][name] == stage["runs"][0]["levels"][name] for name in ("yield_stress", "density"))


def test_the_correction_of_the_surface_is_told(whole: Path) -> None:
    """The scale is what the program gives over what the study has; the first step goes by the surface's slope."""
    stage = StudyFolder(whole / "out").read_stage("transfer")
    surface = stemcal.open_results(whole / "out", load_study(whole / "study.yaml")).surface
    at = next(row for row in stage["rows"] if row["condition"] == 8.0)
    assert stage["learnt"]["scale"] == pytest.approx(at["before"] / at["calibrated"], rel=1e-3)
    first, second = stage["runs"][:2]
    assert first["predicted"] == at["calibrated"]
    assert second["levels"]["failure_strain"] == pytest.approx(3.0 * first["levels"]["failure_strain"])
    more = {**first["levels"], "failure_strain": 1.0001 * first["levels"]["failure_strain"]}
    power = math.log(surface.predict(more).response / surface.predict(first["levels"]).response) / math.log(1.0001)
    assert second["predicted"] == pytest.approx(first["response"] * 3.0**power, rel=1e-3)


def test_the_budget_is_kept_and_the_nearest_conditions_come_first(tmp_path: Path) -> None:
    stage = transferred(tmp_path, more="budget: 6")
    assert len(stage["runs"]) == 6 == len(started(tmp_path))
    assert [run["condition"] for run in stage["runs"]] == [8.0, 8.0, 8.0, 7.0, 9.0, 10.0]
    assert [row["after"] is None for row in stage["rows"]] == [False, False, False, False, True]
    assert stage["notes"][-1] == {"kind": "not_run_there", "weight": "use", "conditions": [11.0], "converged": True}


def test_a_spent_budget_is_told(tmp_path: Path) -> None:
    stage = transferred(tmp_path, more="budget: 2")
    assert not stage["converged"] and stage["stopped"] == "budget" and len(stage["runs"]) == 2
    study = load_study(tmp_path / "study.yaml")
    verdict = stemcal.open_results(tmp_path / "out", study).verdict
    assert verdict.has("transfer_missed") and verdict.there is not None and verdict.there.solver == "command"


def test_within_the_ranges_it_may_be_out_of_reach(tmp_path: Path) -> None:
    """The study's range ends at 0.05: 80·(0.05/0.0387)^0.9 = 100.745 N is the most."""
    stage = transferred(tmp_path, adjust="{failure_strain: {high: 0.05}}")
    assert stage["stopped"] == "out_of_reach" and stage["parameters"]["failure_strain"] == 0.05
    assert next(row["after"] for row in stage["rows"] if row["condition"] == 8.0) == pytest.approx(100.745, abs=1e-3)
    assert stage["notes"][0]["kind"] == "not_reached" and stage["notes"][0]["factors"] == ["failure_strain"]


def test_the_second_factor_moves_once_the_first_is_at_its_end(tmp_path: Path) -> None:
    law = "4.0 * float(sys.argv[3]) * (strain / 0.0387) ** 0.9 * (d / 8.0) ** 2"
    spec = spec_of(tmp_path, law, adjust="{failure_strain: {high: 0.05}, yield_stress: {high: 40}}")
    text = spec.read_text("utf-8").replace('"{{diameter}}"]', '"{{diameter}}", "{{yield_stress}}"]')
    spec.write_text(text, encoding="utf-8")
    work = StudyFolder(tmp_path / "out")
    workflow.calibrate(load_study(spec), work, InlineExecutor())
    stage = work.read_stage("transfer")
    assert stage["converged"] and stage["parameters"]["failure_strain"] == 0.05
    assert stage["parameters"]["yield_stress"] == pytest.approx(159.2 / 4.0 / (0.05 / 0.0387) ** 0.9, rel=0.02)


def test_failed_runs_are_data(tmp_path: Path) -> None:
    """Above a strain of 0.085 the program fails: half-way back, the answer at 0.083 is still found."""
    stage = transferred(tmp_path, trouble="if strain > 0.085: sys.exit(3)", more="tolerance_percent: 4\n  budget: 12")
    failed = [run for run in stage["runs"] if run["status"] == "failed"]
    assert stage["converged"] and failed and failed[0]["reason"] == "exit_code"
    with pytest.raises(RunsFailed, match=r"transfer: none of \d+ runs succeeded \(exit_code\)"):
        transferred(tmp_path, trouble="sys.exit(3)")


def test_it_goes_on_after_a_stop(tmp_path: Path) -> None:
    """Killed after its third run it begins only the others; a fresh result begins none, another tolerance few."""
    spec, work = spec_of(tmp_path), StudyFolder(tmp_path / "out")
    study = load_study(spec)
    workflow.calibrate(study, work, InlineExecutor())
    whole, runs = (work.path / "transfer.json").read_bytes(), started(tmp_path)
    (work.path / "transfer.json").unlink()
    later = [run["key"] for run in json.loads(whole)["runs"][3:]]
    for key in later:
        work.record_path(key).unlink()
    workflow.calibrate(study, work, InlineExecutor())
    assert started(tmp_path)[len(runs) :] == runs[3:] and (work.path / "transfer.json").read_bytes() == whole
    workflow.calibrate(study, work, InlineExecutor())
    assert len(started(tmp_path)) == 2 * len(runs) - 3


def test_a_changed_program_makes_it_stale_and_nothing_else(tmp_path: Path) -> None:
    transferred(tmp_path)
    spec = spec_of(tmp_path, law="100.0")
    results = stemcal.open_results(tmp_path / "out", load_study(spec))
    assert results.validation.rows and len(results.stale) == 1 and "transfer.json" in results.stale[0]
    with pytest.raises(UsageError, match=r"transfer.json was made from something else"):
        _ = results.transfer


def test_without_the_transfer_the_study_is_judged_with_a_reservation(tmp_path: Path) -> None:
    results = stemcal.open_results(tmp_path / "out", load_study(spec_of(tmp_path)))
    (reason,) = (reason for reason in results.verdict.reasons if reason.kind == "unfinished")
    assert reason.weight == "with_reservations" and results.verdict.there is None


def test_python_has_it(whole: Path) -> None:
    results = stemcal.open_results(whole / "out", load_study(whole / "study.yaml"))
    assert isinstance(results.transfer, stemcal.TransferResult) and results.transfer.converged
    assert results.transfer.to_frame()["after"].notna().all() and "transfer" in results.figure_names
    assert len(results.figure("transfer").axes[0].lines) == 5
    assert results.verdict_text.count("in the other program") == 1
    assert sum(run.stage == "transfer" for run in results.runs) == 11


def command(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.slow
def test_commands_know_it(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "out"
    planned = command("check", spec, "--out", out)
    assert "0 runs here, at most 12 in the other program (transfer)." in planned.stderr.replace("\n", " ")
    ran = command("run", spec, "--out", out, "--workers", 1)
    assert ran.exit_code == 0 and "Parameters for the other program" in ran.stdout
    assert 'id="transfer"' in (out / "report.html").read_text("utf-8")
    alone = json.loads(command("transfer", spec, "--out", out, "--json").stdout)["result"]
    assert len(alone["runs"]) == 11 == len(started(tmp_path))
    told = json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]
    stage = next(stage for stage in told["stages"] if stage["stage"] == "transfer")
    assert (stage["file"], stage["done"]) == ("fresh", 11) and told["verdict_use_there"]["solver"] == "command"
    assert command("status", spec, "--verify", "--out", out).exit_code == 0
    runs = json.loads(command("status", spec, "--runs", "--out", out, "--json").stdout)["result"]["runs"]
    assert sum(run["stage"] == "transfer" for run in runs) == 11


@pytest.mark.slow
def test_a_failed_run_is_begun_again_by_its_own_program(tmp_path: Path) -> None:
    transferred(tmp_path, trouble="if d == 11.0: sys.exit(3)")
    spec = tmp_path / "study.yaml"
    before = len(started(tmp_path))
    done = command("run", spec, "--retry", "--out", tmp_path / "out")
    assert done.exit_code == 3 and len(started(tmp_path)) - before == 2


def test_people_run_the_other_program(tmp_path: Path) -> None:
    """The sheet asks for the calibrated point; entered results take it on to the end."""
    there = "{solver: {kind: sheet}, adjust: {failure_strain: {high: 0.3}}, budget: 6, diameters: calibrate_at}"
    spec, out = tmp_path / "study.yaml", tmp_path / "out"
    spec.write_text(f"{published(tmp_path)}transfer: {there}\n", encoding="utf-8")
    assert command("run", spec, "--out", out, "--workers", 1).exit_code == 6
    study = stemcal.load_study(spec)
    told = 0
    while runs := study.ask(out):
        (run,) = runs
        strain = run["failure_strain"]
        run["force"] = 80.0 * (strain / 0.0387) ** 0.9
        assert study.tell(runs, out) == 1
        told += 1
    found = stemcal.open_results(out, study).transfer
    assert found.converged and told == len(found.asked) <= 4 and found.solver.kind == "sheet"


def test_keys_that_are_left_out_are_the_studys(tmp_path: Path) -> None:
    text = (CONFIGS / "smoke.yaml").read_text("utf-8")
    path = tmp_path / "study.yaml"
    there = "transfer: {solver: {kind: embedded, element_size: 1 mm}, test: {internal_length: 0 mm, duration: 1.5 s}}\n"
    path.write_text(text + there, encoding="utf-8")
    study = load_study(path)
    seen, own = study.seen_by("transfer"), study.solver
    assert isinstance(own, EmbeddedSolver) and isinstance(seen.solver, EmbeddedSolver)
    assert str(seen.solver.element_size) == "1 mm" != str(own.element_size)
    assert (seen.solver.mass_scaling, seen.solver.time_step) == (own.mass_scaling, own.time_step)
    assert seen.material.internal_length.at(8.0) == 0.0 and seen.loading.duration == 1.5
    assert seen.blade == study.blade and study.seen_by("validate") is study
    assert not isinstance(seen.solver, CommandSolver)


def test_after_a_joint_fit_the_aim_is_what_the_study_gives(tmp_path: Path) -> None:
    """The compromise over the diameters stays: the program is brought to the study's own force at 8 mm."""
    program = PROGRAM.format(law=LAW, trouble="", witness=str(tmp_path / "witness"))
    (tmp_path / "program.py").write_text(program, encoding="utf-8")
    there = TRANSFER.format(
        python=json.dumps(sys.executable), adjust="{failure_strain: {high: 0.3}}", more="budget: 12"
    )
    joint = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\ninvert: {diameters: all}\n"
    study, work = make_study(tmp_path, joint + there), StudyFolder(tmp_path / "joint")
    solver = FakeSolver()
    for stage in (workflow.fit_surface, workflow.invert, workflow.validate, workflow.transfer):
        stage(study, work, InlineExecutor(), solver=solver)
    found, validated = work.read_stage("transfer"), work.read_stage("validate")
    at = {row["condition"]: row for row in found["rows"]}
    own = {row["condition"]: row["simulated"] for row in validated["rows"]}
    assert found["aim"] == own[8.0] and found["converged"]
    assert at[8.0]["after"] == pytest.approx(own[8.0], rel=0.02)
    assert {d: row["calibrated"] for d, row in at.items()} == own
