"""One surface over factors and conditions, from the spec to the files, on planted laws."""

from dataclasses import dataclass
from math import exp, log
from pathlib import Path

import numpy as np
import pytest
import workflow
from fakes import TWO_FACTORS, FakeSolver
from planting import judged

from stemcal.errors import SpecError
from stemcal.overview.plan import plan
from stemcal.report.outcome import tables_of
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.fitting import fit_of_study
from stemcal.stages.invert.options import InvertOptions
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.rsm.options import dimensions
from stemcal.stages.rsm.over import condition_axis
from stemcal.stages.rsm.result import RsmResult
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

OVER = "rsm: {factors: [yield_stress, failure_strain], over: conditions, centre_points: 1}\ninvert: {diameters: all}\n"
GROWING = TWO_FACTORS.replace("factors:\n", "factors:\n  - {name: growth, low: -0.5, high: 1.5}\n").replace(
    "material: {", "material: {yield_stress: {at: 8 mm, exponent: growth}, "
)
DIAMETERS = (7.0, 8.0, 9.0, 11.0)


@dataclass(frozen=True)
class Power(FakeSolver):
    """Answer `law`, above 9 mm times (d/9)^`kink`, and a travel of 2·(ε/0.03)^0.5 mm."""

    study: Study | None = None
    kink: float = 0.0

    def solve(self, request: Request) -> Answer:
        assert self.study is not None
        level = self.study.parameters(request.levels, request.condition)
        found = law(level["yield_stress"], level["failure_strain"], request.condition)
        found *= max(request.condition / 9.0, 1.0) ** self.kink
        return Answer("ok", response=found, details={"peak_travel": 2.0 * (level["failure_strain"] / 0.03) ** 0.5})


def law(yield_stress: float, strain: float, d: float) -> float:
    """F = 9·σ^0.9·exp(0.1b)·(d/8)^(2.2 + 0.4b), b = (ε − 0.03)/0.02."""
    b = (strain - 0.03) / 0.02
    return float(9.0 * yield_stress**0.9 * exp(0.1 * b) * (d / 8.0) ** (2.2 + 0.4 * b))


def spec(
    folder: Path, text: str, truth: tuple[float, float, float] = (14.0, 0.034, 0.0), more: str = "sd: 1 N"
) -> Study:
    """Write a study whose forces were measured at a yield stress, a failure strain and a growth."""
    y, strain, growth = truth
    rows = (
        f"  - {{diameter: {d:g} mm, force: {law(y * (d / 8.0) ** growth, strain, d):.6f} N, n: 6, {more}}}\n"
        for d in DIAMETERS
    )
    (folder / "over.yaml").write_text(f"{text}targets:\n{''.join(rows)}", encoding="utf-8")
    return load_study(folder / "over.yaml")


def fitted(folder: Path, study: Study, kink: float = 0.0) -> tuple[RsmResult, InvertResult]:
    place, solver = StudyFolder(folder / "out"), Power(study=study, kink=kink)
    rsm = workflow.run_stage("rsm", study, place, InlineExecutor(), solver=solver)
    return rsm, workflow.run_stage("invert", study, place, solver=solver)


def test_fifteen_runs_fit_every_diameter(tmp_path: Path) -> None:
    rsm, found = fitted(tmp_path, spec(tmp_path, TWO_FACTORS + OVER))
    assert len(rsm.design.runs) == 15 and not rsm.conditions
    conditions = [run.condition for run in rsm.design.runs]
    assert (min(conditions), max(conditions)) == (7.0, 11.0)
    sources = [row.source for row in rsm.anova]
    assert {"diameter", "diameter^2", "yield_stress:diameter", "failure_strain:diameter"} <= set(sources)
    assert rsm.over is not None and rsm.over.logarithms == ("response",)
    slope = {row.term: row.value for row in rsm.coefficients}["diameter"]
    assert slope == pytest.approx(2.2 * rsm.over.half_step, rel=1e-3)  # ∂ ln F/∂ ln d
    assert found.parameters["yield_stress"] == pytest.approx(14.0, rel=0.02)
    low, high = found.certainty.intervals["yield_stress"]
    assert low < 14.0 < high
    assert found.joint is not None and found.joint.max_abs_left_out_error_percent is not None
    assert found.joint.max_abs_error_percent < 0.5 and found.joint.max_abs_left_out_error_percent < 1.0


