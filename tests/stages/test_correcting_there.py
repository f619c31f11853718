"""A surface corrected by the solver of the transfer: what is calibrated and validated is that program's."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from stemcal.cli.app import app
from stemcal.errors import SpecError
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.plan import InAnotherProgram, plan
from stemcal.solvers import make_solver
from stemcal.stages.fresh import read_fresh
from stemcal.stages.surface.result import SurfaceResult
from stemcal.study.model import Study
from stemcal.study.reading import load_study

# Here F = 100 + 20 a + 10 b + 3 a² + a b at 8 mm, a and b coded by the ranges; there 1.5 times that, and 6 a more.
PROGRAM = """
import json, sys
y, e, d, there = float(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]), sys.argv[4] == "there"
a, b = (y - 15.0) / 5.0, (e - 0.03) / 0.02
force = 100.0 + 20.0 * a + 10.0 * b + 3.0 * a * a + a * b
force = 1.5 * force + 6.0 * a if there else force
open("WITNESS", "a").write(sys.argv[4] + "\\n")
json.dump({"force": force * (d / 8.0) ** 2}, open("out.json", "w"))
"""
SPEC = """
name: corrected-there
factors:
  - {name: yield_stress, low: 10, high: 20, unit: MPa}
  - {name: failure_strain, low: 0.01, high: 0.05}
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 7 mm, force: 122.5 N}
    - {diameter: 8 mm, force: 160 N}
    - {diameter: 9 mm, force: 202.5 N}
screen: {design: none}
rsm: {design: central-composite, factors: [yield_stress, failure_strain], RSM}
solver: {SOLVER_here}
MORE
"""
SOLVER = """
  kind: command
  command: [PYTHON, program.py, "{{yield_stress}}", "{{failure_strain}}", "{{diameter}}", WHERE]
  files: [program.py]
  result: {kind: json, file: out.json, path: force}
"""
TRANSFER = "transfer: {adjust: [yield_stress], budget: 6, solver: {SOLVER_there}}"
CORRECTED = "correct_with: transfer.solver, correct_runs: 6"


def spec(folder: Path, rsm: str = CORRECTED, more: str = TRANSFER) -> Path:
    """Write a study of one program that is taken to another; return its path."""
    (folder / "program.py").write_text(PROGRAM.replace("WITNESS", (folder / "witness").as_posix()), encoding="utf-8")
    text = SPEC.replace("MORE", more).replace("RSM", rsm)
    for where in ("here", "there"):
        solver = SOLVER.replace("PYTHON", json.dumps(sys.executable)).replace("WHERE", where)
        text = text.replace(f"SOLVER_{where}", ", ".join(solver.strip().split("\n  ")))
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def run(path: Path, *command: str) -> Any:
    """Run a command on the study; return what it prints."""
    done = CliRunner().invoke(app, [*command, str(path), "--out", str(path.parent / "out")])
    assert done.exit_code == 0, done.output
    return done.output


def stage(path: Path, name: str) -> dict[str, Any]:
    """Return the file of a stage."""
    return json.loads((path.parent / "out" / f"{name}.json").read_text("utf-8"))


def started(path: Path) -> list[str]:
    """Return where each run was made, in order."""
    return (path.parent / "witness").read_text("utf-8").split()


def test_the_surface_the_solution_and_the_validation_are_those_of_the_program_there(done: Path) -> None:
    """1.5 (100 + 20 a + 10 b + 3 a² + a b) + 6 a = 160 at 8 mm; elsewhere (d/8)² of it, which is what was measured."""
    path, surface = done, stage(done, "rsm")
    assert surface["coarse"]["solver"] == "command" and surface["coarse"]["factor"] == pytest.approx(1.5)
    assert surface["coarse"]["tilt"]["yield_stress"] == pytest.approx(6.0 * half_step(surface), rel=1e-6)
    assert len(surface["coarse"]["fine_runs"]) == 6
    found = stage(path, "invert")["solution"]
    a, b = (found["yield_stress"] - 15.0) / 5.0, (found["failure_strain"] - 0.03) / 0.02
    assert 1.5 * (100.0 + 20.0 * a + 10.0 * b + 3.0 * a * a + a * b) + 6.0 * a == pytest.approx(160.0, rel=1e-6)
    rows = stage(path, "validate")["rows"]
    assert [row["simulated"] for row in rows] == pytest.approx([122.5, 160.0, 202.5], rel=1e-6)
    made = started(path)  # the first one twice, to see whether the program repeats itself
    assert made.count("there") == 6 + 3 and made.count("here") <= 14


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The spec of a finished study."""
    path = spec(tmp_path_factory.mktemp("done"))
    run(path, "run")
    return path


