"""A study on CalculiX from beginning to end; beam theory knows the answer."""

import json
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest
import workflow

from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Request
from stemcal.study.reading import load_study

SPEC = Path(__file__).parents[2] / "configs" / "calculix-cantilever.yaml"
needs_calculix = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")


def timoshenko(modulus: float, width: float, depth: float, length: float = 100.0, deflection: float = 2.0) -> float:
    """F = w / (L³/3EI + L/κGA) with ν = 0."""
    inertia, area = width * depth**3 / 12, width * depth
    bending, shear = length**3 / (3 * modulus * inertia), length / (5 / 6 * modulus / 2 * area)
    return deflection / (bending + shear)


@needs_calculix
@pytest.mark.parametrize(
    ("modulus", "width", "depth"), [(8000.0, 9.5, 6.0), (11000.0, 10.0, 8.0), (14000.0, 10.5, 10.0)]
)
def test_one_run_agrees_with_beam_theory(modulus: float, width: float, depth: float) -> None:
    levels = {"elastic_modulus": modulus, "width": width}
    answer = make_solver(load_study(SPEC)).solve(Request("screen", 0, levels, depth))
    assert answer.response == pytest.approx(timoshenko(modulus, width, depth), rel=2e-3)


def test_the_script_sums_the_last_reaction_of_the_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As CalculiX 2.20 prints it."""
    (tmp_path / "cantilever.dat").write_text(
        "\n forces (fx,fy,fz) for set TIP and time  0.5000000E+00\n\n"
        "        21 -1.131419E-11  3.105209E-11 -1.403756E+01\n"
        "\n forces (fx,fy,fz) for set TIP and time  0.1000000E+01\n\n"
        "        21 -1.131419E-11  3.105209E-11 -2.807511E+01\n"
        "        22  1.000000E+00  0.000000E+00 -2.000000E+00\n",
        encoding="utf-8",
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: None)
    runpy.run_path(str(SPEC.parent / "calculix" / "run_ccx.py"))
    assert json.loads((tmp_path / "result.json").read_text(encoding="utf-8")) == {"force": 30.07511}


@needs_calculix
def test_study_finds_the_modulus(tmp_path: Path) -> None:
    study = load_study(SPEC)
    with InlineExecutor() as executor:
        validation = workflow.calibrate(study, StudyFolder(tmp_path / "out"), executor).to_json()
    solution = StudyFolder(tmp_path / "out").read_stage("invert")["solution"]
    assert solution["elastic_modulus"] == pytest.approx(11000, rel=2e-3)
    assert solution["width"] == pytest.approx(10, rel=1e-6)
    assert [row["error_percent"] for row in validation["rows"]] == pytest.approx([0, 0, 0], abs=0.1)
    screening = StudyFolder(tmp_path / "out").read_stage("screen")
    effects = {effect["factor"]: effect["effect"] for effect in screening["effects"]}
    # F is proportional to E and to b: over the ranges by 6000/11000 and 1/10 of the force at the centre
    assert effects["elastic_modulus"] == pytest.approx(timoshenko(11000, 10, 8) * 6 / 11, rel=5e-3)
    assert effects["width"] == pytest.approx(timoshenko(11000, 10, 8) * 0.1, rel=2e-2)
    assert not list((tmp_path / "out" / "work").glob("*"))
