"""The published study refined in a program whose force is known."""

import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest
import workflow
from fakes import PYTHON, FakeSolver, make_study
from typer.testing import CliRunner, Result

import stemcal
from stemcal.cli.app import app
from stemcal.errors import RunsFailed, SpecError, UsageError
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.options import CommandSolver, EmbeddedSolver
from stemcal.stages.stage import stage_called
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
REFINE = """
refine:
  in:
    kind: command
    command: [{python}, program.py, "{{{{failure_strain}}}}", "{{{{diameter}}}}"]
    files: [program.py]
    environment: {{VERSION: "7.1"}}
    result: {{file: out.json, path: force}}
  adjust: {adjust}
  {more}
"""


@pytest.fixture(autouse=True)
def _begun(tmp_path: Path, replayed: tuple[Any, StudyFolder]) -> None:
    """Every study here goes on from the published one, calibrated and validated."""
    shutil.copytree(replayed[1].path, tmp_path / "out")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, replayed: tuple[Any, StudyFolder]) -> Path:
    """A folder of the published study, refined in the program of `spec_of`."""
    folder = tmp_path_factory.mktemp("whole")
    shutil.copytree(replayed[1].path, folder / "out")
    refined(folder)
    return folder


def published(folder: Path) -> str:
    """Put the printed tables into a folder; return the spec that reads them."""
    shutil.copytree(CONFIGS / "data", folder / "data", dirs_exist_ok=True)
    return (CONFIGS / "paper-replay.yaml").read_text("utf-8")


def spec_of(
    folder: Path,
    law: str = LAW,
    trouble: str = "",
    adjust: str = "{failure_strain: [0.001, 0.3]}",
    more: str = "tolerance_percent: 2\n  budget: 12",
) -> Path:
    """Write the published study with a refinement in a program of this law, its tables beside it."""
    text = published(folder)
    program = PROGRAM.format(law=law, trouble=trouble, witness=str(folder / "witness"))
    (folder / "program.py").write_text(program, encoding="utf-8")
    path = folder / "study.yaml"
    there = REFINE.format(python=PYTHON, adjust=adjust, more=more)
    path.write_text(text + there, encoding="utf-8")
    return path


def refined(folder: Path, **options: str) -> dict[str, Any]:
    """Return the file of the stage, the whole study run."""
    work = StudyFolder(folder / "out")
    workflow.calibrate(load_study(spec_of(folder, **options)), work, InlineExecutor())
    return work.read_stage("refine")


def started(folder: Path) -> list[float]:
    """Return the diameter of each run that the program was begun for."""
    return [float(line) for line in (folder / "witness").read_text("utf-8").split()]


def test_the_parameters_are_those_of_the_program(whole: Path) -> None:
    """159.2 = 80·(ε/0.0387)^0.9 at ε = 0.0387·1.99^(1/0.9); elsewhere the force is 159.2·(d/8)²."""
    stage = StudyFolder(whole / "out").read_stage("refine")
    strain = 0.0387 * (159.2 / 80.0) ** (1.0 / 0.9)
    assert stage["converged"] and stage["stopped"] == "tolerance" and stage["aim"] == 159.2
    assert stage["parameters"]["failure_strain"] == pytest.approx(strain, rel=0.02)
    assert stage["in"] == {"kind": "command", "version": "7.1"}
    at = {row["condition"]: row for row in stage["rows"]}
    assert list(at) == [7.0, 8.0, 9.0, 10.0, 11.0]
    assert at[8.0]["after"] == pytest.approx(159.2, rel=0.02)
    scale = at[8.0]["after"] / 64.0
    assert [at[d]["after"] for d in at] == pytest.approx([scale * d * d for d in at])
    assert at[11.0]["error_percent"] == pytest.approx(100.0 * (1.0 - at[11.0]["after"] / 378.2))
    (moved,) = stage["adjusted"]
    assert (moved["low"], moved["high"]) == (0.001, 0.3) and moved["interval"] is None
    assert stage["notes"] == []
    before = 80.0 * (moved["calibrated"] / 0.0387) ** 0.9
    assert at[8.0]["before"] == pytest.approx(before)
    assert [run["how"] for run in stage["runs"]] == ["solution", "path", "path"] + ["elsewhere"] * 8
    assert all(stage["parameters"][name] == stage["runs"][0]["levels"][name] for name in ("yield_stress", "density"))