def half_step(surface: dict[str, Any]) -> float:
    """Return a of coded 1."""
    return next(f["half_step"] for f in surface["factors"] if f["factor"] == "yield_stress") / 5.0


def test_the_transfer_goes_on_from_there_without_further_runs(done: Path) -> None:
    found = stage(done, "transfer")
    assert found["converged"] and found["parameters"] == stage(done, "validate")["parameters"]
    assert [row["after"] for row in found["rows"]] == pytest.approx([122.5, 160.0, 202.5], rel=1e-6)


def test_what_is_finished_is_fresh_and_another_program_there_makes_the_surface_stale(
    done: Path, tmp_path: Path
) -> None:
    path, made = shutil.copytree(done.parent, tmp_path / "copy") / done.name, started(done)
    run(path, "run")
    assert started(done) == made
    status = json.loads(run(path, "status", "--json"))
    assert {one["stage"]: one["file"] for one in status["stages"]}.items() >= {
        ("rsm", "fresh"), ("invert", "fresh"), ("validate", "fresh"), ("transfer", "fresh")
    }  # fmt: skip
    path.write_text(path.read_text("utf-8").replace(", there]", ', there, "2"]'), encoding="utf-8")
    now = {one["stage"]: one["file"] for one in json.loads(run(path, "status", "--json"))["stages"]}
    assert now["rsm"] == now["validate"] == now["transfer"] == "stale"


def test_a_program_there_with_chance_in_it_makes_each_run_several_times(tmp_path: Path) -> None:
    """Three replicates with a scatter of 1 %: the correction takes their means."""
    path = spec(tmp_path)
    before, there = path.read_text("utf-8").split("transfer:")
    chance = there.replace(", there]", ', there, "{{seed}}"]').replace("budget: 6", "budget: 18")
    chance = chance.replace("kind: command,", "kind: command, deterministic: false, replicates: 3,")
    path.write_text(f"{before}transfer:{chance}", encoding="utf-8")
    program = path.with_name("program.py")
    drawn = 'json.dump({"force": (1.0 + (0.01 * (int(sys.argv[5]) % 3 - 1) if there else 0.0)) * force'
    program.write_text(program.read_text("utf-8").replace('json.dump({"force": force', drawn), encoding="utf-8")
    run(path, "run")
    assert all(len(one["replicates"]["values"]) == 3 for one in stage(path, "rsm")["coarse"]["fine_runs"])
    assert stage(path, "rsm")["coarse"]["factor"] == pytest.approx(1.5, rel=0.02)


def test_a_program_here_with_chance_in_it_is_corrected_from_the_means_of_its_replicates(tmp_path: Path) -> None:
    """Three replicates with a scatter of 10 %: factor and slopes are those of a least-squares fit to the means."""
    path = spec(tmp_path)
    here = path.read_text("utf-8").replace(", here]", ', here, "{{seed}}"]')
    chance = here.replace("\nsolver: {kind: command,", "\nsolver: {kind: command, deterministic: false, replicates: 3,")
    path.write_text(chance, encoding="utf-8")
    program = path.with_name("program.py")
    drawn = 'json.dump({"force": (1.0 if there else 1.0 + 0.1 * (int(sys.argv[5]) % 7 - 3) / 3.0) * force'
    program.write_text(program.read_text("utf-8").replace('json.dump({"force": force', drawn), encoding="utf-8")
    run(path, "rsm")
    surface = stage(path, "rsm")
    design, fine = surface["design"]["runs"], surface["coarse"]["fine_runs"]
    rows, points = [one["run"] - 1 for one in fine], len(design) // 3
    means = [np.mean([again["response"] for again in design[row::points]]) for row in rows]
    z = np.column_stack([means, [list(design[row]["coded"].values()) for row in rows]])
    factor, *tilt = np.linalg.lstsq(z, np.array([one["response"] for one in fine]))[0]
    assert np.ptp([again["response"] for again in design[0::points]]) > 1.0  # else there was no chance in it
    assert surface["coarse"]["factor"] == pytest.approx(factor)
    assert list(surface["coarse"]["tilt"].values()) == pytest.approx(tilt)
    study = load_study(path)
    read = read_fresh(study, make_solver(study), StudyFolder(tmp_path / "out"), SurfaceResult)
    assert read.fitted.beta == pytest.approx(read.beta)  # fitted again from its file, as by the inversion


