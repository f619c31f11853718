"""A study without a response surface: the refinement calibrates from mid-range, on planted laws."""

import math
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import workflow
from fakes import SPEC, TWO_FACTORS, FakeSolver

from stemcal.errors import SpecError, UsageError
from stemcal.overview.plan import plan
from stemcal.report.outcome import tables_of
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.fresh import changes_since
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.refine.secant import _weights
from stemcal.stages.results import fresh_results
from stemcal.stages.stage import stages_of
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

QUICK = "rsm: {design: none}\n"
ONE = "targets:\n  - {diameter: 8 mm, force: 110 N}\n"
THREE = TWO_FACTORS.replace(", strain_rate_p: 8", "").replace(
    "factors:\n", "factors:\n  - {name: strain_rate_p, low: 4, high: 12}\n"
)
DIAMETERS = (7.0, 8.0, 10.0)


@dataclass(frozen=True)
class Power(FakeSolver):
    """F = 9·σ^0.9·(ε/0.03)^b·(d/8)^2.2; b is `strain`, or with `bends` 0.3·(d − 8); fails in the rows of `fails`."""

    strain: float = 0.1
    bends: bool = False
    reversed: bool = False
    fails: tuple[int, ...] = ()

    def solve(self, request: Request) -> Answer:
        if request.stage == "refine" and request.row in self.fails:
            return Answer("failed", reason="inverted", message="element 3 turned inside out")
        return Answer("ok", response=self.force(request.levels["yield_stress"], request.levels["failure_strain"],
                                                request.condition))  # fmt: skip

    def force(self, stress: float, strain: float, d: float) -> float:
        power = 0.3 * (d - 8.0) if self.bends else self.strain
        found = 9.0 * stress**0.9 * (strain / 0.03) ** power * (d / 8.0) ** 2.2
        return 10000.0 / found if self.reversed else found


def quick(folder: Path, text: str, solver: FakeSolver) -> tuple[RefineResult, Study, StudyFolder]:
    (folder / "quick.yaml").write_text(text, encoding="utf-8")
    study, place = load_study(folder / "quick.yaml"), StudyFolder(folder / "out")
    return workflow.run_stage("refine", study, place, InlineExecutor(), solver=solver), study, place


def kinds(result: RefineResult) -> set[str]:
    return {note.kind for note in result.notes}


@pytest.mark.parametrize("force", [80.0, 100.0, 110.0, 125.0])
@pytest.mark.parametrize("reverse", [False, True])
def test_one_force_is_met_in_four_runs(tmp_path: Path, force: float, reverse: bool) -> None:
    """σ = (F/9)^(1/0.9), or of 10000/F where the force falls with it; the failure strain stays at its middle."""
    text = TWO_FACTORS + QUICK + ONE.replace("110 N", f"{force} N")
    stage, *_ = quick(tmp_path, text, Power(reversed=reverse))
    wanted = 10000.0 / force if reverse else force
    assert stage.converged and len(stage.trial_runs) <= 4 and abs(stage.error_percent) <= 1.0
    assert stage.parameters["yield_stress"] == pytest.approx((wanted / 9.0) ** (1 / 0.9), rel=0.012)
    assert stage.parameters["failure_strain"] == 0.03 and stage.undetermined == ("failure_strain",)
    assert {"no_intervals", "not_identified"} <= kinds(stage)


def test_a_factor_without_effect_is_passed_over(tmp_path: Path) -> None:
    stage, *_ = quick(tmp_path, THREE + QUICK + ONE, Power())
    assert stage.undetermined == ("strain_rate_p", "failure_strain") and stage.parameters["strain_rate_p"] == 8.0
    assert [run.how for run in stage.trial_runs][:3] == ["middle", "probe", "probe"] and stage.converged


def test_the_next_factor_helps_where_the_first_is_at_its_end(tmp_path: Path) -> None:
    """70 N would need 9.7 MPa at mid-strain; at 10 MPa the failure strain is 0.03·(70/71.5)^(1/0.1) ≈ 0.0243."""
    stage, *_ = quick(tmp_path, TWO_FACTORS + QUICK + ONE.replace("110", "70"), Power())
    assert stage.converged and stage.undetermined == () and stage.parameters["failure_strain"] < 0.03
    assert RefineResult.from_json(stage.to_json()) == stage and "not_identified" not in kinds(stage)


