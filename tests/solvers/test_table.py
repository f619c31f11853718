"""Tables in place of a solver: what they answer, and what is said of wrong ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from fakes import make_study

from stemcal.errors import SpecError, UsageError
from stemcal.solvers import make_solver
from stemcal.solvers.csv_table import read_sheet
from stemcal.solvers.protocol import Request
from stemcal.solvers.table import ReplaySolver
from stemcal.study.reading import load_study

KNOWN = {"a": "a", "X1": "a", "b": "b", "X2": "b"}


def solver(folder: Path, rsm: str = "", validate: str = "") -> ReplaySolver:
    parts = []
    for name, text in (("rsm", rsm), ("validate", validate)):
        if text:
            (folder / f"{name}.csv").write_text(text, encoding="utf-8")
            parts.append(f"{name}: {name}.csv")
    study = make_study(folder, f"solver: {{kind: table, {', '.join(parts)}}}\n")
    made = make_solver(study)
    assert isinstance(made, ReplaySolver)
    return made


RSM = "run,yield_stress,X9,F\n1,15,0.03,122\n2,15,0.03,112\n3,20,0.03,\n"


def test_rows_and_forces(tmp_path: Path) -> None:
    table = solver(tmp_path, RSM)
    rows = table.given_design("rsm")
    assert rows[0] == {"yield_stress": 15.0, "failure_strain": 0.03}
    answers = [table.solve(Request("rsm", i, {**row, "density": 1.0}, 8.0)) for i, row in enumerate(rows)]
    assert [a.response for a in answers] == [122.0, 112.0, None]
    assert answers[2].reason == "no_response" and "rsm.csv:4" in answers[2].message


def test_replicates_have_their_own_identity_and_a_changed_table_another(tmp_path: Path) -> None:
    table = solver(tmp_path, RSM)
    levels = {"yield_stress": 15.0, "failure_strain": 0.03}
    first, second = (table.identity(Request("rsm", row, levels, 8.0)) for row in (0, 1))
    assert first != second
    changed = solver(tmp_path, RSM.replace("122", "123"))
    assert changed.identity(Request("rsm", 0, levels, 8.0)) != first


def test_a_row_that_is_not_there(tmp_path: Path) -> None:
    table = solver(tmp_path, RSM)
    for row, stress in ((7, 15.0), (0, 16.0)):
        answer = table.solve(Request("rsm", row, {"yield_stress": stress, "failure_strain": 0.03}, 8.0))
        assert answer.reason == "not_in_table"


def test_validation_by_diameter(tmp_path: Path) -> None:
    table = solver(tmp_path, validate="diameter_mm,force\n7,129.4\n8,169\n")
    assert table.solve(Request("validate", 0, {}, 8.0)).response == 169.0
    assert table.solve(Request("validate", 0, {}, 9.0)).message == "validate.csv has no diameter 9 mm"


def test_a_stage_without_table(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"give the spec a solver.screen: FILE.csv"):
        solver(tmp_path, RSM).given_design("screen")


def test_a_screening_needs_every_factor(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text("yield_stress,F\n10,1\n", encoding="utf-8")
    study = make_study(tmp_path, "solver: {kind: table, screen: s.csv}\n")
    with pytest.raises(SpecError) as error:
        ReplaySolver(study)
    assert len(error.value.problems) == 8
    assert "density: has no column" in str(error.value)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "gbk"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_encodings_and_separators(tmp_path: Path, encoding: str, separator: str, end: str) -> None:
    lines = ["a,b,剪切力", "1,2,3.5", "", " 4 , 5,6"]
    path = tmp_path / "t.csv"
    path.write_bytes(end.join(lines).replace(",", separator).encode(encoding))
    sheet = read_sheet(path, KNOWN)
    assert sheet.rows == ({"a": 1.0, "b": 2.0}, {"a": 4.0, "b": 5.0})
    assert sheet.responses == (3.5, 6.0)
    assert sheet.response == "剪切力"
    assert sheet.lines == (2, 4)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "no header"),
        ("a\n1\n", "no header"),
        ("a,F\n", "t.csv:2:1: there are no rows"),
        ("a,c,F\n1,2,3\n", "t.csv:1:2: c: is not a factor"),
        ("a,X1,F\n1,2,3\n", "stands there twice"),
        ("a,b\n1,2\n", "the force must come last"),
        ("run,F\n1,2\n", "no column is a factor"),
        ("a,F\n1\n", "t.csv:2:1: has 1 cell, "),
        ("a,F\n1,2\nx,3\n", "t.csv:3:1: a: 'x' is not a number"),
        ("a,F\n1,zwei\n", "t.csv:2:2: F: 'zwei' is not a number"),
        ("a,F\ninf,2\n", "'inf' is not a number"),
        ("a,F\n1_0,2\n", "'1_0' is not a number"),
        ("a;F\n1,5;2\n", "'1,5' is not a number; write a number with a decimal point"),
        ('a,F\n"1,2\n', "is not a CSV table"),
        ("a,F\n1,2\0\n", "is not text"),
    ],
)
def test_wrong_tables(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8", newline="")
    with pytest.raises(SpecError) as error:
        read_sheet(path, KNOWN)
    assert complaint in str(error.value)


def test_near_misses_are_suggested(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("yield_stres,F\n1,2\n", encoding="utf-8")
    with pytest.raises(SpecError, match=r"did you mean yield_stress\?"):
        read_sheet(tmp_path / "t.csv", {"yield_stress": "yield_stress"})


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="No such file"):
        read_sheet(tmp_path / "t.csv", KNOWN)


OWN = """\
name: heap
factors:
  - {name: static, low: 0.2, high: 0.8}
  - {name: rolling, low: 0.02, high: 0.12}