def test_the_refinement_runs_there(tmp_path: Path) -> None:
    """16 b² more there, which no factor and no slope has: the refinement ends within its tolerance all the same."""
    path = spec(tmp_path, more=f"{TRANSFER}\nrefine: {{tolerance_percent: 0.2, budget: 6}}")
    program = tmp_path / "program.py"
    program.write_text(program.read_text("utf-8").replace("6.0 * a", "6.0 * a + 16.0 * b * b"), encoding="utf-8")
    run(path, "run")
    found = stage(path, "refine")
    assert found["converged"] and found["simulated"] == pytest.approx(160.0, rel=0.002)
    assert found["simulated"] == stage(path, "validate")["rows"][1]["simulated"]
    assert started(path).count("there") > 6 + 3  # runs of the design, and conditions


def test_plan_counts_the_runs_there_apart(tmp_path: Path) -> None:
    """Nine rows here; there six of the design, three conditions, and at most six of the transfer."""
    study = load_study(spec(tmp_path))
    assert [one.stage for one in plan(study).stages] == ["rsm"] and runs_there(study) == 6 + 3 + 6


def runs_there(study: Study, folder: StudyFolder | None = None) -> int:
    """Return how many runs `plan` counts in the other program."""
    (found,) = [note for note in plan(study, folder).notes if isinstance(note, InAnotherProgram)]
    return found.there


def test_plan_counts_every_diameter_point_and_replicate_there(tmp_path: Path) -> None:
    """Six of the design at 7, 9 and, where it is calibrated, 8 mm, three conditions, five of `refine`: three times."""
    solver = "{SOLVER_there}".replace("{SOLVER", "{deterministic: false, replicates: 3, SOLVER")
    more = f"{TRANSFER.replace('{SOLVER_there}', solver)}\nrefine: {{budget: 5}}\ninvert: {{diameters: [7 mm, 9 mm]}}"
    path = spec(tmp_path, more=more)
    there = path.read_text("utf-8").replace(", there]", ', there, "{{seed}}"]')
    path.write_text(there, encoding="utf-8")
    assert runs_there(load_study(path)) == 3 * (3 * 6 + 3 + 5) + 6


def test_plan_takes_no_runs_here_for_runs_there(tmp_path: Path) -> None:
    """A study validated by its own solver has all runs there still before it; then the six of the transfer at most."""
    path, folder = spec(tmp_path, "centre_points: 5", more=""), StudyFolder(tmp_path / "out")
    path.write_text(path.read_text("utf-8").replace("160 N", "120 N"), encoding="utf-8")
    run(path, "run")
    assert sum(record["request"]["stage"] == "validate" for record in map(folder.peek, folder.keys()) if record) == 3
    assert runs_there(load_study(spec(tmp_path)), folder) == 6 + 3 + 6
    run(path, "run")
    assert started(path).count("there") == 6 + 3 and runs_there(load_study(path), folder) == 6


@pytest.mark.parametrize(
    ("rsm", "more", "said"),
    [
        (CORRECTED, "", "the spec has no section transfer"),
        (CORRECTED, "transfer: {solver: {kind: manual}, adjust: [yield_stress]}", "entered by hand"),
        (f"{CORRECTED}, coarse: {{element_size: d/8}}", TRANSFER, "rsm.coarse corrects the surface too"),
        (CORRECTED, f"{TRANSFER}\nrefine: {{model: process}}", "a Gaussian process takes the runs of the design"),
    ],
)
def test_check_says_what_cannot_be(tmp_path: Path, rsm: str, more: str, said: str) -> None:
    with pytest.raises(SpecError) as problem:
        load_study(spec(tmp_path, rsm, more))
    assert said in str(problem.value)


def test_more_runs_than_the_design_has_are_refused_before_any_run(tmp_path: Path) -> None:
    path = spec(tmp_path, CORRECTED.replace("6", "60"))
    done = CliRunner().invoke(app, ["run", str(path), "--out", str(tmp_path / "out")])
    assert done.exit_code != 0 and "rsm.correct_runs: the design has fewer than 60 different runs" in done.output
    assert not (tmp_path / "witness").exists()