def test_a_target_out_of_reach_names_the_ranges(tmp_path: Path) -> None:
    stage, *_ = quick(tmp_path, TWO_FACTORS + QUICK + ONE.replace("110", "40"), Power())
    (note,) = (note for note in stage.notes if note.kind == "not_reached")
    assert stage.stopped == "out_of_reach" and note.remedy is not None and "yield_stress" in note.remedy.text


def joint(truth: tuple[float, float], solver: Power, bias: tuple[float, ...] = (1.0, 1.0, 1.0)) -> str:
    rows = (
        f"  - {{diameter: {d:g} mm, force: {part * solver.force(*truth, d):.6f} N, n: 6, sd: 3 N}}\n"
        for d, part in zip(DIAMETERS, bias, strict=True)
    )
    return f"{TWO_FACTORS}{QUICK}invert: {{diameters: all}}\ntargets:\n{''.join(rows)}"


def test_several_diameters_determine_both_factors(tmp_path: Path) -> None:
    """The failure strain changes the growth with the diameter: both parameters are found, in five rounds at most."""
    solver = Power(bends=True)
    text = joint((17.0, 0.024), solver).replace(QUICK, QUICK + "refine: {tolerance_percent: .3}\n")
    stage, *_ = quick(tmp_path, text, solver)
    assert stage.converged and len(stage.trial_runs) <= 15 and stage.undetermined == ()
    assert stage.parameters == pytest.approx({"yield_stress": 17.0, "failure_strain": 0.024}, rel=0.01)


def test_a_factor_that_acts_as_another_stays_in_the_middle(tmp_path: Path) -> None:
    """Over all diameters the failure strain changes the force as the yield stress does: ε^0.1 and σ^0.9."""
    stage, *_ = quick(tmp_path, joint((17.0, 0.03), Power(strain=0.3)), Power(strain=0.3))
    assert stage.undetermined == ("failure_strain",) and stage.parameters["failure_strain"] == 0.03
    assert stage.parameters["yield_stress"] == pytest.approx(17.0, rel=0.01)


def test_measurements_that_disagree_end_at_the_least_misfit(tmp_path: Path) -> None:
    """Errors of 5, −5, 5 % cannot be fitted: the fit ends, with all errors below 7 %, before the budget."""
    solver = Power(bends=True)
    stage, *_ = quick(tmp_path, joint((15.0, 0.03), solver, (1.05, 0.95, 1.05)), solver)
    assert stage.stopped == "settled" and len(stage.trial_runs) < stage.budget
    errors = np.array([row.error_percent for row in stage.rows])
    assert np.abs(errors).max() < 7.0 and errors.min() < 0.0 < errors.max()


def test_a_step_that_gains_little_is_not_worth_its_runs(tmp_path: Path) -> None:
    """Of errors of 3, −3, 0 % a first step leaves the least misfit, within 5 %: 4 rounds become 3."""
    solver = Power(bends=True)
    stage, *_ = quick(tmp_path, joint((15.0, 0.03), solver, (1.03, 0.97, 1.0)), solver)
    assert stage.stopped == "settled" and len(stage.trial_runs) == 9


@pytest.mark.parametrize("row", [0, 1, 2])
def test_a_failed_run_is_stepped_back_from(tmp_path: Path, row: int) -> None:
    stage, *_ = quick(tmp_path, TWO_FACTORS + QUICK + ONE, Power(fails=(row,)))
    assert not stage.trial_runs[row].outcome.ok and stage.trial_runs[row + 1].how == "back" and stage.converged


def test_a_whole_study_has_two_stages_and_a_reservation(tmp_path: Path) -> None:
    text = joint((17.0, 0.03), Power()).replace("diameters: all", "diameters: [7 mm, 8 mm]")
    _, study, folder = quick(tmp_path, text, Power())
    assert [stage.name for stage in stages_of(study)] == ["refine", "validate"]
    checked = workflow.run_stage("validate", study, folder, InlineExecutor(), solver=Power())
    assert checked.worst_held_out_percent < 1.5 and [row.compared.role for row in checked.rows][-1] == "held_out"
    found = fresh_results(study, folder, [RefineResult.from_json(folder.read_stage("refine")), checked])
    verdict = verdict_of(study, folder, found)
    assert verdict.verdict == "with_reservations" and found.parameters["yield_stress"] == pytest.approx(17.0, rel=0.02)
    assert {"no_intervals", "not_identified"} <= {reason.kind for reason in verdict.reasons}
    (table, *_) = tables_of(found.done[0])
    assert [row[-1] for row in table.cells] == ["refinement", "mid-range"]