responses:
  - {name: angle, label: Angle of repose, unit: deg}
"""
DENSITY = "  - {name: density, label: Bulk density, unit: kg/m3}\n"
MOISTURE = 'conditions: [{name: moisture, unit: "%"}]\n'


def own(folder: Path, head: str, target: str, **tables: str) -> ReplaySolver:
    """Return the tables of a study of its own words."""
    for name, text in tables.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    given = ", ".join(f"{name}: {name}.csv" for name in tables)
    path = folder / "heap.yaml"
    path.write_text(f"{head}targets: [{target}]\nsolver: {{kind: table, {given}}}\n", encoding="utf-8")
    made = make_solver(load_study(path))
    assert isinstance(made, ReplaySolver)
    return made


def test_a_table_has_its_condition_under_its_own_name(tmp_path: Path) -> None:
    table = own(tmp_path, OWN + MOISTURE, "{moisture: 12, angle: 30}", validate="moisture,angle\n12,30.5\n16,33\n")
    assert table.solve(Request("validate", 0, {}, 16.0)).response == 33.0
    assert table.solve(Request("validate", 0, {}, 20.0)).message == "validate.csv has no moisture 20 %"
    assert table.identity(Request("validate", 0, {}, 16.0))["condition"] == 16.0
    with pytest.raises(SpecError, match="moisture: has no column"):
        own(tmp_path, OWN + MOISTURE, "{moisture: 12, angle: 30}", validate="static,angle\n0.5,30\n")


def test_without_condition_there_is_no_column_of_it(tmp_path: Path) -> None:
    table = own(tmp_path, OWN, "{angle: 30}", validate="run,angle\n1,30.5\n")
    assert table.solve(Request("validate", 0, {}, 0.0)).response == 30.5
    assert "condition" not in table.identity(Request("validate", 0, {}, 0.0))


def test_responses_stand_under_their_names(tmp_path: Path) -> None:
    rsm = "angle,static,density,rolling\n30,0.2,650,0.02\n,0.8,640,0.02\n"
    table = own(tmp_path, OWN + DENSITY, "{angle: 30}", rsm=rsm)
    rows = table.given_design("rsm")
    assert rows[0] == {"static": 0.2, "rolling": 0.02}
    first, second = (table.solve(Request("rsm", i, row, 0.0)) for i, row in enumerate(rows))
    assert (first.response, first.details["responses"]) == (30.0, {"density": 650.0})
    assert (second.reason, second.message) == ("no_response", "rsm.csv:3: no angle of repose is given")
    with pytest.raises(SpecError, match="density: has no column; add it"):
        own(tmp_path, OWN + DENSITY, "{angle: 30}", rsm="static,rolling,angle\n0.2,0.02,30\n")


def test_a_single_response_may_stand_last_under_any_name(tmp_path: Path) -> None:
    table = own(tmp_path, OWN, "{angle: 30}", rsm="static,rolling,theta\n0.2,0.02,30\n")
    assert table.solve(Request("rsm", 0, {"static": 0.2, "rolling": 0.02}, 0.0)).response == 30.0
