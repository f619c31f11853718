"""Readers and reductions: known numbers in, known number out."""

import json
from pathlib import Path
from typing import Any

import pytest

from stemcal.errors import SimulationFailed
from stemcal.solvers.readers import read_curve, read_number, require_end, still_rising
from stemcal.solvers.result_reader import ResultReader


def _left(folder: Path, y: list[float], x: list[float] | None = None) -> Path:
    """Write a series as a program leaves it."""
    (folder / "out.json").write_text(json.dumps({"y": y, "x": x}), encoding="utf-8")
    return folder


@pytest.mark.parametrize(("reduction", "known"), [("max", 9.0), ("min", -2.0), ("first", 1.0), ("last", 4.0)])
def test_reductions(reduction: Any, known: float, tmp_path: Path) -> None:
    result = ResultReader(file="out.json", path="y", reduction=reduction)
    assert read_number(result, _left(tmp_path, [1.0, 9.0, -2.0, 4.0])) == known


@pytest.mark.parametrize(("series", "reason"), [([], "no_result"), ([1.0, float("nan")], "nan")], ids=["empty", "NaN"])
def test_a_series_without_numbers_is_refused(series: list[float], reason: str, tmp_path: Path) -> None:
    with pytest.raises(SimulationFailed) as caught:
        read_number(ResultReader(file="out.json", path="y"), _left(tmp_path, series))
    assert caught.value.reason == reason


@pytest.mark.parametrize("travel", [[1.0, 0.0], [1.0], None, [0.0, float("inf")]])
def test_a_curve_needs_a_travel_that_rises(travel: list[float] | None, tmp_path: Path) -> None:
    with pytest.raises(SimulationFailed) as caught:
        read_curve(ResultReader(file="out.json", path="y", along="x"), _left(tmp_path, [1.0, 2.0], travel))
    assert caught.value.reason == "bad_result"


def test_a_travel_may_stay_but_not_fall(tmp_path: Path) -> None:
    """A blade that stops for a moment: two forces at one travel."""
    x, y = read_curve(
        ResultReader(file="out.json", path="y", along="x"), _left(tmp_path, [1.0, 2.0, 3.0], [0.0, 0.5, 0.5])
    )
    assert (x.tolist(), y.tolist()) == ([0.0, 0.5, 0.5], [1.0, 2.0, 3.0])


def test_csv_column(tmp_path: Path) -> None:
    (tmp_path / "out.csv").write_text("t,F\n0,0\n\n1,3.5\n2,1.25\n", encoding="utf-8")
    result = ResultReader(file="out.csv", column="F", along="t", reduction="max", scale=2.0)
    assert read_number(result, tmp_path) == 7.0
    travel, force = read_curve(result, tmp_path)
    assert (travel.tolist(), force.tolist()) == ([0.0, 1.0, 2.0], [0.0, 7.0, 2.5])


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("t;F\n0;1,5\n", "F", "bad_result"),
        ("t,F\n0\n", "F", "nan"),
        ("t,F\n0,1\n", "G", "no_result"),
        ("t,F\n", "F", "no_result"),
        ('t,F\n0,"1\n', "G", "no_result"),
        ("t,F\n0,nan\n", "F", "nan"),
    ],
)
def test_csv_failures(tmp_path: Path, text: str, column: str, reason: str) -> None:
    (tmp_path / "out.csv").write_text(text, encoding="utf-8")
    with pytest.raises(SimulationFailed) as caught:
        read_number(ResultReader(file="out.csv", column=column), tmp_path)
    assert caught.value.reason == reason


@pytest.mark.parametrize(
    ("content", "reason"), [(b"t,F\0\n0,1\n", "bad_result"), (b" \n", "no_result"), (None, "no_result")]
)
def test_a_file_that_is_no_text_has_its_reason(tmp_path: Path, content: bytes | None, reason: str) -> None:
    if content is not None:
        (tmp_path / "out.csv").write_bytes(content)
    with pytest.raises(SimulationFailed) as caught:
        read_number(ResultReader(file="out.csv", column="F"), tmp_path)
    assert caught.value.reason == reason and "out.csv" in str(caught.value)


