"""A force in a wave, which no quadratic follows: the verdict reports it, and refining corrects the force."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from fakes import TWO_FACTORS
from planting import Law, judged

from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.results import Results
from stemcal.stages.validate.result import ValidateResult
from stemcal.stages.verdict.result import Verdict

SPEC = (
    TWO_FACTORS
    + """\
rsm: {factors: [yield_stress, failure_strain], design: latin-hypercube, runs: 14}
targets: [{diameter: 8 mm, force: ASKED N, sd: 1 N, n: 10}]
"""
)


WAVE = Law(p=0.0, q=6.0, r=0.0, wave=18.0)  # greatest near 124 N


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    def of(wave: Law, asked: float, extra: str = "", spec: str = SPEC) -> tuple[Verdict, Results]:
        folder = tmp_path / f"{len(list(tmp_path.iterdir()))}"
        return judged(folder, spec.replace("ASKED", f"{asked:g}") + extra, wave, monkeypatch)

    return of


@pytest.mark.parametrize("phase", [0.5, *(pytest.param(phase, marks=pytest.mark.slow) for phase in (0.7, 0.9))])
def test_a_target_above_the_quadratic_is_out_of_reach_and_the_surface_is_rough(judge, phase: float) -> None:
    """121 N of at most 124 N: the quadratic ends below 120 N, and its residuals show that it does not follow."""
    verdict, results = judge(replace(WAVE, phase=phase), 121.0)
    (reason,) = (reason for reason in verdict.reasons if reason.kind == "out_of_reach")
    _, _, high = map(float, re.findall(r"\d+\.?\d*", reason.text))
    assert results.of(InvertResult) is None and verdict.verdict == "not_calibrated" and high < 120.0
    assert verdict.has("rough_response")


def test_refining_corrects_what_the_quadratic_misses(judge) -> None:
    """At the solution the surface is off by more than 2 %; refining brings the force within 0.5 %."""
    missed, _ = judge(WAVE, 112.0)
    assert missed.has("rough_response") and missed.has("target_missed")
    verdict, results = judge(WAVE, 112.0, "refine: {tolerance_percent: 0.5}\n")
    assert results.of(RefineResult).converged and not verdict.has("target_missed")
    (row,) = results.of(ValidateResult).rows
    assert row.compared.error_percent == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("truth", [(0.1, 0.4), pytest.param((-0.3, -0.3), marks=pytest.mark.slow)])
def test_a_joint_fit_of_quadratics_that_fail_is_reported(judge, truth: tuple[float, float]) -> None:
    """Three diameters, exact means: the quadratics miss the waves by 10 N and more."""
    waves = replace(WAVE, growth=0.4)
    rows = [f"{{diameter: {d} mm, force: {waves.at(*truth, d)[0]:.6f} N, sd: 0.5 N, n: 10}}" for d in (7, 8, 10)]
    of_one = "targets: [{diameter: 8 mm, force: ASKED N, sd: 1 N, n: 10}]"
    spec = SPEC.replace(of_one, f"targets: [{', '.join(rows)}]").replace("runs: 14", "runs: 20")
    verdict, _ = judge(waves, 0.0, "invert: {diameters: all}\n", spec)
    assert verdict.verdict != "calibrated" and verdict.has("rough_response")
