"""A force in a wave, which no quadratic follows: the process judges what is within reach, and it is reached."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from fakes import TWO_FACTORS, SpecSolver

from stemcal import workflow
from stemcal.errors import TargetUnreachable
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.store import StudyFolder
from stemcal.solvers import SOLVERS
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.invert.single import SolvedByProcess
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.rules import OutOfReach, verdict_of
from stemcal.study.reading import load_study

SPEC = (
    TWO_FACTORS
    + """\
rsm: {factors: [yield_stress, failure_strain], design: latin-hypercube, runs: 14}
targets: {calibrate_at: 8 mm, forces: [{diameter: 8 mm, force: ASKED N, sd: 1 N, n: 10}]}
"""
)


@dataclass(frozen=True)
class Wave(SpecSolver):
    """F = 100 + 18·sin(3a + phase) + 6b, greatest near 124 N."""

    phase: float = 0.5

    def solve(self, request: Request) -> Answer:
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        return Answer("ok", response=100.0 + 18.0 * np.sin(3.0 * a + self.phase) + 6.0 * b)


@pytest.fixture
def judge(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    def judged(wave: Wave, asked: float, extra: str = "") -> tuple[Verdict, Results]:
        monkeypatch.setitem(SOLVERS, "embedded", lambda _study: wave)
        folder = tmp_path / f"{len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        (folder / "study.yaml").write_text(SPEC.replace("ASKED", f"{asked:g}") + extra, encoding="utf-8")
        study, place = load_study(folder / "study.yaml"), StudyFolder(folder / "out")
        with suppress(TargetUnreachable):
            workflow.calibrate(study, place, InlineExecutor())
        return verdict_of(study, place), fresh_results(study, place)

    return judged


@pytest.mark.parametrize("phase", [0.5, 0.7, 0.9])
def test_a_wave_reaches_what_the_quadratic_says_it_cannot(judge, phase: float) -> None:
    """121 N of at most 124 N: the quadratic ends below 120 N, the simulation at the solution gives 121 N."""
    verdict, results = judge(Wave(phase=phase), 121.0)
    found = results.inversion
    (note,) = (note for note in found.notes if isinstance(note, SolvedByProcess))
    assert note.high < 121.0 and note.process_predicted_r2 > note.quadratic_predicted_r2 + 0.05
    low, high = found.reachable
    assert low == pytest.approx(76.0, abs=1.5) and high == pytest.approx(124.0, abs=1.5)
    assert not verdict.says("out_of_reach") and not verdict.says("target_missed")
    (row,) = results.validation.rows
    assert row.compared.error_percent == pytest.approx(0.0, abs=1.0)


def test_what_a_wave_does_not_reach_is_out_of_reach_by_the_process(judge) -> None:
    verdict, results = judge(Wave(), 130.0)
    (reason,) = (reason for reason in verdict.reasons if isinstance(reason, OutOfReach))
    assert results.inversion is None and verdict.verdict == "not_calibrated"
    assert reason.high == pytest.approx(124.0, abs=1.5)


def test_refining_goes_on_from_there(judge) -> None:
    verdict, results = judge(Wave(), 121.0, "refine: {model: process, tolerance_percent: 0.5}\n")
    assert results.refinement.converged and not verdict.says("target_missed")
