"""Force, travel and work fitted together: a known answer, and a run of the embedded solver found again."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import workflow
from fakes import TWO_FACTORS, FakeSolver

from stemcal.errors import RunsFailed, UsageError
from stemcal.responses import work_until
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import curve_responses
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.embedded import Embedded
from stemcal.solvers.protocol import RESPONSES, Answer, Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
FACTORS = (
    TWO_FACTORS
    + """\
rsm: {factors: [yield_stress, failure_strain], centre_points: 1}
"""
)


@dataclass(frozen=True)
class Telling(FakeSolver):
    """F = 100 + 20a, travel 1 + 0.2b, work half of their product, as a triangle has it; all times d/8."""

    silent: bool = False

    def solve(self, request: Request) -> Answer:
        a = (request.levels["yield_stress"] - 15.0) / 5.0
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        size = request.condition / 8.0
        force, travel = size * (100.0 + 20.0 * a), size * (1.0 + 0.2 * b)
        curve = {"travel": [0.0, travel, 2.0 * travel], "force": [0.0, force, 0.0]}
        return Answer("ok", response=force, details={} if self.silent else {"peak_travel": travel, "curve": curve})


def study_of(tmp_path: Path, targets: str, extra: str) -> Study:
    path = tmp_path / "responses.yaml"
    forces = "\n".join(f"    - {{{target}}}" for target in targets.splitlines())
    path.write_text(f"{FACTORS}targets:\n{forces}\n{extra}", encoding="utf-8")
    return load_study(path)


EIGHT = (
    "diameter: 8 mm, force: 104 N, travel: 1.06 mm, work: 55.12 mJ, n: 4, sd: {force: 2 N, travel: 0.02 mm, work: 2 mJ}"
)
TEN = "diameter: 10 mm, force: 130 N, sd: {force: 2 N}, n: 4, travel: 1.325 mm"


def solved(study: Study, tmp_path: Path, solver: FakeSolver | None = None) -> dict[str, Any]:
    folder, solver = StudyFolder(tmp_path / "out"), solver or Telling()
    workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=solver)
    return workflow.run_stage("invert", study, folder, solver=solver).to_json()


def test_work_is_the_area_under_the_curve_from_first_touch() -> None:
    """A triangle of 100 N over 2 mm up to half-way, and the same with points before the touch."""
    assert work_until([0.0, 2.0], [0.0, 100.0], 2.0) == pytest.approx(100.0)
    assert work_until([-0.5, 0.0, 2.0], [0.0, 0.0, 100.0], 1.0) == pytest.approx(25.0)
    told = curve_responses({"peak_travel": 1.0, "curve": {"travel": [0.0, 2.0], "force": [0.0, 100.0]}}, 8.0)
    assert told == pytest.approx({"travel": 1.0, "work": 25.0})
    assert curve_responses({"stroke_was_enough": True}, 8.0) == {}


def test_travel_tells_what_the_force_leaves_free(tmp_path: Path) -> None:
    """F = 104, travel = 1.06: yield 16 MPa, failure strain 0.036."""
    stage = solved(study_of(tmp_path, EIGHT, "invert: {responses: [force, travel]}\n"), tmp_path)
    assert list(stage["solution"].values()) == pytest.approx([16.0, 0.036], rel=1e-4)
    assert stage["certainty"]["free"] == [] and stage["certainty"]["source"] == "joint"
    low, high = stage["certainty"]["intervals"]["failure_strain"]
    assert (high - low) / 2 == pytest.approx(3.182 * 0.02 / 2 / 0.2 * 0.02, rel=0.02)  # t₃·sd/√n over the slope
    low, high = stage["certainty"]["intervals"]["yield_stress"]
    assert (high - low) / 2 == pytest.approx(3.182 * 2.0 / 2 / 20.0 * 5.0, rel=0.02)
    (row,) = stage["joint"]["further"]
    assert row["unit"] == "mm" and row["predicted"] == pytest.approx(1.06, rel=1e-4)


def test_all_responses_over_two_diameters(tmp_path: Path) -> None:
    study = study_of(tmp_path, f"{EIGHT}\n{TEN}", "invert: {diameters: all, responses: all}\n")
    stage = solved(study, tmp_path)
    assert list(stage["solution"].values()) == pytest.approx([16.0, 0.036], rel=1e-3)
    found = [(row["condition"], row["response"]) for row in stage["joint"]["further"]]
    assert found == [(8.0, "travel"), (8.0, "work"), (10.0, "travel")]
    assert len(stage["joint"]["rows"]) == 2 and stage["joint"]["scatter"] == "pooled"
    assert stage["joint"]["max_abs_left_out_error_percent"] < 0.5


@dataclass(frozen=True)
class OfItsOwn(Telling):
    """The same three numbers as responses that the study declares."""

    def solve(self, request: Request) -> Answer:
        answer = super().solve(request)
        travel = answer.details["peak_travel"]
        others = {"dent": travel, "work": 0.5 * travel * (answer.response or 0.0)}
        return Answer("ok", response=answer.response, details={RESPONSES: others})


def test_means_of_one_cut_are_left_out_in_turn_but_not_those_of_an_own_response(tmp_path: Path) -> None:
    """Without the force, travel and work still give F = 55.12/(0.5·1.06) = 104 N; own responses are never left out."""
    cut = solved(study_of(tmp_path, EIGHT, "invert: {responses: all}\n"), tmp_path)
    (row,) = cut["joint"]["rows"]
    assert row["left_out_error_percent"] == pytest.approx(0.0, abs=0.2)
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "mine.py").write_text("class Mine: pass\n", encoding="utf-8")
    own = EIGHT.replace("diameter: 8 mm", "size: 8").replace("travel", "dent").replace("force", "pull")
    declared = (
        "responses: [{name: pull, unit: N}, {name: dent, unit: mm}, {name: work, unit: mJ}]\n"
        "conditions: [{name: size, unit: mm}]\nsolver: {kind: python, file: mine.py, class: Mine}\n"
        "invert: {responses: all}\n"
    )
    found = solved(study_of(tmp_path / "own", own, declared), tmp_path / "own", OfItsOwn())
    assert list(found["solution"].values()) == pytest.approx([16.0, 0.036], rel=1e-3)
    assert [each["left_out_error_percent"] for each in found["joint"]["rows"]] == [None] * 3


def test_a_worse_measured_response_counts_less(tmp_path: Path) -> None:
    """Travel and work contradict each other; the one of smaller scatter has its way."""
    sharp = EIGHT.replace("work: 55.12 mJ", "work: 70 mJ").replace("work: 2 mJ", "work: 100 mJ")
    stage = solved(study_of(tmp_path, sharp, "invert: {responses: all}\n"), tmp_path)
    assert stage["solution"]["failure_strain"] == pytest.approx(0.036, rel=0.01)
    other = EIGHT.replace("work: 55.12 mJ", "work: 60 mJ")
    other = other.replace("travel: 0.02 mm, work: 2 mJ", "travel: 2 mm, work: 0.1 mJ")
    (tmp_path / "other").mkdir()
    stage = solved(study_of(tmp_path / "other", other, "invert: {responses: all}\n"), tmp_path / "other")
    work = next(row for row in stage["joint"]["further"] if row["response"] == "work")
    assert abs(work["error_percent"]) < 0.5


def test_other_responses_make_the_surface_stale(tmp_path: Path) -> None:
    solved(study_of(tmp_path, EIGHT, "invert: {responses: [force, travel]}\n"), tmp_path)
    changed = study_of(tmp_path, EIGHT, "invert: {responses: all}\n")
    with pytest.raises(UsageError, match="responses changed"):
        workflow.run_stage("invert", changed, StudyFolder(tmp_path / "out"), solver=Telling())


def test_a_solver_that_tells_no_travel_is_named(tmp_path: Path) -> None:
    study = study_of(tmp_path, EIGHT, "invert: {responses: all}\n")
    with pytest.raises(RunsFailed, match="run 1 at a diameter of 8 mm contains no travel"):
        solved(study, tmp_path, Telling(silent=True))


def test_validation_compares_what_was_measured(tmp_path: Path) -> None:
    study = study_of(tmp_path, f"{EIGHT}\n{TEN}", "invert: {diameters: all, responses: all}\n")
    solved(study, tmp_path)
    stage = workflow.run_stage(
        "validate", study, StudyFolder(tmp_path / "out"), InlineExecutor(), solver=Telling()
    ).to_json()
    eight, ten = (row["further"] for row in stage["rows"])
    assert [entry["response"] for entry in eight] == ["travel", "work"]
    assert eight[0]["simulated"] == pytest.approx(1.06, rel=1e-3)
    assert [entry["error_percent"] for entry in ten] == pytest.approx([0.0], abs=0.2)


def test_the_embedded_solver_finds_its_own_parameters(tmp_path: Path) -> None:
    """Force, travel and work of one simulation at 16 MPa, 0.11 taken as measured, with 2 % scatter.

    The force alone leaves the failure strain free over nine tenths of its range; together they come within 1 % and 6 %.
    A sharp edge and failure element by element: it is the statistics that are tried.
    """
    text = (CONFIGS / "smoke.yaml").read_text(encoding="utf-8").split("targets:")[0]
    for new, old in (("edge_spread: d/5", "edge_spread: 0 mm"), ("internal_length: d/5", "internal_length: 0 mm")):
        text = text.replace(new, old)
    local = "element_size: 1.5 mm, coarsening: 1, coarsening_around: 1, edge_over: elements, mass_scaling: 1e5"
    solver = f"solver: {{kind: embedded, {local}, hourglass: 0.037, time_step: null, outputs: 200}}\n"
    text = text.split("solver:")[0] + solver
    text = text.replace("low: 0.01, high: 0.05", "low: 0.05, high: 0.15").replace("duration: 0.8 s", "duration: 1.2 s")
    text += "rsm: {factors: [yield_stress, failure_strain], centre_points: 1}\n"
    path = tmp_path / "own.yaml"
    one = "targets: [{diameter: 8 mm, force: 150 N}]\n"
    path.write_text(text + one, encoding="utf-8")
    study = load_study(path)
    truth = {**study.midlevels(), "yield_stress": 16.0, "failure_strain": 0.11}
    answer = Embedded(study).solve(Request("rsm", 0, truth, 8.0))
    means = {"force": (answer.response or 0.0, "N")}
    means |= {
        name: (curve_responses(answer.details, 8.0)[name], unit) for name, unit in (("travel", "mm"), ("work", "mJ"))
    }
    given = ", ".join(f"{name}: {value:.6f} {unit}" for name, (value, unit) in means.items())
    sd = ", ".join(f"{name}: {0.02 * value:.6f} {unit}" for name, (value, unit) in means.items())
    both = f"targets: [{{diameter: 8 mm, n: 6, {given}, sd: {{{sd}}}}}]\n"
    path.write_text(f"{text}{both}invert: {{responses: all}}\n", encoding="utf-8")
    study, folder = load_study(path), StudyFolder(tmp_path / "out")
    workflow.run_stage("rsm", study, folder, InlineExecutor())
    stage = workflow.run_stage("invert", study, folder).to_json()
    assert stage["solution"]["yield_stress"] == pytest.approx(16.0, rel=0.01)
    assert stage["solution"]["failure_strain"] == pytest.approx(0.11, rel=0.06)
    assert stage["certainty"]["free"] == []
    low, high = stage["certainty"]["intervals"]["failure_strain"]
    assert low < 0.11 < high and high - low < 0.035


def test_a_travel_beyond_the_stroke_is_doubted(tmp_path: Path) -> None:
    """100 mm/min for 0.5 s is 0.833 mm: no simulated force can peak at 1.06 mm."""
    study = study_of(tmp_path, EIGHT, "invert: {responses: all}\n")
    assert any("1.06 mm exceeds the simulated blade travel of 0.832 mm" in warning for warning in study.warnings)
    longer = study_of(tmp_path, EIGHT, "loading: {duration: 1 s}\ninvert: {responses: all}\n")
    assert not any("travels" in warning for warning in longer.warnings)