@pytest.mark.parametrize("name", ["screen", "rsm", "invert"])
def test_stages_of_a_surface_are_refused(tmp_path: Path, name: str) -> None:
    _, study, folder = quick(tmp_path, TWO_FACTORS + QUICK + ONE, Power())
    with pytest.raises(UsageError, match="no response surface"):
        workflow.run_stage(name, study, folder, InlineExecutor(), solver=Power())


def test_the_plan_counts_its_runs(tmp_path: Path) -> None:
    """A run at the middle, one per factor that a force can determine, and the usual corrections; at most 2 + 5."""
    (tmp_path / "plan.yaml").write_text(TWO_FACTORS + QUICK + ONE, encoding="utf-8")
    (note,) = (note for note in plan(load_study(tmp_path / "plan.yaml")).notes if note.kind == "decided_later")
    assert "7 additional runs" in note.text


def test_another_model_is_refused(tmp_path: Path) -> None:
    other = "refine: {in: {kind: deck, program: openradioss}}\n"
    (tmp_path / "wrong.yaml").write_text(TWO_FACTORS + QUICK + other + ONE, encoding="utf-8")
    with pytest.raises(SpecError, match=r"rsm\.design"):
        load_study(tmp_path / "wrong.yaml")


def test_changes_of_what_it_fits_are_seen(tmp_path: Path) -> None:
    """The same study with other fitted diameters, or with a response surface, does not keep the result."""
    text = joint((17.0, 0.03), Power())
    _, study, folder = quick(tmp_path, text, Power())
    for other in (text.replace("diameters: all", "diameters: [7 mm, 8 mm]"), text.replace(QUICK, "")):
        (tmp_path / "other.yaml").write_text(other.replace("rsm: {}", ""), encoding="utf-8")
        changed = load_study(tmp_path / "other.yaml")
        assert changes_since(study, Power(), folder, "refine") == []
        assert changes_since(changed, Power(), folder, "refine")


def test_nine_factors_need_no_list(tmp_path: Path) -> None:
    """The force of the fake study depends on few of its nine factors; a value is found without a screening."""
    text = SPEC + QUICK
    stage, *_ = quick(tmp_path, text, FakeSolver())
    assert stage.converged and "density" in stage.undetermined and "yield_stress" not in stage.undetermined
    assert math.isclose(stage.parameters["density"], 1100.0)


def test_a_missed_target_is_a_reason_without_a_calibration_stage(tmp_path: Path) -> None:
    _, study, folder = quick(tmp_path, TWO_FACTORS + QUICK + ONE.replace("110", "40"), Power())
    checked = workflow.run_stage("validate", study, folder, InlineExecutor(), solver=Power())
    results = fresh_results(study, folder, [RefineResult.from_json(folder.read_stage("refine")), checked])
    verdict = verdict_of(study, folder, results)
    assert verdict.verdict == "not_calibrated" and verdict.has("target_missed")


def test_a_prior_is_the_start(tmp_path: Path) -> None:
    """Without a run that determines it, the failure strain stays at the mean of its prior."""
    text = TWO_FACTORS.replace("high: 0.05}", "high: 0.05, prior: {mean: 0.02, sd: 0.005, source: a paper}}")
    stage, *_ = quick(tmp_path, text + QUICK + ONE, Power())
    assert stage.converged and stage.parameters["failure_strain"] == pytest.approx(0.02)
    assert stage.undetermined == ("failure_strain",)


def test_a_mean_weighs_by_its_scatter_and_its_specimens() -> None:
    """n/s² where the scatter is known well; s is 3 % of each mean where none was measured."""

    def weights(*means: tuple[float, float | None, int | None]) -> list[float]:
        rows: list[Any] = [SimpleNamespace(value=value, sd=sd, n=n) for value, sd, n in means]
        return [float(weight) for weight in _weights(rows)]

    many = 10**6
    known = weights((100.0, 5.0, many), (200.0, 20.0, 4 * many))
    assert known == pytest.approx([many / 25.0, 4 * many / 400.0], rel=0.01)
    assert weights((100.0, None, None), (200.0, None, 4)) == pytest.approx([1.0 / 9.0, 4.0 / 36.0])
    assert weights((100.0, 5.0, None)) == pytest.approx([1.0 / 25.0])
