"""What runs take is known from those that are recorded, else by a guess."""

import socket
from dataclasses import asdict
from pathlib import Path

import pytest
import workflow
from fakes import FakeSolver, make_study

from stemcal.cutting.simulate import shear
from stemcal.overview.plan import costs_of, elapsed, overhead, plan, total
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import Run
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.cost import _cutting_steps, seconds
from stemcal.solvers.embedded import shear_test
from stemcal.solvers.laboratory_runs import laboratory_test
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


def asked(row: int, diameter: float = 8.0) -> Request:
    return Request("screen", row, {"yield_stress": 10.0 + row, "failure_strain": 0.03}, diameter)


def recorded(folder: StudyFolder, solver: FakeSolver, request: Request, seconds: float, host: str) -> None:
    answer, told = asdict(Answer("ok", 100.0)), {"wall_seconds": seconds, "host": host}
    run = Run.of(solver, request)
    folder.save({"key": run.key, "identity": run.identity, "request": asdict(request), **answer, "provenance": told})


def test_records_of_this_machine_and_this_solver_tell_the_pace(tmp_path: Path) -> None:
    """Guessed 10 s at 8 mm and 40 s at 16 mm, taken 15 and 60: one and a half times as long."""
    solver, here = FakeSolver(), socket.gethostname()
    with StudyFolder(tmp_path / "out") as folder:
        recorded(folder, solver, asked(0), 15.0, here)
        recorded(folder, solver, asked(1, 16.0), 60.0, here)
        recorded(folder, solver, asked(2), 500.0, f"not-{here}")
        recorded(folder, FakeSolver(version=2), asked(3), 500.0, here)
        found = costs_of(solver, folder, asked(9))
    assert found.of is not None
    assert found.of(asked(5)) == pytest.approx(15.0)
    assert (found.source, found.recorded) == ("recorded", 2)


def test_without_records_the_solver_guesses(tmp_path: Path) -> None:
    guessed = costs_of(FakeSolver(), None, asked(0))
    assert guessed.of is not None
    assert (guessed.of(asked(0)), guessed.source) == (10.0, "guess")


def test_a_stage_waits_for_the_one_before(tmp_path: Path) -> None:
    assert elapsed([[1.0] * 5, [2.0]], 2) == 5.0
    assert elapsed([[], [2.0]], 8) == 2.0


def test_a_plan_shares_out_its_runs(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    one, two = (plan(study, None, FakeSolver(), workers) for workers in (1, 2))
    assert one.elapsed is not None and two.elapsed is not None and one.seconds is not None
    assert one.elapsed - overhead(FakeSolver()) == pytest.approx(one.seconds)
    assert two.elapsed - overhead(FakeSolver()) < 0.6 * one.seconds


def test_the_runs_of_a_refinement_elsewhere_are_counted(tmp_path: Path) -> None:
    section = "refine: {in: {kind: sheet}, budget: 6}\n"
    found = plan(make_study(tmp_path, section), None, FakeSolver(), 1)
    (note,) = (note for note in found.notes if note.kind == "decided_later")
    alone = plan(make_study(tmp_path), None, FakeSolver(), 1)
    assert "at most 6 runs in" in note.text and found.elapsed == alone.elapsed


def test_a_finished_study_has_no_rounds_left(tmp_path: Path) -> None:
    """Before, a climb is counted with its usual rounds of 10 s each; afterwards nothing is."""
    study = make_study(tmp_path, "refine: {tolerance_percent: 2}\n")
    before = plan(study, None, FakeSolver(), 1)
    with StudyFolder(tmp_path / "out") as folder:
        workflow.calibrate(study, folder, InlineExecutor(), solver=FakeSolver())
        after = plan(study, folder, FakeSolver(), 1)
    assert before.elapsed is not None and before.elapsed > before.to_run * 10.0
    assert (after.to_run, after.elapsed) == (0, overhead(FakeSolver()))


def test_each_test_has_its_time(tmp_path: Path) -> None:
    """A bending test of a long span takes most of a run; the tests add up to the run, and to the study."""
    study = load_study(CONFIGS / "three-tests.yaml")
    solver, request = make_solver(study), Request("rsm", 0, study.midlevels(), 8.0)
    each = solver.cost_by_test(request)
    assert list(each) == ["cutting", "bending", "pull"]
    assert sum(each.values()) == pytest.approx(solver.cost_estimate(request))
    tests = dict(zip(("bending", "pull"), study.tests, strict=True))
    sheared = shear_test(study, request.levels, 8.0)
    assert each["cutting"] == pytest.approx(seconds(sheared))
    assert each["pull"] == pytest.approx(seconds(laboratory_test(tests["pull"], sheared)))
    found = plan(study, workers=1)
    assert found.seconds is not None and sum(found.tests.values()) == pytest.approx(found.seconds)
    assert found.tests["bending"] > found.tests["pull"] > 0.0
    assert "bending" in " ".join(total(found))


MATERIAL = """\
name: cutter
factors: [{name: edge_angle, unit: deg, low: 30, high: 45}, {name: thickness, unit: mm, low: 2, high: 3}]
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, yield_stress: 12 MPa,
  tangent_modulus: 0.5 MPa, hardening_parameter: 0.05, failure_strain: 0.06}
goal: {minimise: [cutting_energy]}
solver: {rate_law: none, element_size: d/10}
screen: {design: none}
rsm: {factors: [edge_angle, thickness]}
"""
FAST = "loading: {until: severed, speed: 2 m/s, stroke: 18 mm}\n"
WHOLE_CUTS = {
    "solid, fixed knife": "specimen: {outer_diameter: 12 mm, diameter_ratio: 0, length: 30 mm}\n"
    "supports: {kind: counter_edge, height: 15 mm, clearance: 1 mm}\n" + FAST,
    "layers, fixed knife": "specimen: {outer_diameter: 8 mm, length: 24 mm}\n"
    "layers: [{name: skin, thickness: 1 mm, yield_stress: 15 MPa}, {name: pith, yield_stress: 6 MPa}]\n"
    "supports: {kind: counter_edge, height: 12 mm, clearance: 1 mm}\n" + FAST,
    "hollow, two supports": "specimen: {outer_diameter: 8 mm, length: 30 mm}\nsupports: {clearance: 20 mm}\n"
    "loading: {until: severed, speed: 100 mm/min, stroke: 10 mm}\n",
}


@pytest.mark.slow
@pytest.mark.parametrize("case", WHOLE_CUTS)
def test_steps_of_a_whole_cut(case: str, tmp_path: Path) -> None:
    """The steps do not depend on the machine; the estimate is within a factor of two (it was a fifth to a half)."""
    spec = tmp_path / "cutter.yaml"
    spec.write_text(f"{MATERIAL}{WHOLE_CUTS[case]}", encoding="utf-8")
    study = load_study(spec)
    test = shear_test(study, study.midlevels(), study.specimen.outer_diameter)
    estimated, done = _cutting_steps(test)[0], shear(test).steps
    assert 0.5 < estimated / done < 2.0