def test_the_first_step_goes_by_the_slope_of_the_surface(whole: Path) -> None:
    """At most three times the strain; the response predicted there has the power that the surface has."""
    stage = StudyFolder(whole / "out").read_stage("refine")
    surface = stemcal.open_results(whole / "out", load_study(whole / "study.yaml")).surface
    first, second = stage["runs"][:2]
    validated = StudyFolder(whole / "out").read_stage("validate")
    assert first["predicted"] == next(row["simulated"] for row in validated["rows"] if row["condition"] == 8.0)
    assert second["levels"]["failure_strain"] == pytest.approx(3.0 * first["levels"]["failure_strain"])
    more = {**first["levels"], "failure_strain": 1.0001 * first["levels"]["failure_strain"]}
    power = math.log(surface.predict(more).response / surface.predict(first["levels"]).response) / math.log(1.0001)
    assert second["predicted"] == pytest.approx(first["response"] * 3.0**power, rel=1e-3)


def test_the_budget_is_kept_and_the_nearest_conditions_come_first(tmp_path: Path) -> None:
    stage = refined(tmp_path, more="tolerance_percent: 2\n  budget: 6")
    assert len(stage["runs"]) == 6 == len(started(tmp_path))
    assert [run["condition"] for run in stage["runs"]] == [8.0, 8.0, 8.0, 7.0, 9.0, 10.0]
    assert [row["after"] is None for row in stage["rows"]] == [False, False, False, False, True]
    note = stage["notes"][-1]
    assert (
        note["kind"] == "not_run_there"
        and "at a diameter of 11 mm" in note["text"]
        and "budget" in note["remedy"]["text"]
    )


def test_a_spent_budget_is_told(tmp_path: Path) -> None:
    stage = refined(tmp_path, more="tolerance_percent: 2\n  budget: 2")
    assert not stage["converged"] and stage["stopped"] == "budget" and len(stage["runs"]) == 2
    study = load_study(tmp_path / "study.yaml")
    verdict = stemcal.open_results(tmp_path / "out", study).verdict
    assert verdict.has("missed_there")


def test_within_the_ranges_it_may_be_out_of_reach(tmp_path: Path) -> None:
    """The study's range ends at 0.05: 80·(0.05/0.0387)^0.9 = 100.745 N is the most."""
    stage = refined(tmp_path, adjust="{failure_strain: [0.001, 0.05]}")
    assert stage["stopped"] == "out_of_reach" and stage["parameters"]["failure_strain"] == 0.05
    assert next(row["after"] for row in stage["rows"] if row["condition"] == 8.0) == pytest.approx(100.745, abs=1e-3)
    assert stage["notes"][0]["kind"] == "not_reached" and "failure_strain" in stage["notes"][0]["remedy"]["text"]


def test_without_a_range_the_strain_of_another_mesh_may_be_ten_times_less_and_up_to_one(tmp_path: Path) -> None:
    """The study has 0.01 to 0.05; 159.2 N need 0.0387·1.99^(1/0.9) = 0.0831 in the program."""
    stage = refined(tmp_path, adjust="{}")
    (moved,) = stage["adjusted"]
    assert (moved["low"], moved["high"]) == (pytest.approx(0.001), 1.0)
    assert stage["stopped"] == "tolerance" and stage["parameters"]["failure_strain"] == pytest.approx(0.0831, rel=0.02)