def test_growth_acts_through_the_parameter_that_grows(tmp_path: Path) -> None:
    """Three factors, one of them an exponent, need the 15 runs of two; all have the exponent at its centre."""
    text = GROWING + OVER.replace("failure_strain]", "failure_strain, growth]")
    rsm, found = fitted(tmp_path, spec(tmp_path, text, (14.0, 0.034, 0.8)))
    assert len(rsm.design.runs) == 15
    assert {run.levels["growth"] for run in rsm.design.runs} == {0.5}
    assert list(found.point.solution) == ["yield_stress", "failure_strain", "growth"]
    y = found.parameters["yield_stress"]
    assert y * 1.0 == pytest.approx(14.0, rel=0.05) and found.parameters["growth"] == pytest.approx(0.8, abs=0.1)
    read = RsmResult.from_json(rsm.to_json())
    assert read.over == rsm.over
    levels = {"yield_stress": 14.0, "failure_strain": 0.034, "growth": 0.8}
    assert read.predict(levels).response == pytest.approx(law(14.0, 0.034, 8.0), rel=0.01)  # at 8 mm


@pytest.mark.parametrize(("design", "runs"), [("box-behnken", 13), ("latin-hypercube", 20)])
def test_other_designs(tmp_path: Path, design: str, runs: int) -> None:
    study = spec(tmp_path, TWO_FACTORS + OVER.replace("rsm: {", f"rsm: {{design: {design}, "))
    rsm, found = fitted(tmp_path, study)
    assert len(rsm.design.runs) == runs
    assert found.parameters["yield_stress"] == pytest.approx(14.0, rel=0.03)


def test_the_region_of_uncertainty_is_that_of_the_likelihood(tmp_path: Path) -> None:
    """Without error of the surface the log-likelihood is that of the measured means; `sd` of 1 N counts everywhere."""
    study = spec(tmp_path, TWO_FACTORS + OVER)
    rsm, found = fitted(tmp_path, study)
    fit = fit_of_study(study, rsm)
    there = rsm.scales.to_coded([found.parameters[name] for name in rsm.names])
    predicted = [law(found.parameters["yield_stress"], found.parameters["failure_strain"], d) for d in DIAMETERS]
    assert fit.predict(there)[0] == pytest.approx(predicted, rel=5e-3)
    step = 1e-5
    slopes = [(fit.predict(there + step * e)[0] - fit.predict(there - step * e)[0]) / (2 * step) for e in np.eye(2)]
    assert fit.slopes(there) == pytest.approx(np.array(slopes).T, rel=1e-6)


def test_a_further_response_has_its_own_surface(tmp_path: Path) -> None:
    """The travel, 2·(ε/0.03)^0.5 mm, determines the failure strain, which the forces alone leave open."""
    text = TWO_FACTORS + OVER.replace("diameters: all", "diameters: all, responses: [force, travel]")
    travel = 2.0 * (0.034 / 0.03) ** 0.5
    study = spec(tmp_path, text, more=f"travel: {travel:.6f} mm, sd: {{force: 1 N, travel: 0.01 mm}}")
    rsm, found = fitted(tmp_path, study)
    assert rsm.over is not None and set(rsm.over.left_out_percent) == {"response", "travel"}
    (fits,) = (table for table in tables_of(rsm) if table.title.startswith("Fit quality"))
    assert [row[0] for row in fits.cells] == ["force", "travel"] and "Diameter, mm" not in fits.heads
    assert found.parameters["failure_strain"] == pytest.approx(0.034, rel=0.02)


@pytest.mark.parametrize(
    "change", [("", ""), ("yield_stress, failure_strain", "yield_stress"), ("{", "{design: box-behnken, ")]
)
def test_a_kink_is_named_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: tuple[str, str]
) -> None:
    """Of one factor, or with three levels of the diameter, only the runs of the validation show the kink."""
    study = spec(tmp_path, TWO_FACTORS + "screen: {design: none}\n" + OVER.replace(*change, 1), (14.0, 0.03, 0.0))
    text = (tmp_path / "over.yaml").read_text(encoding="utf-8")
    for kink in (0.0, 1.5):
        verdict, _ = judged(tmp_path / f"{kink:g}", text, Power(study=study, kink=kink), monkeypatch)
        edits = [note.remedy and note.remedy.edit for note in verdict.reasons if note.kind == "bent_over_conditions"]
        assert bool(edits) is bool(kink) and all(str(edit).startswith("rsm: {over: factors") for edit in edits)


