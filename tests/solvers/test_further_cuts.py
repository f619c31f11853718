"""A further cutting test of a study: the sections that it changes, and what it gives."""

from dataclasses import replace
from pathlib import Path

import pytest

from stemcal import cutting
from stemcal.cutting.parts import ShearTest
from stemcal.errors import SimulationFailed
from stemcal.laboratory import perform as laboratory
from stemcal.laboratory.perform import cut
from stemcal.solvers.embedded import Embedded, shear_test, simulate_levels
from stemcal.solvers.laboratory_runs import distrusted
from stemcal.solvers.protocol import Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.rules.plausible import doubts

THREE = (Path(__file__).parents[2] / "configs" / "three-tests.yaml").read_text(encoding="utf-8")


def _study(folder: Path, changes: str, sections: str = "", solver: str = "") -> Study:
    """Return three-tests.yaml with one further test, of kind cutting, and more keys under blade and solver."""
    head, rest = THREE.split("tests:\n", 1)
    measured = "  - {test: again, diameter: 8 mm, force: 190 N, work: 80 mJ, sd: {force: 11 N, work: 6 mJ}, n: 9}\n"
    own = rest.split("targets:\n", 1)[1].splitlines(keepends=True)
    targets = "targets:\n" + measured + "".join(line for line in own if "test:" not in line)
    further = f"tests:\n  - {{name: again, kind: cutting, {changes.rstrip(', ')}}}\n\n"
    path = folder / "further.yaml"
    text = (head + further + targets).replace("blade: {", f"blade: {{{sections}")
    path.write_text(text.replace("  kind: embedded\n", f"  kind: embedded\n{solver}"), encoding="utf-8")
    return load_study(path)


def test_without_changes_it_is_the_first(tmp_path: Path) -> None:
    study = _study(tmp_path, "")
    levels = study.midlevels()
    first, again = simulate_levels(study, levels), simulate_levels(study, levels, 8.0, section=study.tests[0])
    assert isinstance(again, laboratory.LaboratoryResult)
    assert again.responses["force"] == first.peak_force
    assert again.responses["travel"] == first.peak_travel
    assert again.break_travel == first.break_travel
    curve, broken = first.history, first.history.travel < (first.break_travel or 0.0)
    steps = 0.5 * (curve.force_filtered[1:] + curve.force_filtered[:-1]) * (curve.travel[1:] - curve.travel[:-1])
    assert again.responses["work"] == pytest.approx(float(steps[broken[1:]].sum()), rel=1e-12)


def test_a_blade_of_another_angle_gives_what_a_spec_with_that_blade_gives(tmp_path: Path) -> None:
    study = _study(tmp_path, "blade: {edge_angle: 60 deg}, ")
    other = _study(tmp_path, "", "edge_angle: 60 deg, ")
    answer = Embedded(study).solve(Request("rsm", 0, study.midlevels(), 8.0))
    found = answer.details["responses"]
    assert found["again_force"] == simulate_levels(other, study.midlevels()).peak_force
    assert found["again_force"] > 1.02 * (answer.response or 0.0)
    assert set(found) == {"again_force", "again_work"}


def test_its_mesh_is_where_that_of_the_first_is(tmp_path: Path) -> None:
    study = _study(tmp_path, "", solver="  replicates: 2\n")
    request = Request("rsm", 0, study.midlevels(), 8.0, replicate=2)
    solver = Embedded(study)
    ((_, again),), first = solver._laboratory_tests(request), solver._test(request)
    assert isinstance(again, ShearTest)
    assert again.discretisation == first.discretisation and 0.25 <= first.discretisation.shift < 0.5


def test_what_is_not_given_is_the_spec_s(tmp_path: Path) -> None:
    study = _study(tmp_path, "supports: {clearance: 12 mm}, speed: 400 mm/min, stroke: 1 mm, blade: {bevel: one}, ")
    (section,), own = study.tests, shear_test(study, study.midlevels(), 8.0)
    test = shear_test(study.cut_as(section, 8.0), study.midlevels(), 8.0)
    assert test.supports == replace(own.supports, clearance=12.0)
    assert test.blade == replace(own.blade, bevel="one")
    assert test.discretisation.symmetry == "half"
    assert test.loading.speed == pytest.approx(400.0 / 60.0)
    assert test.loading.speed * test.loading.duration == pytest.approx(1.0 + own.loading.gap)
    # above 100 mm/min mass scaling goes as the speed to the power of -2 (`EmbeddedSolver.at_speed`)
    ratio = own.discretisation.integration.mass_scaling / test.discretisation.integration.mass_scaling
    assert ratio == pytest.approx(16.0)


def test_another_blade_or_code_is_another_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain, blunt = (_study(tmp_path, changes) for changes in ("", "blade: {edge_angle: 60 deg}, "))
    request = Request("rsm", 0, plain.midlevels(), 8.0)
    one, other = (Embedded(study).identity(request) for study in (plain, blunt))
    assert one["tests"] == other["tests"]
    assert one["laboratory"] != other["laboratory"]
    for package in (cutting, laboratory):
        with monkeypatch.context() as changed:
            changed.setattr(package, "REVISION", 1000)
            assert Embedded(plain).identity(request)["laboratory"] != one["laboratory"]


def test_check_doubts_a_further_cut_as_the_first(tmp_path: Path) -> None:
    """A speed in mm/s where mm/min was meant, and work, which depends on the mesh."""
    found = doubts(_study(tmp_path, "speed: 60 mm/s, stroke: 90 m, "))
    questioned = [doubt.path[2:] for doubt in found if doubt.path[0] == "tests"]
    assert sorted(questioned) == [(), ("speed",), ("stroke",)]
    assert not [d for d in doubts(_study(tmp_path, "blade: {edge_angle: 60 deg}, ")) if d.path[0] != "tests"]


def test_a_cut_that_creates_energy_is_no_answer(tmp_path: Path) -> None:
    study = _study(tmp_path, "")
    result = cut(shear_test(study, study.midlevels(), 8.0))
    assert distrusted(result, 0.9) is None
    for changes, reason in (
        ({"energy_drift_percent": 5.1}, "energy_drift"),
        ({"contact_energy_percent": -1.1}, "contact_energy"),
    ):
        failure = distrusted(replace(result, **changes), 0.9)
        assert isinstance(failure, SimulationFailed)
        assert failure.reason == reason and "`time_step_safety: 0.45` under `solver`" in str(failure)
