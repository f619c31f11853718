"""What a transfer says: in a stem's words, in those of a program, and where it ended."""

from __future__ import annotations

from dataclasses import replace

from stemcal.doe.calibration.transfer import Learnt
from stemcal.files.rows import Rows
from stemcal.naming import Named, Naming
from stemcal.overview.plan import InAnotherProgram
from stemcal.report.tables.of_transfer import transfer_tables
from stemcal.runs.outcome import Outcome
from stemcal.stages.result import Head
from stemcal.stages.transfer.result import (
    AdjustedFactor,
    BeyondRange,
    FailedThere,
    NotReached,
    NotRunThere,
    StillRose,
    TargetSolver,
    TransferResult,
    TransferRow,
    TransferRun,
)
from stemcal.text import transfer
from stemcal.text.names import Names
from stemcal.text.notes import sentence
from stemcal.text.plan import sentences

STEM = Names()
HEAP = Names(Naming(None, (Named("angle", "Angle of repose", "θ", "deg"),)))
RUN = TransferRun(
    run=1, role="search", condition=8.0, levels={"strain": 0.26}, predicted=158.5, outcome=Outcome(response=159.1)
)
FOUND = TransferResult(
    head=Head(2, "transfer", "known"),
    solver=TargetSolver("openradioss"),
    condition=8.0,
    aim=159.2,
    tolerance_percent=2.0,
    budget=8,
    converged=True,
    stopped="tolerance",
    parameters={"strain": 0.26},
    adjusted=Rows([AdjustedFactor("strain", 0.035, 0.26, None, 0.001, 1.0, True)]),
    rows=Rows([TransferRow(8.0, 159.2, 158.5, 66.7, 159.1, 0.06, "calibration")]),
    max_abs_error_percent=0.06,
    learnt=Learnt(0.4, 1.75, 6.4, 4),
    asked=Rows([RUN, replace(RUN, run=2)]),
)


def test_what_became_of_the_parameters() -> None:
    assert transfer.outcome(FOUND, STEM) == [
        "For OpenRadioss: strain 0.2600. It gives 159.1 N, where 159.2 N is right; with the calibrated values 66.7 N."
    ]
    same = replace(FOUND, adjusted=Rows([replace(FOUND.adjusted[0], value=0.035)]))
    assert transfer.outcome(same, STEM) == [
        "In OpenRadioss the calibrated parameters give 159.1 N, where 159.2 N is right."
    ]
    assert transfer.certainty(FOUND, STEM) == ["In OpenRadioss the error at 8 mm is 0.1 %."]
    (learnt,) = transfer.remarks(FOUND, STEM)
    assert learnt.sentence == (
        "The maximum force there is 0.4 times that of the study's own solver with the calibrated values, and changes "
        "1.75 times as much, by ratio, as the surface has it; the runs lie about that line with 6.4 %."
    )


def test_a_table_says_what_it_refers_to() -> None:
    parameters, responses, _ = transfer_tables(FOUND, STEM)
    (kept,) = parameters.foot
    assert kept.startswith("What is not named stays as calibrated. The search ends at the first values")
    (one,) = FOUND.adjusted
    known = replace(FOUND, adjusted=Rows([replace(one, interval=(0.2, 0.3))]))
    assert transfer_tables(known, STEM)[0].foot[1].startswith("95 % range: by the scatter")
    assert responses.foot == (
        "Within 2 % after 2 of 8 runs: 0.06 % off the measured maximum force.",
        "Error = 100·(measured − there after)/measured.",
    )
    after_a_joint_fit = replace(FOUND, aim=150.0, converged=False)
    assert transfer_tables(after_a_joint_fit, STEM)[1].foot[0] == (
        "Not within 2 % after 2 of 8 runs: 6.07 % off what the study's own solver gives, which is the aim after a "
        "joint fit."
    )


def test_programs_by_their_names() -> None:
    names = [transfer.program(kind) for kind in ("embedded", "lsdyna", "openradioss", "command", "sheet")]
    assert names == ["the other model", "LS-DYNA", "OpenRadioss", "the other program", "the other program"]
    assert [transfer.role(role) for role in ("search", "after", "before")] == [
        "search",
        "result elsewhere",
        "start elsewhere",
    ]


def test_notes() -> None:
    assert sentence(BeyondRange("stress", 9.783, 10.0, 20.0, True), STEM) == (
        "stress 9.783 lies outside the study's range (10 to 20), as transfer.adjust allows."
    )
    assert sentence(BeyondRange("strain", 0.2622, 0.01, 0.05, False), STEM) == (
        "strain 0.2622 lies outside the study's range (0.01 to 0.05), which belongs to the study's mesh and lengths."
    )
    assert (
        sentence(NotRunThere((10.0, 11.0), True), STEM)
        == "transfer.budget left no run with the result at 10 and 11 mm."
    )
    assert sentence(NotRunThere((10.0,), False), STEM).startswith("Nothing was run there at 10 mm: first")
    assert sentence(FailedThere((11.0,), "timeout"), STEM) == "Runs there with the result failed at 11 mm (timeout)."
    assert sentence(FailedThere((0.0,), "timeout"), HEAP) == "The run there with the result failed (timeout)."
    assert sentence(StillRose(1), STEM).startswith("In 1 run there the maximum force still rose when the stroke ended")
    assert sentence(StillRose(3), HEAP).startswith("In 3 runs there the angle of repose still rose")


def test_where_it_ended() -> None:
    said = {
        stopped: sentence(NotReached(stopped, 36.7, 159.2, ("strain", "stress")), STEM)
        for stopped in ("budget", "out_of_reach", "settled")
    }
    assert said["budget"] == (
        "The maximum force there is still 36.7 % from 159.2 N: transfer.budget allows no further run. Raise it, or "
        "give strain and stress a wider range under transfer.adjust. The best point is kept."
    )
    assert (
        "is 36.7 % from 159.2 N at the end of the range of strain and stress. Give it a wider" in said["out_of_reach"]
    )
    assert "no step is left between the runs: it jumps there, or does not follow strain and stress" in said["settled"]


def test_the_plan_names_the_program() -> None:
    assert sentences([InAnotherProgram("embedded", 26, 6, 90.0)])[0].startswith(
        "26 runs here, at most 6 in the other model (transfer). Those take at most "
    )
    assert sentences([InAnotherProgram("openradioss", 26, 6)]) == ["26 runs here, at most 6 in OpenRadioss (transfer)."]