def test_json_path_with_index(tmp_path: Path) -> None:
    (tmp_path / "o.json").write_text('{"runs": [{"F": [1, 2]}, {"F": [3, 5], "x": [0, 2]}]}', encoding="utf-8")
    result = ResultReader(file="o.json", path="runs.1.F", along="runs.1.x")
    assert read_number(result, tmp_path) == 5.0
    assert read_curve(result, tmp_path)[0].tolist() == [0.0, 2.0]


CUT = [
    (r"([\d.]+)", "F = 197,92 N"),
    (r"([\d.]+)", "F = 3,958.4"),
    (r"([\d.]+)", "F = 1.979e+02"),
    (r"([\d.]+)", "F = 1.979D+02"),
    (r"([\d.]+)", "F = 1.979d2"),
    (r"([\d.]+)", "F = 1.979+102"),
    (r"([\d.]+)", "F = 1.979 * 10^2"),
    (r"([\d.]+)", "F = -1.5"),
    (r"([\d.]+)", "F = \N{MINUS SIGN}1.5"),
    (r"([\d.]+)", "F = 3'958.4"),
    (r"([\d.]+)", "F = 3\N{NARROW NO-BREAK SPACE}958.4"),
    (r"(\d+)", "F = 197.92"),
    (r"(\d{3})", "F = 19792"),
    (r"([\d.]+) N", "F = 0,5 N"),
    (r"(\d+) N", "F = 0.5 N"),
    (r"(\d+) N", "F = .5 N"),
    (r"(\d+)$", "F = 1.5e-3"),
    (r"F.*?([\d.]+).*N", "F = 197,92 N"),
    (r"F = (?P<y>[\d.]+)", "F = 197,92 N"),
    (r"t=(?P<x>\d+).*F=(?P<y>\S+)", "t=0.5 F=1"),
    (r"([\d.]+),", "F = 3,958.4 N"),
    (r"([\d.]+),", "F = 3,958, W = 3"),
    (r"F = (\d+),", "F = 197,92 N"),
    (r"-?([\d.]+)", "F = -197.9 N"),
    (r"F = -?([\d.]+)", "F = -197.9 N"),
    (r"F = ([\d.]+)", "F = 3 958.4 N"),
    (r"([\d.]+) N", "F = 3 958.4 N"),
    (r"([\d.]+)", "F = 3 958.4 N"),
    (r"F = (\S+)", "F = 3 958"),
    (r"F = (\S+)", "F = 12 003 958.4 N"),
    (r"F = ([\d.]+)", "F = 1 979,5 N"),
    (r"F = ([\d.]+)", "F = 1.979·10² N"),
    (r"F = ([\d.]+)", "F = 1.979 × 10⁻¹ N"),
    (r"·(\d+)", "F = 1.979·10² N"),
    (r"F = (\d+)", "F = 197½ N"),
]
WHOLE = [
    (r"([\d.]+)", "F = 197.92 N", 197.92),
    (r"([\d.]+)", "F = 197.92, W = 3", 3.0),
    (r"([-\d.eE+]+)", "F -1.979e+02", -197.9),
    (r"F = (\S+)", "F = 1.979D+02", 197.9),
    (r"F = (\S+)", "F = 1.5-101", 1.5e-101),
    (r"(\d+\.\d+),", "1.5,2.5,", 2.5),
    (r"^(\d+),(\d+)$", "12,15", 12.0),
    (r",(\d+)$", "12,15", 15.0),
    (r"step-(\d+)", "step-12", 12.0),
    (r"No\.(\d+)", "No.12", 12.0),
    (r"^.{4}(.{12})", "   1 1.97920E+02-2.00000E+00", 197.92),
    (r"^.{4}(.{8})(.{8})", "   1197.9200200.0000", 197.92),
    (r"F=([\d.]+)kN", "F=1.5kN", 1.5),
    (r"(\d+),", "1,2,3,", 3.0),
    (r"(\d+),\d", "12,15", 12.0),
    (r"(\S+)$", "1 12 345.6", 345.6),
    (r"^\s*\d+ (\S+)", "12 345.6", 345.6),
    (r"step (\d+)", "step 12 100 3.5", 12.0),
    (r"F = (\S+) \d", "F = 3 958", 3.0),
    (r"F = (.+) N", "F = 3958.4 N", 3958.4),
]