def test_the_second_factor_moves_once_the_first_is_at_its_end(tmp_path: Path) -> None:
    law = "4.0 * float(sys.argv[3]) * (strain / 0.0387) ** 0.9 * (d / 8.0) ** 2"
    spec = spec_of(tmp_path, law, adjust="{failure_strain: [0.001, 0.05], yield_stress: [10, 40]}")
    text = spec.read_text("utf-8").replace('"{{diameter}}"]', '"{{diameter}}", "{{yield_stress}}"]')
    spec.write_text(text, encoding="utf-8")
    work = StudyFolder(tmp_path / "out")
    workflow.calibrate(load_study(spec), work, InlineExecutor())
    stage = work.read_stage("refine")
    assert stage["converged"] and stage["parameters"]["failure_strain"] == 0.05
    assert stage["parameters"]["yield_stress"] == pytest.approx(159.2 / 4.0 / (0.05 / 0.0387) ** 0.9, rel=0.02)


def test_failed_runs_are_data(tmp_path: Path) -> None:
    """Above a strain of 0.085 the program fails: half-way back, the answer at 0.083 is still found."""
    stage = refined(tmp_path, trouble="if strain > 0.085: sys.exit(3)", more="tolerance_percent: 4\n  budget: 12")
    failed = [run for run in stage["runs"] if run["status"] == "failed"]
    assert stage["converged"] and failed and failed[0]["reason"] == "exit_code"
    with pytest.raises(RunsFailed, match=r"one run failed at every simulated point \(\d+ runs; exit_code: "):
        refined(tmp_path, trouble="sys.exit(3)")


def test_it_goes_on_after_a_stop(tmp_path: Path) -> None:
    """Killed after its third run it begins only the others; a fresh result begins none, another tolerance few."""
    spec, work = spec_of(tmp_path), StudyFolder(tmp_path / "out")
    study = load_study(spec)
    workflow.calibrate(study, work, InlineExecutor())
    whole, runs = (work.path / "refine.json").read_bytes(), started(tmp_path)
    (work.path / "refine.json").unlink()
    later = [run["key"] for run in json.loads(whole)["runs"][3:]]
    for key in later:
        work.record_path(key).unlink()
    workflow.calibrate(study, work, InlineExecutor())
    assert started(tmp_path)[len(runs) :] == runs[3:] and (work.path / "refine.json").read_bytes() == whole
    workflow.calibrate(study, work, InlineExecutor())
    assert len(started(tmp_path)) == 2 * len(runs) - 3


def test_a_changed_program_makes_it_stale_and_nothing_else(tmp_path: Path) -> None:
    refined(tmp_path)
    spec = spec_of(tmp_path, law="100.0")
    results = stemcal.open_results(tmp_path / "out", load_study(spec))
    assert results.validation.rows and len(results.stale) == 1 and "refine.json" in results.stale[0]
    with pytest.raises(UsageError, match=r"refine.json is out of date"):
        _ = results.refinement


def test_without_it_the_study_is_judged_with_a_reservation(tmp_path: Path) -> None:
    results = stemcal.open_results(tmp_path / "out", load_study(spec_of(tmp_path)))
    (reason,) = (reason for reason in results.verdict.reasons if reason.kind == "unfinished")
    assert reason.severity == "warning"


def test_python_has_it(whole: Path) -> None:
    results = stemcal.open_results(whole / "out", load_study(whole / "study.yaml"))
    assert isinstance(results.refinement, stemcal.RefineResult) and results.refinement.converged
    assert results.refinement.to_frame()["after"].notna().all()
    assert results.parameters == results.inversion.parameters != results.refinement.parameters
    assert sum(run.stage == "refine" for run in results.runs) == 11


