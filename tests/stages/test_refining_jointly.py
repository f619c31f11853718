"""The closed loop over three diameters, on forces that no quadratic fits."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from fakes import TWO_FACTORS, FakeSolver

from stemcal import workflow
from stemcal.errors import RunsFailed
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.report.tables.stages import tables_of
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.refine.result import RefineResult
from stemcal.study.reading import load_study

SPEC = (
    TWO_FACTORS
    + """\
rsm: {factors: [yield_stress, failure_strain], centre_points: 1}
invert: {diameters: all}
"""
)


def force(a: float, b: float, diameter: float) -> float:
    """F = 100·exp(0.6a)·(d/8)^(2 + 0.5b): b is the growth with the diameter."""
    return 100.0 * math.exp(0.6 * a) * (diameter / 8.0) ** (2.0 + 0.5 * b)


@dataclass(frozen=True)
class Curved(FakeSolver):
    """Answers `force`; with `travels` also a travel of exp(0.3b) mm; fails in these rows of the refining."""

    fails: frozenset[int] = field(default_factory=frozenset)
    travels: bool = False

    def solve(self, request: Request) -> Answer:
        if request.stage == "refine" and request.row in self.fails and request.condition > 9.0:
            return Answer("failed", reason="inverted", message="element 3 turned inside out")
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        details = {"peak_travel": math.exp(0.3 * b)} if self.travels else {}
        return Answer("ok", response=force(a, b, request.condition), details=details)


def refined(
    tmp_path: Path,
    refine: str,
    truth: tuple[float, float] = (0.5, -0.4),
    bias: tuple[float, ...] = (1.0, 1.0, 1.0),
    solver: FakeSolver | None = None,
    spec: str = SPEC,
    travel: bool = False,
) -> tuple[dict[str, Any], StudyFolder]:
    """Close the loop on forces measured at `truth`, times `bias`."""
    path, folder, solver = tmp_path / "closing.yaml", StudyFolder(tmp_path / "out"), solver or Curved()
    more = f", travel: {math.exp(0.3 * truth[1]):.9f} mm, travel_sd: 0.01 mm" if travel else ""
    forces = "".join(
        f"    - {{diameter: {d} mm, force: {part * force(*truth, d):.9f} N, sd: 3 N, n: 6{more}}}\n"
        for d, part in zip((7, 8, 10), bias, strict=True)
    )
    path.write_text(f"{spec}refine: {refine}\ntargets:\n  calibrate_at: 8 mm\n  forces:\n{forces}", encoding="utf-8")
    study = load_study(path)
    workflow.fit_surface(study, folder, InlineExecutor(), solver=solver)
    workflow.invert(study, folder, solver=solver)
    return workflow.refine(study, folder, InlineExecutor(), solver=solver).to_json(), folder


def test_ends_when_every_diameter_is_within_the_tolerance(tmp_path: Path) -> None:
    """The surfaces alone were off; at the end a = 0.5, b = −0.4 again: 17.5 MPa, 0.022."""
    stage, folder = refined(tmp_path, "{tolerance_percent: 0.01, budget: 60}")
    first = stage["iterations"][0]
    assert first["max_abs_error_percent"] > 0.3
    assert stage["converged"] and stage["stopped"] == "tolerance" and stage["max_abs_error_percent"] <= 0.01
    assert list(stage["solution"].values()) == pytest.approx([17.5, 0.022], rel=2e-3)
    assert len(stage["rows"]) == 3 * len(stage["iterations"]) <= 24
    header, *lines = (folder.path / "refine.csv").read_text("utf-8").splitlines()
    assert "diameter" in header.split(",") and len(lines) == len(stage["rows"])


def test_misfits_never_rise_at_what_is_kept(tmp_path: Path) -> None:
    stage, _ = refined(tmp_path, "{tolerance_percent: 0.01, budget: 60}")
    assert stage["iterations"][-1]["misfit"] == min(entry["misfit"] for entry in stage["iterations"])


def test_settles_where_no_parameters_do_better(tmp_path: Path) -> None:
    """7 and 10 mm measured 5 % high, 8 mm 5 % low: no a, b fit; the end is the weighted least-squares fit.

    Its gradient vanishes: moving a or b by a little either way raises Σ (measured − F)²/variance.
    """
    stage, _ = refined(tmp_path, "{tolerance_percent: 0.1, budget: 90}", bias=(1.05, 0.95, 1.05))
    assert stage["stopped"] == "settled" and not stage["converged"]
    measured = {d: part * force(0.5, -0.4, d) for d, part in ((7, 1.05), (8, 0.95), (10, 1.05))}
    solution = stage["solution"]
    a, b = (solution["yield_stress"] - 15.0) / 5.0, (solution["failure_strain"] - 0.03) / 0.02

    variance = {entry["condition"]: entry["variance"] for entry in stage["surfaces"]}

    def misfit(a: float, b: float) -> float:
        return sum((y - force(a, b, d)) ** 2 / variance[d] for d, y in measured.items())

    assert misfit(a, b) == pytest.approx(stage["iterations"][stage["iteration"] - 1]["misfit"], rel=1e-6)

    for da, db in ((0.02, 0.0), (-0.02, 0.0), (0.0, 0.05), (0.0, -0.05)):
        assert misfit(a + da, b + db) > misfit(a, b)


def test_a_spent_budget_ends_it(tmp_path: Path) -> None:
    """Seven runs are two rounds of three."""
    stage, _ = refined(tmp_path, "{tolerance_percent: 1e-9, budget: 7}")
    assert stage["stopped"] == "budget" and len(stage["rows"]) == 6


def test_the_first_point_is_the_joint_solution_beside_its_intervals(tmp_path: Path) -> None:
    stage, folder = refined(tmp_path, "{budget: 3}")
    invert = folder.read_stage("invert")
    assert stage["iterations"][0]["coded"] == pytest.approx(invert["coded"])
    predicted = [row["predicted"] for row in stage["rows"]]
    assert predicted == pytest.approx([row["predicted"] for row in invert["joint"]["rows"]])
    for row in stage["rows"]:
        low, high = row["prediction_interval"]
        assert row["inside_interval"] == (low <= row["response"] <= high)


def test_a_failed_run_at_one_diameter_is_stepped_back_from(tmp_path: Path) -> None:
    stage, _ = refined(tmp_path, "{tolerance_percent: 0.01, budget: 60}", solver=Curved(fails=frozenset({1})))
    assert stage["iterations"][1]["misfit"] is None and stage["iterations"][2]["how"] == "back"
    assert stage["converged"]


def test_only_failures_are_an_error(tmp_path: Path) -> None:
    with pytest.raises(RunsFailed, match="in none of 2 iterations did every run succeed"):
        refined(tmp_path, "{budget: 6}", solver=Curved(fails=frozenset(range(9))))


def test_responses_are_met_too(tmp_path: Path) -> None:
    spec = SPEC.replace("diameters: all", "diameters: all, responses: [force, travel]")
    stage, _ = refined(
        tmp_path, "{tolerance_percent: 0.01, budget: 60}", solver=Curved(travels=True), spec=spec, travel=True
    )
    (travel,) = stage["rows"][-1]["further"]
    assert travel["simulated"] == pytest.approx(math.exp(-0.12), rel=2e-3) and stage["converged"]


@dataclass(frozen=True)
class Forgetful(Curved):
    """Tells no travel of the runs of the refining, as records of an earlier version."""

    def solve(self, request: Request) -> Answer:
        answer = super().solve(request)
        return replace(answer, details={}) if request.stage == "refine" else answer


def test_records_without_the_travel_are_named(tmp_path: Path) -> None:
    spec = SPEC.replace("diameters: all", "diameters: all, responses: [force, travel]")
    with pytest.raises(RunsFailed, match="the records hold no travel"):
        refined(tmp_path, "{budget: 6}", solver=Forgetful(travels=True), spec=spec, travel=True)


def test_running_again_computes_nothing_and_the_table_shows_diameters(tmp_path: Path) -> None:
    stage, folder = refined(tmp_path, "{tolerance_percent: 0.01, budget: 60}")
    keys = folder.keys()
    study = load_study(tmp_path / "closing.yaml")
    assert (
        workflow.refine(study, folder, InlineExecutor(), solver=Curved()).to_json() == stage and folder.keys() == keys
    )
    table = tables_of(RefineResult.from_json(stage))[0]
    assert "Diameter, mm" in table.heads and len(table.strong) == 3
