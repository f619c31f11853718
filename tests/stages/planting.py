"""Studies with a known answer planted in them, taken through their stages and judged."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import workflow
from edits import accepted
from fakes import SpecSolver

from stemcal.errors import TargetUnreachable
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.results import Results, fresh_results
from stemcal.stages.verdict.result import Verdict
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

NAMES = ("yield_stress", "failure_strain")
MIDDLE, HALF = np.array([15.0, 0.03]), np.array([5.0, 0.02])


@dataclass(frozen=True)
class Law(SpecSolver):
    """Answer F = (100 + p·a + q·b + r·b² + c·ab + w·sin(3a + φ))·(d/8)^(2 + g·b), travel = (2 + t·a + u·b)·(d/8).

    a and b are the yield stress and the failure strain, coded by their ranges. `rough` is the standard deviation of a
    repeatable relative error of the force. `checks` are further results of the runs of a stage at a diameter. `held`
    replaces b.
    """

    p: float = 20.0
    q: float = 8.0
    r: float = 3.0
    crossed: float = 0.0
    wave: float = 0.0
    phase: float = 0.5
    growth: float = 0.0
    t: float = 0.05
    u: float = -0.3
    rough: float = 0.0
    held: float | None = None
    checks: dict[tuple[str, float], dict[str, float]] = field(default_factory=dict)

    def at(self, a: float, b: float, diameter: float) -> tuple[float, float]:
        """Return the force (N) and the travel (mm)."""
        size = diameter / 8.0
        force = 100.0 + self.p * a + self.q * b + self.r * b * b + self.crossed * a * b
        force += self.wave * np.sin(3.0 * a + self.phase)
        return float(force * size ** (2.0 + self.growth * b)), (2.0 + self.t * a + self.u * b) * size

    def solve(self, request: Request) -> Answer:
        a, b = coded({"failure_strain": 0.03, **request.levels})
        force, travel = self.at(a, b if self.held is None else self.held, request.condition)
        if self.rough:
            seed = [round(1e6 * (value + 2.0)) for value in (a, b)]
            force *= 1.0 + self.rough * np.random.default_rng(seed).standard_normal()
        details = {"hourglass_ratio_percent": 1.0, "inertia_percent": 1.0, "stroke_was_enough": True}
        details |= {"travel": travel, "peak_travel": travel}
        details |= {"curve": {"travel": [0.0, travel, 2.0 * travel], "force": [0.0, force, 0.0]}}
        return Answer("ok", response=force, details=details | self.checks.get((request.stage, request.condition), {}))


def coded(levels: Mapping[str, float]) -> tuple[float, float]:
    """Return a and b."""
    a, b = (np.array([levels[name] for name in NAMES]) - MIDDLE) / HALF
    return float(a), float(b)


def judged(folder: Path, text: str, solver: Solver, monkeypatch: pytest.MonkeyPatch) -> tuple[Verdict, Results]:
    """Take the study of a spec as far as it comes, with a solver in the place of the embedded one."""
    folder.mkdir(exist_ok=True)
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: solver)
    study, place = load_study(folder / "study.yaml"), StudyFolder(folder / "out")
    with suppress(TargetUnreachable):
        workflow.calibrate(study, place, InlineExecutor())
    verdict = verdict_of(study, place)
    accepted(text, verdict, study.source)
    return verdict, fresh_results(study, place)