def command(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.mark.slow
def test_commands_know_it(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "out"
    planned = command("check", spec, "--out", out)
    assert "at most 12 runs in the other program" in planned.stderr.replace("\n", " ")
    ran = command("run", spec, "--out", out, "--workers", 1)
    assert ran.exit_code == 0 and "Parameters for the other program" in ran.stdout
    assert 'id="refine"' in (out / "report.html").read_text("utf-8")
    alone = json.loads(command("refine", spec, "--out", out, "--json").stdout)["result"]
    assert len(alone["runs"]) == 11 == len(started(tmp_path))
    told = json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]
    stage = next(stage for stage in told["stages"] if stage["stage"] == "refine")
    assert (stage["file"], stage["done"]) == ("fresh", 11)
    assert command("status", spec, "--verify", "--out", out).exit_code == 0
    runs = json.loads(command("status", spec, "--runs", "--out", out, "--json").stdout)["result"]["runs"]
    assert sum(run["stage"] == "refine" for run in runs) == 11


@pytest.mark.slow
def test_a_failed_run_is_begun_again_by_its_own_program(tmp_path: Path) -> None:
    refined(tmp_path, trouble="if d == 11.0: sys.exit(3)")
    spec = tmp_path / "study.yaml"
    before = len(started(tmp_path))
    done = command("run", spec, "--retry", "--out", tmp_path / "out")
    assert done.exit_code == 3 and len(started(tmp_path)) - before == 2


def test_people_run_one_program_only(tmp_path: Path) -> None:
    spec = tmp_path / "study.yaml"
    spec.write_text(f"{published(tmp_path)}refine: {{in: {{kind: sheet}}}}\n", encoding="utf-8")
    with pytest.raises(SpecError, match="a run sheet can contain the results of only one program"):
        load_study(spec)


def test_keys_that_are_left_out_are_the_studys(tmp_path: Path) -> None:
    text = (CONFIGS / "smoke.yaml").read_text("utf-8")
    path = tmp_path / "study.yaml"
    there = "refine: {in: {kind: embedded, element_size: 1 mm}, internal_length: 0 mm, duration: 1.5 s}\n"
    path.write_text(text + there, encoding="utf-8")
    study = load_study(path)
    seen, own = study.there, study.solver
    assert isinstance(own, EmbeddedSolver) and isinstance(seen.solver, EmbeddedSolver)
    assert str(seen.solver.element_size) == "1 mm" != str(own.element_size)
    assert (seen.solver.mass_scaling, seen.solver.time_step) == (own.mass_scaling, own.time_step)
    assert seen.material.internal_length.at(8.0) == 0.0 and seen.loading.duration == 1.5
    assert (
        seen.blade == study.blade
        and stage_called("refine").seen(study) == seen
        and stage_called("validate").seen(study) is study
    )
    assert not isinstance(seen.solver, CommandSolver)


def test_after_a_joint_fit_the_aim_is_what_the_study_gives(tmp_path: Path) -> None:
    """The compromise over the diameters stays: the program is brought to the study's own force at 8 mm."""
    program = PROGRAM.format(law=LAW, trouble="", witness=str(tmp_path / "witness"))
    (tmp_path / "program.py").write_text(program, encoding="utf-8")
    there = REFINE.format(
        python=PYTHON,
        adjust="{failure_strain: [0.001, 0.3]}",
        more="tolerance_percent: 2\n  budget: 12",
    )
    joint = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\ninvert: {diameters: all}\n"
    study, work = make_study(tmp_path, joint + there), StudyFolder(tmp_path / "joint")
    solver = FakeSolver()
    for stage in ("rsm", "invert", "validate", "refine"):
        workflow.run_stage(stage, study, work, InlineExecutor(), solver=solver)
    found, validated = work.read_stage("refine"), work.read_stage("validate")
    at = {row["condition"]: row for row in found["rows"]}
    own = {row["condition"]: row["simulated"] for row in validated["rows"]}
    assert found["aim"] == own[8.0] and found["converged"]
    assert at[8.0]["after"] == pytest.approx(own[8.0], rel=0.02)
    assert found["runs"][0]["predicted"] == own[8.0]


def test_a_factor_that_moves_has_an_effect_there(tmp_path: Path) -> None:
    """The program has no place for the yield stress: a mistake only if it is to be adjusted."""
    with pytest.raises(SpecError) as caught:
        load_study(spec_of(tmp_path, adjust="{yield_stress: [5, 40]}"))
    assert [problem.path for problem in caught.value.problems] == ["refine.adjust.yield_stress"]
    load_study(spec_of(tmp_path))