def test_the_report_states_the_logarithm_and_the_coding(tmp_path: Path) -> None:
    rsm, _ = fitted(tmp_path, spec(tmp_path, TWO_FACTORS + OVER))
    text = " ".join(" ".join(table.foot) for table in tables_of(rsm))
    assert "ln F = " in text and "ln diameter" in text
    assert any(note.kind == "response_scale" for note in rsm.notes)


@pytest.mark.parametrize("text", [TWO_FACTORS, GROWING])
def test_the_plan_states_the_runs_of_both_ways(tmp_path: Path, text: str) -> None:
    """Two factors at four diameters: 9·4 runs, three of which one is an exponent 15·4; one surface 15 in both."""
    three = OVER if text == TWO_FACTORS else OVER.replace("failure_strain]", "failure_strain, growth]")
    for chosen in (three, three.replace("over: conditions, ", "")):
        study = spec(tmp_path, text + "screen: {design: none}\n" + chosen)
        (note,) = (note for note in plan(study).notes if note.kind == "surface_runs")
        assert "15 runs" in note.text and ("needs 36" if text == TWO_FACTORS else "needs 60") in note.text


@pytest.mark.parametrize(
    ("factors", "design", "seen"),
    [("yield_stress, failure_strain", "central-composite", True), ("yield_stress", "central-composite", False),
     ("yield_stress, failure_strain", "box-behnken", False), ("yield_stress", "latin-hypercube", True)],
)  # fmt: skip
def test_the_plan_states_that_a_bend_stays_unseen(tmp_path: Path, factors: str, design: str, seen: bool) -> None:
    """z_d³ and z_d⁴ need four more levels of d than Box–Behnken has, and degrees of freedom next to them."""
    more = OVER.replace("yield_stress, failure_strain", factors).replace("rsm: {", f"rsm: {{design: {design}, ")
    (note,) = (
        note
        for note in plan(spec(tmp_path, TWO_FACTORS + "screen: {design: none}\n" + more)).notes
        if note.kind == "surface_runs"
    )
    assert ("bend" in note.text) is not seen


@pytest.mark.parametrize(("number", "slow"), [(40, False), (200, True)])
def test_check_states_the_cost_of_a_fit_to_many_means(tmp_path: Path, number: int, slow: bool) -> None:
    rows = "".join(f"  - {{diameter: {d:.3f} mm, force: {20 * d:.1f} N}}\n" for d in np.linspace(6.0, 12.0, number))
    (tmp_path / "many.yaml").write_text(f"{TWO_FACTORS}{OVER}targets:\n{rows}", encoding="utf-8")
    found = [
        doubt for doubt in InvertOptions.doubts(load_study(tmp_path / "many.yaml")) if doubt.path[1] == "diameters"
    ]
    assert bool(found) is slow and all("200 means" in doubt.message for doubt in found)


@pytest.mark.parametrize("over", ["rsm: {over: conditions}\n", OVER.replace("diameters: all", "")])
def test_one_condition_is_refused(tmp_path: Path, over: str) -> None:
    with pytest.raises(SpecError, match=r"invert\.diameters.*rsm\.over"):
        spec(tmp_path, TWO_FACTORS + over)


def test_a_declared_condition(tmp_path: Path) -> None:
    """ln y is quadratic in a and ln(speed): the surface is exact."""

    @dataclass(frozen=True)
    class Own(FakeSolver):
        def solve(self, request: Request) -> Answer:
            a = (request.levels["a"] - 2.0) / 1.0
            return Answer("ok", response=50.0 * exp(0.3 * a) * request.condition ** (0.2 + 0.05 * a))

    rows = "".join(f"  - {{speed: {v} m/s, angle: {50.0 * exp(0.15) * v**0.225:.6f} deg}}\n" for v in (1, 3, 10))
    text = (
        "name: own\nresponses: [{name: angle, label: Angle, unit: deg}]\nconditions: [{name: speed, unit: m/s}]\n"
        "factors: [{name: a, low: 1, high: 3}]\nscreen: {design: none}\n"
        "rsm: {factors: [a], over: conditions, centre_points: 1}\ninvert: {diameters: all}\n"
        "solver: {kind: command, command: [heap, '{{a}}', '{{speed}}'], result: {file: out.json, path: angle}}\n"
        f"targets:\n{rows}"
    )
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    study = load_study(tmp_path / "own.yaml")
    place = StudyFolder(tmp_path / "out")
    rsm = workflow.run_stage("rsm", study, place, InlineExecutor(), solver=Own())
    assert not [table for table in tables_of(rsm) if "Fit quality" in table.title]
    found = workflow.run_stage("invert", study, place, solver=Own())
    assert found.parameters["a"] == pytest.approx(2.5, rel=1e-3)


