"""A joint fit over diameters, from the spec to the files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import workflow
from fakes import TWO_FACTORS, FakeSolver, make_study

from stemcal.errors import SpecError
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.reading import load_study

TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 2}\n"


@dataclass(frozen=True)
class Growing(FakeSolver):
    """F = (100 + 20a)·(d/8)² + 8·b·(d − 7.9): only several diameters tell a and b apart."""

    def solve(self, request: Request) -> Answer:
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        d = request.condition
        return Answer("ok", response=(100.0 + 20.0 * a) * (d / 8.0) ** 2 + 8.0 * b * (d - 7.9))


SPEC = (
    TWO_FACTORS
    + """\
targets:
  - {diameter: 7 mm, force: FORCE7 N, sd: 2 N, n: 6}
  - {diameter: 8 mm, force: FORCE8 N, sd: 2 N, n: 6}
  - {diameter: 10 mm, force: FORCE10 N, sd: 2 N, n: 6}
"""
)


def spec(extra: str) -> str:
    """Forces at yield 16 MPa (a = 0.2), failure strain 0.036 (b = 0.3)."""
    text = SPEC
    for d in (7, 8, 10):
        text = text.replace(f"FORCE{d} ", f"{104.0 * (d / 8.0) ** 2 + 2.4 * (d - 7.9):.6f} ")
    return text + TWO + extra


def solved(tmp_path: Path, extra: str) -> tuple[dict[str, Any], StudyFolder]:
    path, folder = tmp_path / "joint.yaml", StudyFolder(tmp_path / "out")
    path.write_text(spec(extra), encoding="utf-8")
    study = load_study(path)
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=Growing())
    return workflow.run_stage("invert", study, folder, solver=Growing()).to_json(), folder


def test_joint_fit_finds_both_parameters(tmp_path: Path) -> None:
    stage, folder = solved(tmp_path, "invert: {diameters: all}\n")
    assert list(stage["solution"].values()) == pytest.approx([16.0, 0.036], rel=1e-4)
    assert stage["joint"]["max_abs_error_percent"] < 0.01
    assert [row["left_out_error_percent"] for row in stage["joint"]["rows"]] == pytest.approx([0.0] * 3, abs=0.05)
    assert len(folder.read_stage("rsm")["conditions"]) == 3
    assert stage["joint"]["scatter"] == "measured"


def test_the_intervals_of_a_joint_fit(tmp_path: Path) -> None:
    stage, _ = solved(tmp_path, "invert: {diameters: all}\n")
    joint = stage["certainty"]
    low, high = joint["intervals"]["yield_stress"]
    assert low < 16.0 < high and high - low < 2.0
    assert joint["free"] == joint["directions"] == []


def test_chosen_diameters_only(tmp_path: Path) -> None:
    stage, folder = solved(tmp_path, "invert: {diameters: [8 mm, 10 mm]}\n")
    assert [row["condition"] for row in stage["joint"]["rows"]] == [8.0, 10.0]
    assert len(folder.keys()) == 9 * 2


def test_validation_simulates_the_joint_solution(tmp_path: Path) -> None:
    path, folder = tmp_path / "joint.yaml", StudyFolder(tmp_path / "out")
    path.write_text(spec("invert: {diameters: all}\n"), encoding="utf-8")
    study = load_study(path)
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=Growing())
    workflow.run_stage("invert", study, folder, solver=Growing())
    stage = workflow.run_stage("validate", study, folder, InlineExecutor(), solver=Growing()).to_json()
    assert stage["worst_percent"] < 0.01


def test_a_diameter_without_a_force_is_named(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="no force is given for 9 mm"):
        make_study(tmp_path, TWO + "invert: {diameters: [8 mm, 9 mm]}\n")
