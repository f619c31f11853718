"""A newcomer's script with chance in it: an angle of repose of five parameters with normal noise of 0.4 degrees."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stemcal.doe.calibration.intervals import holds
from stemcal.doe.calibration.region import Region
from stemcal.doe.regression.coding import Coding
from stemcal.folder.study_folder import StudyFolder
from stemcal.naming import FIRST
from stemcal.solvers.command import Command
from stemcal.solvers.programs.inputs import seed_of
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.fitting import fit_over, measured_of
from stemcal.stages.surface.analysis import fit_response_surface
from stemcal.stages.surface.result import SurfaceResult, box_of
from stemcal.study.model import Study
from stemcal.study.reading import load_study

NOISE, SPECIMENS, LABORATORY = 0.4, 5, 0.8  # deg; how many heaps the laboratory made, and their standard deviation
# What the script computes: friction between grains, rolling friction, friction on the wall, restitution, modulus.
SCRIPT = """
import json
import random


def angle(friction, rolling, wall, restitution, modulus):
    slope = 20.0 + 25.0 * friction + 60.0 * rolling - 30.0 * friction * rolling - 8.0 * (friction - 0.4) ** 2
    return slope + 2.0 * wall + 0.3 * restitution + 0.0 * modulus


def measured(given):
    levels = {name: float(value) for name, value in given.items() if name != "seed"}
    return angle(**levels) + random.Random(given["seed"]).gauss(0.0, 0.4)


if __name__ == "__main__":
    with open("heap.json") as file:
        answer = measured(json.load(file))
    with open("out.json", "w") as file:
        json.dump({"angle": answer}, file)
"""
TEMPLATE = (
    '{"friction": {{friction}}, "rolling": {{rolling}}, "wall": {{wall}}, "restitution": {{restitution}}, '
    '"modulus": {{modulus}}, "seed": {{seed}}}'
)
SPEC = """\
name: repose
factors:
  - {name: friction, low: 0.2, high: 0.6}
  - {name: rolling, low: 0.02, high: 0.2}
  - {name: wall, low: 0.2, high: 0.6}
  - {name: restitution, low: 0.3, high: 0.7}
  - {name: modulus, unit: MPa, low: 1, high: 10}
responses:
  - {name: angle, label: Angle of repose, symbol: θ, unit: deg}
solver:
  kind: command
  command: [%s, repose.py]
  files: [repose.py]
  templates: [heap.json]
  replicates: 3
  result: {file: out.json, path: angle}
screen: {design: PB, centre_points: 3}
rsm: {design: BBD, factors: [friction, rolling, wall], centre_points: 3}
targets:
  - {angle: 32.6 deg, sd: 0.8 deg, n: 5}
"""
TRUTH = {"friction": 0.35, "rolling": 0.09, "wall": 0.5, "restitution": 0.5, "modulus": 5.5}


def study_of(folder: Path) -> Study:
    (folder / "repose.py").write_text(SCRIPT, encoding="utf-8")
    (folder / "heap.json").write_text(TEMPLATE, encoding="utf-8")
    spec = folder / "repose.yaml"
    spec.write_text(SPEC % json.dumps(sys.executable), encoding="utf-8")
    return load_study(spec)


SPACE: dict[str, Any] = {"__name__": "repose"}
exec(SCRIPT, SPACE)


@dataclass(frozen=True)
class Called(Command):
    """Answers by calling the script's function, where a process for each of thousands of runs would take an hour."""

    immediate = True

    number: int = 0

    def solve(self, request: Request) -> Answer:
        """Answer one request."""
        given = {name: float(value) for name, value in self._values(request).items() if name in TRUTH}
        return Answer("ok", response=SPACE["measured"]({**given, "seed": seed_of(request) + self.number}))


def surface_over(study: Study, folder: Path, number: int = 0) -> SurfaceResult:
    return fit_response_surface(study, StudyFolder(folder), solver=Called(study, number=number))


def test_called_and_run_give_the_same_angle(tmp_path):
    study = study_of(tmp_path)
    request = Request("screen", 2, TRUTH, 0.0, replicate=1)
    assert Called(study).solve(request).response == Command(study).placed(tmp_path / "work").solve(request).response


def test_pure_error_is_the_noise(tmp_path):
    """Of 15 points, three of them the centre, three times: 32 df, sd within 0.4·√(χ²/32) at 99.9 %."""
    surface = surface_over(study_of(tmp_path), tmp_path / "runs")
    pure = next(row for row in surface.anova if row.source == "Pure error")
    assert pure.df == 3 * 15 - 13
    assert NOISE * (11.98 / 32) ** 0.5 < (pure.sum_of_squares / pure.df) ** 0.5 < NOISE * (64.0 / 32) ** 0.5


@pytest.mark.slow
def test_intervals_hold_the_truth_in_93_of_100_studies(tmp_path):
    """Each with seeds of its own, and five heaps of a laboratory of its own; 95 are expected, give or take 2.2.

    The angle alone fixes a surface in the space of three factors. Whether the truth lies in it is told by the misfit
    there: at the true factors it rises by no more than is allowed along its slope. The factors' own intervals, the
    shadows of that set, hold the truth more often.
    """
    study, random, true = study_of(tmp_path), np.random.default_rng(17), float(SPACE["angle"](**TRUTH))
    held, whole, scatter = [], [], []
    for number in range(100):
        heaps = true + LABORATORY * random.standard_normal(SPECIMENS)
        target = {"angle": f"{heaps.mean():.6f} deg", "sd": f"{heaps.std(ddof=1):.6f} deg", "n": SPECIMENS}
        drawn = study.with_(targets=[target])
        surface = surface_over(drawn, tmp_path / str(number), number)
        pure = next(row for row in surface.anova if row.source == "Pure error")
        scatter.append(pure.sum_of_squares / pure.df)
        coding: Coding = surface.scales
        point = coding.to_coded([TRUTH[name] for name in coding.names])
        region = Region(*box_of(drawn, coding), surface.radius)
        found = fit_over(measured_of(drawn.calibration_target, [FIRST]), [surface.fitted], region)
        slope = found.tangents.slopes[0]
        held.append(found.value(point) <= found.tangents.allowed(slope / np.linalg.norm(slope)))
        whole.append(all(holds(found, point)))
    print(f"set {sum(held)}, factors {sum(whole)}, pure error {float(np.mean(scatter)) ** 0.5:.4f}")
    assert sum(held) >= 93
    assert sum(whole) >= 93
    # 3200 df: the standard error of this is 0.005
    assert float(np.mean(scatter)) ** 0.5 == pytest.approx(NOISE, abs=0.017)
