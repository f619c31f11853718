"""The designs and fits that a spec can choose, through the stages."""

from pathlib import Path

import numpy as np
import pytest
import workflow
from fakes import FakeSolver, lines, make_study

from stemcal.doe.coding import Coding
from stemcal.errors import SpecError, UsageError
from stemcal.overview.plan import design_notes, plan
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import Outcome
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.design import Design
from stemcal.stages.result import DesignRun, DesignRuns
from stemcal.stages.rsm.analysis import _pure_error_of, study_design
from stemcal.stages.screen.analysis import screening_design
from stemcal.storage.rows import Rows
from stemcal.storage.typed import to_json
from stemcal.vocabulary import Wording

THREE = "rsm: {{factors: [yield_stress, failure_strain, strain_rate_c], {}}}\n"


@pytest.mark.parametrize(
    ("options", "kind", "runs"),
    [
        ("", "plackett-burman", 12),
        ("runs: 20", "plackett-burman", 20),
        ("fold_over: true", "plackett-burman, folded over", 24),
        ("design: fractional-factorial", "fractional-factorial", 32),
        ("design: fractional-factorial, runs: 16", "fractional-factorial", 16),
    ],
)
def test_screening_designs_by_name(tmp_path: Path, options: str, kind: str, runs: int) -> None:
    design = screening_design(make_study(tmp_path, f"screen: {{{options}}}\n"), FakeSolver())
    assert (design.kind, len(design.coded)) == (kind, runs)
    assert {level["density"] for level in design.levels} <= {1000.0, 1100.0, 1200.0}