def test_the_refinement_steps_on_the_one_surface(tmp_path: Path) -> None:
    """A factor (d/9)^1.5 above 9 mm is no quadratic in ln d; one run per diameter and step removes its error."""
    text = TWO_FACTORS + OVER + "refine: {tolerance_percent: 0.02, budget: 32}\n"
    spec(tmp_path, text)
    written = (tmp_path / "over.yaml").read_text("utf-8")
    (bent,) = (f"{law(14.0, 0.034, d) * (d / 9.0) ** 1.5:.6f} N" for d in (11.0,))
    (tmp_path / "over.yaml").write_text(written.replace(f"{law(14.0, 0.034, 11.0):.6f} N", bent), encoding="utf-8")
    study = load_study(tmp_path / "over.yaml")
    fitted(tmp_path, study, kink=1.5)
    solver = Power(study=study, kink=1.5)
    stage = workflow.run_stage("refine", study, StudyFolder(tmp_path / "out"), InlineExecutor(), solver=solver)
    rounds = [list(stage.trial_runs[i : i + 4]) for i in range(0, len(stage.trial_runs), 4)]
    assert [[run.condition for run in part] for part in rounds] == [list(DIAMETERS)] * len(rounds)
    assert rounds[0][0].how == "solution" and {part[0].how for part in rounds[1:]} == {"surface"}
    assert stage.converged and max(abs(row.measured / (row.before or 1.0) - 1.0) for row in stage.rows) > 0.002
    assert stage.parameters["yield_stress"] == pytest.approx(14.0, rel=0.01)


def test_a_condition_that_may_be_zero_has_no_logarithm(tmp_path: Path) -> None:
    """From 0 to 10 °C the middle is 5 °C, from 1 to 10 °C it is √10 in the logarithm."""
    axes = []
    for first in (0, 1):
        rows = "".join(f"  - {{place: {at} degC, angle: 30 deg}}\n" for at in (first, 4, 10))
        text = (
            "name: own\nresponses: [{name: angle, unit: deg}]\nconditions: [{name: place, unit: degC}]\n"
            "factors: [{name: a, low: 1, high: 3}]\nscreen: {design: none}\n"
            "rsm: {factors: [a], over: conditions, centre_points: 1}\ninvert: {diameters: all}\n"
            "solver: {kind: command, command: [heap, '{{a}}', '{{place}}'], result: {file: out.json, path: angle}}\n"
            f"targets:\n{rows}"
        )
        (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
        axes.append(condition_axis(load_study(tmp_path / "own.yaml"), ["a"]))
    assert [axis.logarithmic for axis in axes] == [False, True]
    assert [axis.center for axis in axes] == pytest.approx([5.0, 0.5 * log(10.0)])
    reach = [axis.coded(10.0) for axis in axes]
    assert reach[0] == pytest.approx(reach[1]) and axes[0].coded(0.0) == pytest.approx(-reach[0])


@pytest.mark.parametrize(
    ("factors", "names", "coordinates"),
    [(TWO_FACTORS, ["yield_stress", "failure_strain"], 3), (GROWING, ["growth", "yield_stress", "failure_strain"], 3)],
)
def test_the_condition_is_a_coordinate_and_an_exponent_is_none(
    tmp_path: Path, factors: str, names: list[str], coordinates: int
) -> None:
    rows = "".join(f"  - {{diameter: {d:g} mm, force: {110 * (d / 8) ** 2:g} N}}\n" for d in DIAMETERS)
    over = OVER.replace("yield_stress, failure_strain", ", ".join(names))
    for text, count in ((over, coordinates), (over.replace("over: conditions, ", ""), len(names))):
        (tmp_path / "over.yaml").write_text(f"{factors}{text}targets:\n{rows}", encoding="utf-8")
        assert dimensions(load_study(tmp_path / "over.yaml"), names) == count
