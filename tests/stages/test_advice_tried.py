"""Advice on doubtful physics tried with the embedded solver: a coarse study, too heavy, and after the advice."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stemcal
from stemcal import workflow
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.store import StudyFolder
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import verdict_of
from stemcal.study.spec import load_study

SPEC = """\
schema_version: 1
name: heavy
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: failure_strain, low: 0.02, high: 0.05}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, strain_rate_c: 90 1/s, strain_rate_p: 8, internal_length: d/4.5}
blade: {edge_spread: d/6}
specimen: {length: 30 mm}
solver: {kind: embedded, element_size: d/12, mass_scaling: MASS, time_step: STEP us, outputs: 200}
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 7 mm, force: SEVEN N}
    - {diameter: 8 mm, force: EIGHT N}
rsm: {factors: [yield_stress, failure_strain], centre_points: 1}
refine: {tolerance_percent: 2, budget: 3}
"""
TRUTH = {"yield_stress": 16.0, "failure_strain": 0.035}


def judged(folder: Path, mass: str, step: str, forces: tuple[float, float]) -> Verdict:
    folder.mkdir()
    text = SPEC.replace("MASS", mass).replace("STEP", step)
    text = text.replace("SEVEN", f"{forces[0]:.2f}").replace("EIGHT", f"{forces[1]:.2f}")
    path = folder / "heavy.yaml"
    path.write_text(text, encoding="utf-8")
    study, place = load_study(path), StudyFolder(folder / "out")
    workflow.calibrate(study, place, InlineExecutor())
    return verdict_of(study, place)


def doubtful(verdict: Verdict) -> int:
    """Return in how many runs the kinetic energy is doubtful."""
    told = [re.match(r"in (\d+) of \d+ runs .*kinetic", reason.sentence) for reason in verdict.reasons]
    return sum(int(match[1]) for match in told if match)


@pytest.mark.slow
def test_a_stem_too_heavy_and_after_the_advice(tmp_path: Path) -> None:
    """What is measured is what the solver gives with little mass, at a known truth."""
    path = tmp_path / "light.yaml"
    light = SPEC.replace("MASS", "1e4").replace("STEP", "20").replace("SEVEN", "100").replace("EIGHT", "130")
    path.write_text(light, encoding="utf-8")
    study = load_study(path)
    seven, eight = (stemcal.simulate(study, diameter=d, **TRUTH).peak_force for d in (7.0, 8.0))
    before = judged(tmp_path / "before", "4e5", "160", (seven, eight))
    assert before.verdict == "not_calibrated"
    assert any(reason.rule == "physics" and "kinetic energy up to" in reason.sentence for reason in before.reasons)
    remedy = next(reason.remedy for reason in before.reasons if "kinetic energy" in reason.sentence)
    advised = re.match(r"`mass_scaling: (\S+)` and `time_step: (\S+) us` under `solver`", remedy)
    assert advised is not None
    after = judged(tmp_path / "after", advised[1], advised[2], (seven, eight))
    assert after.verdict == "with_reservations"
    assert doubtful(after) <= 0.25 * doubtful(before)
