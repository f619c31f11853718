"""An exponent that is planted in the forces is found by a joint fit, and told of on the page."""

from dataclasses import dataclass
from pathlib import Path

import pytest
import workflow
from fakes import FakeSolver

from stemcal.report.study_tables import grown_table
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

GROWING = Path(__file__).parents[1] / "cases" / "good" / "growing.yaml"
YIELD, STRAIN, EXPONENT = 16.0, 0.036, 0.6


def force(yield_stress: float, strain: float, d: float) -> float:
    """F = 6·σy·(d/8)² + 2000·ε·d/8, in N; what the exponent does is in σy."""
    return 6.0 * yield_stress * (d / 8.0) ** 2 + 2000.0 * strain * d / 8.0


@dataclass(frozen=True)
class OfYield(FakeSolver):
    """Answers `force` with the yield stress that the study gives a stem of this diameter."""

    study: Study | None = None

    def solve(self, request: Request) -> Answer:
        assert self.study is not None
        given = self.study.parameters(request.levels, request.condition)
        return Answer("ok", response=force(given["yield_stress"], given["failure_strain"], request.condition))


def test_a_planted_exponent_is_found(tmp_path: Path) -> None:
    path, folder, run = tmp_path / "growing.yaml", StudyFolder(tmp_path / "out"), InlineExecutor()
    text = GROWING.read_text(encoding="utf-8")
    for d, printed in ((7, "120"), (8, "159.2"), (11, "378.2")):
        measured = force(YIELD * (d / 8.0) ** EXPONENT, STRAIN, d)
        text = text.replace(f"force: {printed} N", f"force: {measured:.6f} N, sd: 1 N, n: 6")
    path.write_text(text, encoding="utf-8")
    study = load_study(path)
    solver = OfYield(study=study)
    workflow.run_stage("rsm", study, folder, run, solver=solver)
    found = workflow.run_stage("invert", study, folder, solver=solver)
    assert list(found.point.solution.values()) == pytest.approx([YIELD, STRAIN, EXPONENT], rel=0.05)
    assert found.joint is not None and found.joint.max_abs_error_percent < 0.1
    checked = workflow.run_stage("validate", study, folder, run, solver=solver)
    assert checked.worst_percent < 0.5
    table = grown_table(study, found.parameters)
    sigma = {row[0]: dict(zip([c.key for c in table.columns], row, strict=True))["yield_stress"] for row in table.rows}
    assert sigma == pytest.approx({d: YIELD * (d / 8.0) ** EXPONENT for d in (7.0, 8.0, 11.0)}, rel=0.03)
