"""A sheet in place of a solver: what it answers, what it asks for, and what is said of a wrong one."""

from pathlib import Path

import pytest
import workflow
from fakes import make_study

from stemcal.by_hand.solver import Sheet
from stemcal.errors import UsageError, Waiting
from stemcal.overview.plan import plan
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Request
from stemcal.study.reading import load_study

RSM = "run,yield_stress,failure_strain,force\nrsm 1,15,0.03,122\nrsm 2,15,0.03,112\nrsm 3,20,0.03,\n"


def sheet(folder: Path, text: str | bytes) -> Sheet:
    (folder / "runs.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    return Sheet.of(make_study(folder, "solver: {kind: sheet, file: runs.csv}\n"))


def request(solver: Sheet, row: int, diameter: float = 8.0, **levels: float) -> Request:
    return Request(
        "rsm", row, {**solver.study.midlevels(), "yield_stress": 15.0, "failure_strain": 0.03, **levels}, diameter
    )


def test_rows_forces_and_what_is_pending(tmp_path: Path) -> None:
    solver = sheet(tmp_path, RSM)
    assert solver.given_design("screen") is None
    rows = solver.given_design("rsm")
    assert rows is not None and rows[0] == {"yield_stress": 15.0, "failure_strain": 0.03}
    asked = [request(solver, row, **levels) for row, levels in enumerate(rows)]
    assert [solver.has_result(one) for one in asked] == [True, True, False]
    assert [solver.solve(one).response for one in asked[:2]] == [122.0, 112.0]
    with pytest.raises(Waiting, match="1 result from the rsm stage"):
        solver.solve(asked[2])


def test_a_row_of_other_levels_answers_nothing(tmp_path: Path) -> None:
    solver = sheet(tmp_path, RSM)
    assert not solver.has_result(request(solver, 7)) and not solver.has_result(request(solver, 0, yield_stress=16.0))


def test_equal_rows_are_runs_of_their_own_and_a_changed_cell_stales_its_own_run(tmp_path: Path) -> None:
    before, after = sheet(tmp_path, RSM), sheet(tmp_path, RSM.replace("122", "123"))
    keys = [[one.identity(request(one, row)) for row in range(2)] for one in (before, after)]
    assert keys[0][0] != keys[0][1] == keys[1][1] and keys[0][0] != keys[1][0]
    assert before.table_of("rsm") != after.table_of("rsm") and before.table_of("screen") == []


def test_a_run_that_failed_says_why(tmp_path: Path) -> None:
    solver = sheet(tmp_path, RSM.replace(",112", ",failed: the mesh tangled"))
    answer = solver.solve(request(solver, 1))
    assert (answer.ok, answer.reason, answer.message) == (False, "not_run", "the mesh tangled")


def test_a_design_at_several_diameters_is_one_design(tmp_path: Path) -> None:
    head = "run,yield_stress,failure_strain,diameter (mm),force\n"
    solver = sheet(tmp_path, head + "rsm 1,15,0.03,7,100\nrsm 1,15,0.03,8,122\n")
    assert len(solver.given_design("rsm") or []) == 1
    assert [solver.solve(request(solver, 0, diameter)).response for diameter in (7.0, 8.0)] == [100.0, 122.0]
    assert not solver.has_result(request(solver, 0, 9.0))


def test_known_runs_are_taken_and_the_others_asked_for(tmp_path: Path) -> None:
    solver, folder = sheet(tmp_path, RSM), StudyFolder(tmp_path / "out")
    study = make_study(
        tmp_path, "solver: {kind: sheet, file: runs.csv}\nrsm: {factors: [yield_stress, failure_strain]}\n"
    )
    (stage,) = (stage for stage in plan(study, None, solver, 1).stages if stage.stage == "rsm")
    assert (stage.rows, stage.to_run) == (3, 1)
    with pytest.raises(Waiting) as waiting:
        workflow.run_stage("rsm", study, folder, InlineExecutor())
    assert [run.row for run in waiting.value.requests] == [2]
    assert len(list(folder.keys())) == 2


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "gbk"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_encodings_and_separators(tmp_path: Path, encoding: str, separator: str) -> None:
    text = RSM.replace("run,", "run,\u8bf4\u660e,").replace("rsm 1", "rsm 1,a").replace("rsm 2", "rsm 2,b")
    text = text.replace("rsm 3", "rsm 3,c").replace("\n", "\r\n").replace(",", separator)
    solver = sheet(tmp_path, text.encode(encoding))
    assert solver.solve(request(solver, 0)).response == 122.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no row contains the `run` heading"),
        ("run,yield_stress\nrsm 1,15\n", "no column has the heading force"),
        ("run,force,force (N)\nrsm 1,1,2\n", "two columns have the heading 'force (N)'; delete one"),
        (RSM.replace(",122", ""), "runs.csv:2: the row has only 3 cells, but the header row has 4; complete the row"),
        (RSM.replace(",122", ",122,1"), "runs.csv:2: the row has 5 cells, but the header row has 4"),
        (RSM.rstrip("\n"), "runs.csv:4: the last line may be truncated"),
        (RSM.replace("15,0.03,122", "x,0.03,122"), "runs.csv:2: rsm 1, yield_stress: 'x' is not a number"),
        ("run,diameter,force\nvalidate 1,wide,100\n", "runs.csv:2: validate 1, diameter: 'wide' is not a number"),
        (RSM.replace("122", "two"), "runs.csv:2: rsm 1, force: 'two' is not a number"),
        (RSM.replace("122", "1e31"), "'1e31' exceeds 1e30"),
        (RSM.replace("122", "12 mm"), "'12 mm' is not a number; write a number without a unit"),
        (RSM.replace("122", "failed"), "rsm 1 is marked as failed without a reason"),
        (RSM.replace("rsm 2", "2"), "'2' is not a run; write a stage and a number"),
        (RSM.replace("rsm 2", "rsm 5"), "the rows of rsm are not numbered from 1 to 3"),
        (RSM.replace("20,0.03,", "20,,"), "some rows of rsm have no levels for failure_strain"),
        (RSM + "\0", "is not a text file"),
    ],
)
def test_wrong_sheets(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(UsageError) as error:
        sheet(tmp_path, text)
    assert said in str(error.value)


OWN = """\
name: heap
factors:
  - {name: static, low: 0.2, high: 0.8}
  - {name: rolling, low: 0.02, high: 0.12}
responses:
  - {name: angle, label: Angle of repose, unit: deg}
  - {name: density, label: Bulk density, unit: kg/m3}
conditions: [{name: moisture, unit: "%"}]
targets: [{moisture: 12, angle: 30, density: 650, sd: {angle: 1, density: 5}}]
solver: {kind: sheet, file: runs.csv}
"""


def test_responses_and_condition_of_the_study_s_own(tmp_path: Path) -> None:
    rows = "run,angle,static,density,rolling,moisture\nrsm 1,30,0.2,650,0.02,12\nvalidate 1,33,,640,,16\n"
    (tmp_path / "runs.csv").write_text(rows, encoding="utf-8")
    (tmp_path / "heap.yaml").write_text(OWN, encoding="utf-8")
    solver = Sheet.of(load_study(tmp_path / "heap.yaml"))
    first = solver.solve(Request("rsm", 0, {"static": 0.2, "rolling": 0.02}, 12.0))
    assert (first.response, first.details["responses"]) == (30.0, {"density": 650.0})
    assert solver.solve(Request("validate", 0, {"static": 0.4, "rolling": 0.05}, 16.0)).response == 33.0
    assert not solver.has_result(Request("validate", 0, {"static": 0.4, "rolling": 0.05}, 20.0))
    (tmp_path / "runs.csv").write_text(rows.replace("650", ""), encoding="utf-8")
    with pytest.raises(UsageError, match=r"runs\.csv:2: rsm 1 has no density"):
        Sheet.of(load_study(tmp_path / "heap.yaml"))


SLIPS = "run,yield_stress,failure_strain,force,remark\n" + "".join(
    f"rsm {n},{10 + n},0.03,{force},\n" for n, force in enumerate((118, 122, 125, 112, 1260, 119), 1)
)


@pytest.mark.parametrize(("value", "asked"), [("1260", True), ("-121", True), ("12.1", True), ("300", False)])
def test_a_value_of_the_file_far_from_the_others_is_questioned(tmp_path: Path, value: str, asked: bool) -> None:
    text = SLIPS.replace("1260", value)
    if not asked:
        assert sheet(tmp_path, text).solve(request(sheet(tmp_path, text), 4)).response == float(value)
        return
    with pytest.raises(
        UsageError, match=rf"rsm 5: is force = {value} N correct\? The other values are 110 N to"
    ) as found:
        sheet(tmp_path, text)
    assert "`confirmed`" in str(found.value) and "runs.csv" in str(found.value)
    confirmed = sheet(tmp_path, text.replace(f"{value},", f"{value},confirmed"))
    assert len(confirmed.table_of("rsm")) == 6