@pytest.mark.parametrize(
    ("options", "runs", "reach", "radius"),
    [
        ("design: box-behnken, centre_points: 3", 15, 1.0, 2**0.5),
        ("design: latin-hypercube, runs: 25", 25, 1.0, 3**0.5),
        ("alpha: 1.732050808", 20, 3**0.5, 3**0.5),
        ("extra_runs: 4", 24, 8**0.25, 8**0.25),
    ],
)
def test_surface_designs_by_name(tmp_path: Path, options: str, runs: int, reach: float, radius: float) -> None:
    study = make_study(tmp_path, THREE.format(options))
    design = study_design(study, FakeSolver(), study.rsm.factors)
    assert design.coded.shape == (runs, 3)
    levels = np.array([[row["yield_stress"], row["failure_strain"]] for row in design.levels])
    assert np.all(levels >= np.array([10.0, 0.01]) - 1e-12)
    assert np.all(levels <= np.array([20.0, 0.05]) + 1e-12)
    assert design.coding.half_step[0] == pytest.approx(5.0 / reach, rel=1e-4)
    assert study.rsm.radius(3) == pytest.approx(radius, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "rsm: {factors: [density, yield_stress], design: box-behnken}\n",
            "the `box-behnken` design requires 3 to 7 factors, not 2",
        ),
        (
            THREE.format("design: latin-hypercube, runs: 9"),
            "9 runs cannot determine the 10 coefficients of a response surface in 3 factors; write 20",
        ),
        (
            THREE.format("runs: 30"),
            "the number of runs of the `central-composite` design is determined",
        ),
        ("screen: {design: taguchi}\n", "screen.design"),
        ("screen: {fold_over: 1}\n", "screen.fold_over"),
    ],
)
def test_choices_without_sense_are_found_by_check(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        make_study(tmp_path, text)


def test_a_size_that_does_not_exist_is_refused_with_the_next_one(tmp_path: Path) -> None:
    study = make_study(tmp_path, "screen: {runs: 10}\n")
    with pytest.raises(UsageError, match="has 10 runs for 9 factors; use 12, 20, 24"):
        screening_design(study, FakeSolver())


def test_a_fold_over_computes_only_the_new_runs(tmp_path: Path) -> None:
    witness, folder = tmp_path / "witness", StudyFolder(tmp_path / "out")
    solver = FakeSolver(witness)
    workflow.run_stage("screen", make_study(tmp_path), folder, InlineExecutor(), solver=solver)
    before = len(lines(witness))
    stage = workflow.run_stage(
        "screen", make_study(tmp_path, "screen: {fold_over: true}\n"), folder, InlineExecutor(), solver=solver
    ).to_json()
    assert (before, len(lines(witness))) == (12, 24)
    (clear,) = (note for note in stage["notes"] if note["kind"] == "clear_of_interactions")
    assert "24 runs" in clear["text"]
    assert "yield_stress" in stage["significant"] and stage["residual"]["df"] == 14


def test_extra_runs_compute_only_themselves(tmp_path: Path) -> None:
    witness, folder = tmp_path / "witness", StudyFolder(tmp_path / "out")
    solver = FakeSolver(witness)
    workflow.run_stage(
        "rsm", make_study(tmp_path, THREE.format("centre_points: 1")), folder, InlineExecutor(), solver=solver
    )
    assert len(lines(witness)) == 15
    for extra in (3, 7):
        more = make_study(tmp_path, THREE.format(f"centre_points: 1, extra_runs: {extra}"))
        workflow.run_stage("rsm", more, folder, InlineExecutor(), solver=solver)
        assert len(lines(witness)) == len(folder.keys()) == 15 + extra


def test_a_reduced_surface_goes_on_to_the_solution(tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "out")
    study = make_study(tmp_path, THREE.format("reduce: backward"))
    stage = workflow.run_stage("rsm", study, folder, InlineExecutor(), solver=FakeSolver()).to_json()
    terms = {row["term"] for row in stage["coefficients"]}
    assert {"1", "yield_stress", "failure_strain", "failure_strain^2"} <= terms
    assert stage["reduction"] == []  # the response is exactly quadratic
    found = workflow.run_stage("invert", study, folder, solver=FakeSolver()).to_json()
    assert found["predicted"] == pytest.approx(110.0, abs=1e-6)
    a = (found["solution"]["yield_stress"] - 15.0) / 5.0
    b = (found["solution"]["failure_strain"] - 0.03) / 0.02
    c = (found["solution"]["strain_rate_c"] - 90.0) / 10.0
    assert 100.0 + 20.0 * a + 8.0 * b + 3.0 * b * b + 0.5 * a * b + 0.1 * c == pytest.approx(110.0, abs=1e-3)


def test_the_surface_stage_tells_its_shape(tmp_path: Path) -> None:
    study = make_study(tmp_path, THREE.format("centre_points: 2"))
    stage = workflow.run_stage(
        "rsm", study, StudyFolder(tmp_path / "out"), InlineExecutor(), solver=FakeSolver()
    ).to_json()
    assert stage["canonical"]["eigenvalues"][0] > 0.0


def test_plan_shows_aliases_and_terms_without_an_estimate(tmp_path: Path) -> None:
    planned = to_json(plan(make_study(tmp_path), None, FakeSolver()))
    assert any(note["kind"] == "partly_aliased" for note in planned["notes"])
    axes = np.vstack([np.zeros((1, 2)), np.eye(2), -np.eye(2)])
    coding = Coding(("a", "b"), (0.0, 0.0), (1.0, 1.0))
    (found,) = design_notes(Design("rsm", "given", coding, axes, ({},) * 5))
    assert found.kind == "cannot_estimate" and "5 runs" in found.text and "a:b" in found.text


def repeated(*groups: tuple[float | None, ...]) -> DesignRuns:
    """Return the runs of points with these responses."""
    runs = [(float(point), value) for point, values in enumerate(groups) for value in values]
    rows = [
        DesignRun(run=n, levels={"a": x}, coded={"a": x}, outcome=Outcome(response=value))
        for n, (x, value) in enumerate(runs, 1)
    ]
    return DesignRuns("known", Rows(rows))


@pytest.mark.parametrize(
    ("groups", "equal"),
    [
        (((1.0,), (2.0,)), None),
        (((1.0, 1.0), (2.0, 2.0)), True),
        (((1.0, 1.0), (2.0, 2.1)), False),
        (((1.0, None), (2.0, 2.0 + 1e-10)), True),
        (((1.0, None), (2.0,)), None),
    ],
)
def test_only_runs_that_all_agree_have_no_pure_error(
    groups: tuple[tuple[float | None, ...], ...], equal: bool | None
) -> None:
    note = _pure_error_of(repeated(*groups), Wording(), replicated=False)
    assert (None if note is None else note.kind == "equal_repeats") == equal
