"""Readers and reductions: known numbers in, known number out."""

from __future__ import annotations

from pathlib import Path

import pytest

from stemcal.solvers.programs.readers import read_number
from stemcal.solvers.programs.reductions import NoResult, Series, reduce_series
from stemcal.study.model import CsvResult, JsonResult, RegexResult

# y = x² at 0, 1, 2, 3
PARABOLA = Series([0.0, 1.0, 4.0, 9.0], [0.0, 1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("reduction", "places", "known"),
    [
        ("max", {}, 9.0),
        ("min", {}, 0.0),
        ("first", {}, 0.0),
        ("last", {}, 9.0),
        ("at", {"at": 1.5}, 2.5),
        ("at", {"at": 3.0}, 9.0),
        ("work", {}, 0.5 + 2.5 + 6.5),
        ("mean_over", {"over": (1.0, 3.0)}, (2.5 + 6.5) / 2),
        ("mean_over", {"over": (0.5, 1.5)}, (0.5 * (0.5 + 1.0) / 2 + 0.5 * (1.0 + 2.5) / 2)),
        ("mean_over", {"over": (2.0, 2.0)}, 4.0),
    ],
)
def test_reductions(reduction: str, places: dict[str, object], known: float) -> None:
    assert reduce_series(PARABOLA, reduction, **places) == pytest.approx(known, rel=1e-15)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("series", "reduction", "places", "reason"),
    [
        (Series([]), "last", {}, "no_result"),
        (Series([1.0, float("nan")]), "first", {}, "nan"),
        (PARABOLA, "at", {"at": 3.1}, "no_result"),
        (PARABOLA, "mean_over", {"over": (-1.0, 1.0)}, "no_result"),
        (Series([1.0, 2.0], [1.0, 0.0]), "work", {}, "bad_result"),
        (Series([1.0, 2.0], [1.0]), "work", {}, "bad_result"),
        (Series([1.0, 2.0]), "work", {}, "bad_result"),
    ],
)
def test_reductions_refuse(series: Series, reduction: str, places: dict[str, object], reason: str) -> None:
    with pytest.raises(NoResult) as caught:
        reduce_series(series, reduction, **places)  # type: ignore[arg-type]
    assert caught.value.reason == reason


def test_csv_column(tmp_path: Path) -> None:
    (tmp_path / "out.csv").write_text("t,F\n0,0\n\n1,3.5\n2,1.25\n", encoding="utf-8")
    result = CsvResult(kind="csv", file="out.csv", column="F", along="t", reduction="work", scale=2.0)
    assert read_number(result, tmp_path) == 2 * (1.75 + 2.375)


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("t;F\n0;1,5\n", "F", "bad_result"),
        ("t,F\n0\n", "F", "bad_result"),
        ("t,F\n0,1\n", "G", "no_result"),
        ("t,F\n", "F", "no_result"),
        ('t,F\n0,"1\n', "G", "no_result"),
        ("t,F\n0,nan\n", "F", "nan"),
    ],
)
def test_csv_failures(tmp_path: Path, text: str, column: str, reason: str) -> None:
    (tmp_path / "out.csv").write_text(text, encoding="utf-8")
    with pytest.raises(NoResult) as caught:
        read_number(CsvResult(kind="csv", file="out.csv", column=column), tmp_path)
    assert caught.value.reason == reason


def test_json_path_with_index(tmp_path: Path) -> None:
    (tmp_path / "o.json").write_text('{"runs": [{"F": [1, 2]}, {"F": [3, 5], "x": [0, 2]}]}', encoding="utf-8")
    result = JsonResult(kind="json", file="o.json", path="runs.1.F", along="runs.1.x", reduction="at", at=1.0)
    assert read_number(result, tmp_path) == 4.0


def test_regex_groups_and_fortran_numbers(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("t= 0 F= 1.5D+01\nnoise\nt= 2 F= 2.5d1\n", encoding="utf-8")
    pattern = r"t=\s*(?P<x>\S+) F=\s*(?P<y>\S+)"
    found = RegexResult(kind="regex", file="log.txt", pattern=pattern, reduction="work")
    assert read_number(found, tmp_path) == 40.0


def test_regex_without_match(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("nothing\n", encoding="utf-8")
    with pytest.raises(NoResult) as caught:
        read_number(RegexResult(kind="regex", file="log.txt", pattern="F=(.*)"), tmp_path)
    assert caught.value.reason == "no_result"
