"""What the refinement reports, in the study's own model and in another."""

from dataclasses import replace
from pathlib import Path

import pytest
from fakes import make_study

from stemcal.runs.record import Outcome
from stemcal.solvers.protocol import Request
from stemcal.stages.refine.analysis import _range, later, refine_notes
from stemcal.stages.refine.options import RefineOptions
from stemcal.stages.refine.result import AdjustedFactor, RefineResult, RefineRow, RefineRun, SimulatedBy, Stopped
from stemcal.stages.refine.showing import RefineShowing
from stemcal.stages.result import Head
from stemcal.storage.rows import Rows
from stemcal.vocabulary import Wording, program

STEM = Wording()
tables = RefineShowing().tables
RUN = RefineRun(
    run=1, how="solution", condition=8.0, levels={"strain": 0.035}, predicted=158.5, outcome=Outcome(response=66.7)
)
THERE = RefineResult(
    head=Head(2, "refine", "known"),
    elsewhere=True,
    model=SimulatedBy("openradioss"),
    condition=8.0,
    aim=159.2,
    tolerance_percent=2.0,
    budget=8,
    converged=True,
    stopped="tolerance",
    error_percent=0.06,
    parameters={"strain": 0.26},
    adjusted=Rows([AdjustedFactor("strain", 0.035, 0.26, None, 0.001, 1.0)]),
    rows=Rows([RefineRow(8.0, "force", 159.2, 66.7, 159.1, 0.06)]),
    max_abs_error_percent=0.06,
    trial_runs=Rows([RUN, replace(RUN, run=2, how="path", levels={"strain": 0.26}, outcome=Outcome(response=159.1))]),
)
HERE = replace(THERE, elsewhere=False, model=SimulatedBy("embedded"), adjusted=Rows(), error_percent=-0.13)


def test_the_tables_state_what_they_refer_to() -> None:
    parameters, responses, runs = tables(THERE, STEM)
    assert parameters.title == "Parameters for OpenRadioss" and len(parameters.foot) == 1
    known = replace(THERE, adjusted=Rows([replace(THERE.adjusted[0], interval=(0.2, 0.3))]))
    assert tables(known, STEM)[0].foot[1].startswith("95 % confidence interval: computed from the standard error")
    assert responses.foot == (
        "The error relative to the target is below 2 % after 2 of at most 8 runs.",
        "Error in % = 100·(measured − refined)/measured.",
    )
    assert [row[1] for row in runs.cells] == ["solution", "path"]
    after_a_joint_fit = tables(replace(THERE, aim=150.0, converged=False), STEM)[1].foot
    assert after_a_joint_fit[:2] == (
        "The error relative to the target is above 2 % after 2 of at most 8 runs.",
        "After a joint fit, the target is the value predicted by the study (150 N).",
    )
    assert len(tables(HERE, STEM)) == 2


def test_programs_by_their_names() -> None:
    names = [program(kind) for kind in ("embedded", "lsdyna", "openradioss", "command", "manual")]
    assert names == ["the other model", "LS-DYNA", "OpenRadioss", "the other program", "the other program"]


def kinds(result: RefineResult) -> dict[str, str]:
    return {note.kind: str(note) for note in refine_notes(result)}


def test_notes() -> None:
    assert kinds(HERE) == {}
    elsewhere = replace(
        THERE, rows=Rows([*THERE.rows, *(RefineRow(d, "force", 200.0, None, None, None) for d in (10, 11))])
    )
    assert "10 and 11 mm" in kinds(elsewhere)["not_run_there"]
    assert "not reached" in kinds(replace(elsewhere, converged=False))["not_run_there"]
    censored = [replace(run, outcome=replace(run.outcome, censored=True)) for run in THERE.trial_runs]
    rose = replace(THERE, trial_runs=Rows(censored))
    assert "In 2 runs" in kinds(rose)["still_rose"]
    outside = replace(HERE, trial_runs=Rows([replace(RUN, prediction_interval=(150.0, 160.0))]))
    assert "at a diameter of 8 mm" in kinds(outside)["first_outside"]


@pytest.mark.parametrize("stopped", ["budget", "settled", "out_of_reach"])
def test_where_it_ended(stopped: Stopped) -> None:
    far = {"stopped": stopped, "converged": False, "error_percent": 36.7}
    there = kinds(replace(THERE, **far))["not_reached"]
    assert "36.7" in there and "strain" in there
    if stopped != "out_of_reach":
        assert "36.70 %" in kinds(replace(HERE, **far))["not_reached"]


@pytest.mark.parametrize(
    ("extra", "rounds", "conditions", "most"),
    [
        ("refine: {}\n", 2, [8.0], 10),
        ("refine: {budget: 1}\n", 1, [8.0], 1),
        ("refine: {}\ninvert: {diameters: all}\n", 2, [7.0, 8.0, 10.0], 10),
        # without a surface a run more a factor is usual, at most one a condition; 9 + 5 runs at each condition
        ("refine: {}\nscreen: {design: none}\nrsm: {design: none}\n", 3, [8.0], 14),
        (
            "refine: {}\nscreen: {design: none}\nrsm: {design: none}\ninvert: {diameters: all}\n",
            5,
            [7.0, 8.0, 10.0],
            42,
        ),
    ],
)
def test_the_usual_rounds_and_the_most_runs(
    tmp_path: Path, extra: str, rounds: int, conditions: list[float], most: int
) -> None:
    study = make_study(tmp_path, extra)
    found = later(study)
    assert found is not None
    round_ = [Request("refine", 0, study.midlevels(), condition, pictured=True) for condition in conditions]
    assert found.rounds == [round_] * rounds
    assert f"at most {most} additional run" in found.note.text and found.note.kind == "decided_later"


def test_a_study_that_refines_nothing_has_no_rounds(tmp_path: Path) -> None:
    assert later(make_study(tmp_path)) is None


def test_the_failure_strain_moves_further_on_another_mesh(tmp_path: Path) -> None:
    """From a tenth of its lower end, 0.01, up to 1; a factor with limits keeps them, any other its range."""
    study, free = make_study(tmp_path), RefineOptions()
    limited = RefineOptions(adjust={"failure_strain": (0.02, 0.2)})
    assert _range(study, free, "failure_strain", same_mesh=False) == pytest.approx((0.001, 1.0))
    assert _range(study, free, "failure_strain", same_mesh=True) == (0.01, 0.05)
    assert _range(study, free, "yield_stress", same_mesh=False) == (10.0, 20.0)
    assert _range(study, limited, "failure_strain", same_mesh=False) == (0.02, 0.2)