@pytest.mark.parametrize(("pattern", "line"), CUT, ids=[line for _, line in CUT])
def test_a_part_of_a_number_is_no_result(tmp_path: Path, pattern: str, line: str) -> None:
    (tmp_path / "log.txt").write_text(f"begin\n{line}\n", encoding="utf-8")
    with pytest.raises(SimulationFailed, match=r"log\.txt, line 2: .*part of a number") as caught:
        read_number(ResultReader(file="log.txt", pattern=pattern), tmp_path)
    assert caught.value.reason == "bad_result"


@pytest.mark.parametrize(("pattern", "line", "known"), WHOLE, ids=[line for _, line, _ in WHOLE])
def test_a_whole_number_is_read(tmp_path: Path, pattern: str, line: str, known: float) -> None:
    (tmp_path / "log.txt").write_text(f"{line}\n", encoding="utf-8")
    assert read_number(ResultReader(file="log.txt", pattern=pattern), tmp_path) == pytest.approx(known, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "printed", "complete"),
    [
        ("t,F\n0,1\n1,5\n2,3\n# NORMAL TERMINATION\n\n", "", True),
        ("t,F\n0,1\n1,5\n2,3\n", "cpu 3 s\nNORMAL TERMINATION\nbye\n", True),
        ("t,F\n0,1\n1,5\n", "killed\n", False),
        ("t,F\n0,1\n1,5\n2,3\n", "NORMAL TERMINATION of step 1\n" + "step 2\n" * 10, False),
    ],
)
def test_the_text_of_the_end_is_required(tmp_path: Path, text: str, printed: str, complete: bool) -> None:
    (tmp_path / "out.csv").write_text(text, encoding="utf-8")
    result = ResultReader(file="out.csv", column="F", reduction="max", ends_with="NORMAL TERMINATION")
    if complete:
        require_end(result, tmp_path, printed)
        assert read_number(result, tmp_path) == 5.0
        return
    with pytest.raises(SimulationFailed) as caught:
        require_end(result, tmp_path, printed)
    assert caught.value.reason == "incomplete"


@pytest.mark.parametrize(
    ("reduction", "y", "rising"),
    [
        ("max", [1.0, 5.0, 3.0], False),
        ("max", [1.0, 3.0, 5.0], True),
        ("max", [1.0, 5.0, 5.0], False),
        ("min", [1.0, -3.0, -5.0], True),
        ("min", [1.0, -3.0, 2.0], False),
        ("last", [1.0, 5.0], False),
        ("max", [5.0], False),
    ],
)
def test_a_maximum_at_the_end_is_a_lower_bound(tmp_path: Path, reduction: Any, y: list[float], rising: bool) -> None:
    assert still_rising(ResultReader(file="out.json", path="y", reduction=reduction), _left(tmp_path, y)) is rising


def test_regex_groups_and_fortran_numbers(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("t= 0 F= 1.5D+01\nnöise\nt= 2 F= 2.5d1\n", encoding="utf-8")
    pattern = r"t=\s*(?P<x>\S+) F=\s*(?P<y>\S+)"
    found = ResultReader(file="log.txt", pattern=pattern)
    assert read_number(found, tmp_path) == 25.0
    assert [values.tolist() for values in read_curve(found, tmp_path)] == [[0.0, 2.0], [15.0, 25.0]]


def test_regex_without_match(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("nothing\n", encoding="utf-8")
    with pytest.raises(SimulationFailed) as caught:
        read_number(ResultReader(file="log.txt", pattern="F=(.*)"), tmp_path)
    assert caught.value.reason == "no_result"
