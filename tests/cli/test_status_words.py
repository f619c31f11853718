"""What `status`, the page and the terminal say of stages, runs and the study's question."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from fakes import make_study

from stemcal.cli.show import failed_runs
from stemcal.cli.status import state as lines
from stemcal.folder import Holder
from stemcal.naming import Names
from stemcal.overview.status import StageStatus, Status
from stemcal.report.page.headline import failures, folded, kind_of, question
from stemcal.report.tables.setting import setting_tables
from stemcal.runs.record import Outcome
from stemcal.stages.verdict.result import Verdict

NAMES = Names()
FAILED = Outcome(response=None, status="failed", reason="inverted", message="element 17 turned inside out")
RIGHT = Outcome(response=100.0, status="ok")


def state(working: Holder | None = None, **facts: Any) -> list[str]:
    empty = StageStatus("screen", 12, 12, 0, 0, {}, 0, 0, 0, "fresh", ())
    stage = StageStatus(**{**vars(empty), **facts})
    return lines(Status(2, "status", "known", "out", working, (stage,), Verdict.of([], None)), NAMES)


def stage_of(*outcomes: Outcome) -> Any:
    return SimpleNamespace(name="screen", runs=lambda: [(f"screen {i}", one) for i, one in enumerate(outcomes, 1)])


def test_a_quiet_study_says_its_verdict_alone() -> None:
    assert state() == ["No process is working on this study.", "Calibrated."]


def test_what_is_wrong_with_a_stage() -> None:
    said = state(reasons={"inverted": 2, "timeout": 1}, censored=1, damaged=2, changed=("rsm", "solver version"))
    assert said[1:-1] == [
        "screen: failed: inverted (2), timeout (1); `stemcal status SPEC --failed` lists the failed runs.",
        "screen: 1 response may be too low: the stroke ended before the maximum was clearly passed.",
        "screen: 2 damaged records; the next command repeats the run.",
        "screen.json is stale: rsm, solver version changed since.",
    ]


def test_failed_runs_are_counted_with_their_reasons() -> None:
    assert failed_runs(stage_of(RIGHT, RIGHT)) == ""
    assert failed_runs(stage_of(RIGHT, FAILED, FAILED)) == ("screen: 2 of 3 runs failed: inverted (2); see screen.json")
    assert failures([stage_of(RIGHT, FAILED)]) == ["Screening, run 2 failed: element 17 turned inside out"]


def test_the_question_of_a_stem_study(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    assert kind_of(study) == "Calibration of a stem cutting model"
    assert question(study) == (
        "Which parameters reproduce the measured maximum cutting force of a stem of 8 mm diameter (110 N)? Are "
        "they valid at 2 other values of the stem diameter?"
    )


def test_what_is_folded() -> None:
    assert folded(["analysis of variance"], 1, 3) == "analysis of variance, 1 figure and 3 notes"
    assert folded([], 0, 0) == ""


def test_a_joint_fit_asks_for_all_that_it_fits(tmp_path: Path) -> None:
    whole = make_study(tmp_path, "invert: {diameters: all}\n")
    at = [target.condition for target in whole.joint_targets]
    assert question(whole) == (
        f"Which parameters reproduce the measured maximum cutting forces of stems of {NAMES.conditions(at)} diameter?"
    )
    measured = setting_tables(whole)[1]
    assert measured.foot == ("The parameters are fitted to all measurements together.",) and not measured.strong
    some = make_study(tmp_path, f"invert: {{diameters: [{at[0]:g} mm, {at[1]:g} mm]}}\n")
    assert question(some).endswith("Are they valid at 1 other value of the stem diameter?")
    measured = setting_tables(some)[1]
    assert measured.foot == (f"Bold: fitted values ({NAMES.conditions(at[:2])}).",)
    assert measured.strong == {0, 1}
