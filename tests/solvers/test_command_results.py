"""Readers and reductions: known numbers in, known number out."""

import json
from pathlib import Path
from typing import Any

import pytest

from stemcal.errors import SimulationFailed
from stemcal.solvers.readers import read_curve, read_number
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


def test_json_path_with_index(tmp_path: Path) -> None:
    (tmp_path / "o.json").write_text('{"runs": [{"F": [1, 2]}, {"F": [3, 5], "x": [0, 2]}]}', encoding="utf-8")
    result = ResultReader(file="o.json", path="runs.1.F", along="runs.1.x")
    assert read_number(result, tmp_path) == 5.0
    assert read_curve(result, tmp_path)[0].tolist() == [0.0, 2.0]


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
