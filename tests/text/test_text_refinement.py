"""What the refinement reports, in the study's own model and in another."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stemcal.files.rows import Rows
from stemcal.naming import Named, Naming
from stemcal.notes import Weight
from stemcal.report.tables.of_refinement import refine_tables
from stemcal.runs.outcome import Outcome
from stemcal.stages.refine.result import (
    AdjustedFactor,
    BeyondRange,
    FailedThere,
    FirstOutside,
    Model,
    NotReached,
    NotRunThere,
    RefineResult,
    RefineRow,
    RefineRun,
    StillRose,
    Stopped,
)
from stemcal.stages.result import Head
from stemcal.text import refinement
from stemcal.text.names import Names, program
from stemcal.text.notes import sentence

STEM = Names()
HEAP = Names(Naming(None, (Named("angle", "Angle of repose", "θ", "deg"),)))
RUN = RefineRun(
    run=1, how="solution", condition=8.0, levels={"strain": 0.035}, predicted=158.5, outcome=Outcome(response=66.7)
)
THERE = RefineResult(
    head=Head(2, "refine", "known"),
    elsewhere=True,
    model=Model("openradioss"),
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
    made=Rows([RUN, replace(RUN, run=2, how="path", levels={"strain": 0.26}, outcome=Outcome(response=159.1))]),
)
HERE = replace(THERE, elsewhere=False, model=Model("embedded"), adjusted=Rows(), error_percent=-0.13)


def test_the_outcome_there() -> None:
    assert refinement.outcome(THERE, STEM) == [
        "For OpenRadioss: strain 0.2600. It gives 159.1 N, with the calibrated values 66.7 N; the target is 159.2 N."
    ]
    same = replace(THERE, adjusted=Rows([replace(THERE.adjusted[0], value=0.035)]))
    assert refinement.outcome(same, STEM) == [
        "In OpenRadioss the calibrated parameters give 159.1 N; the target is 159.2 N."
    ]
    assert refinement.certainty(THERE, STEM) == ["In OpenRadioss the largest error is 0.1 % (8 mm)."]
    assert refinement.certainty(HERE, STEM) == [] == refinement.remarks(THERE, STEM)


def test_the_outcome_here_counts_the_runs() -> None:
    assert refinement.outcome(HERE, STEM) == [
        "2 runs corrected the solution: the error is 0.13 %, within the tolerance of 2 %."
    ]
    first = replace(HERE, made=Rows(HERE.made[:1]), converged=False, error_percent=6.2)
    assert refinement.outcome(first, STEM) == [
        "1 run at the solution: the error is 6.20 %, not within the tolerance of 2 %."
    ]
    assert refinement.shortfall(first) == "refine: 6.20 % from the target after 1 run"
    (found,) = refinement.remarks(HERE, STEM)
    assert found.kind == "found_by_simulation" and found.weight is Weight.ASIDE


def test_the_tables_state_what_they_refer_to() -> None:
    parameters, responses, runs = refine_tables(THERE, STEM)
    assert parameters.title == "Parameters for OpenRadioss" and len(parameters.foot) == 1
    known = replace(THERE, adjusted=Rows([replace(THERE.adjusted[0], interval=(0.2, 0.3))]))
    assert refine_tables(known, STEM)[0].foot[1].startswith("95 % range: by the scatter")
    assert responses.foot == (
        "The best point is within 2 %, after 2 of 8 runs.",
        "Error = 100·(measured − after)/measured.",
    )
    assert [row[1] for row in runs.cells] == ["solution", "path"]
    after_a_joint_fit = refine_tables(replace(THERE, aim=150.0, converged=False), STEM)[1].foot
    assert after_a_joint_fit[:2] == (
        "The best point is not within 2 %, after 2 of 8 runs.",
        "After a joint fit the target is what the study's own model gives: 150 N.",
    )
    assert len(refine_tables(HERE, STEM)) == 2


def test_programs_by_their_names() -> None:
    names = [program(kind) for kind in ("embedded", "lsdyna", "openradioss", "command", "manual")]
    assert names == ["the other model", "LS-DYNA", "OpenRadioss", "the other program", "the other program"]


def test_notes() -> None:
    assert sentence(BeyondRange("strain", 0.2622, 0.01, 0.05), STEM) == (
        "strain 0.2622 is outside the study's range (0.01 to 0.05); that range is for the study's own model."
    )
    assert sentence(NotRunThere((10.0, 11.0), True), STEM) == (
        "refine.budget left no run of the result at 10 and 11 mm."
    )
    assert sentence(NotRunThere((10.0,), False), STEM).startswith("The result was not run at 10 mm, because")
    assert sentence(FailedThere((11.0,), "timeout"), STEM) == "Runs with the result failed at 11 mm (timeout)."
    assert sentence(FailedThere((0.0,), "timeout"), HEAP) == "The run with the result failed (timeout)."
    assert sentence(StillRose(1), STEM).startswith("In 1 run the maximum force still rose at the end of the stroke")
    assert sentence(StillRose(3), HEAP).startswith("In 3 runs the angle of repose still rose")
    assert "outside its prediction interval (8 mm): the surface" in sentence(FirstOutside((8.0,)), STEM)
    assert "outside its prediction interval: the surface" in sentence(FirstOutside((0.0,)), HEAP)


@pytest.mark.parametrize(
    ("stopped", "factors", "words"),
    [
        (
            "budget",
            (),
            "The maximum force is still 36.70 % from the target; the best point is kept. Raise",
        ),
        ("settled", (), "The error is 36.70 %, and no parameters nearby reduce it."),
        ("budget", ("strain",), "Raise refine.budget, or give strain a wider range under refine.adjust."),
        ("out_of_reach", ("strain", "stress"), "from the target at the end of the range of strain and stress. Give"),
        ("settled", ("strain",), "no step is left between the runs: it jumps, or does not depend on strain."),
    ],
)
def test_where_it_ended(stopped: Stopped, factors: tuple[str, ...], words: str) -> None:
    assert words in sentence(NotReached(stopped, 36.7, factors), STEM)
