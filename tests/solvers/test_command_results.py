"""Readers and reductions: known numbers in, known number out."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from stemcal.errors import SimulationFailed
from stemcal.solvers.readers import read_curve, read_number, require_end, required_number, still_rising
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


# ---- numbers, limits and messages


@pytest.mark.parametrize(
    ("text", "known"),
    [
        ("1.5", 1.5),
        (" -.5E+3 ", -500.0),
        ("+2.", 2.0),
        ("1.5D-3", 0.0015),
        ("1.5d2", 150.0),
        ("1.5-101", 1.5e-101),
        ("1.5+002", 150.0),
        ("7e2", 700.0),
        ("0" * 400, 0.0),
        ("1_000", None),
        ("\u0661", None),
        ("", None),
        (".", None),
        ("1.5e", None),
        ("0x10", None),
        ("1,5", None),
        ("1.5 N", None),
        ("nano", None),
    ],
)
def test_numbers_of_programs(text: str, known: float | None) -> None:
    if known is not None:
        assert required_number(text) == known
        return
    with pytest.raises(SimulationFailed) as caught:
        required_number(text)
    assert (caught.value.reason, str(caught.value)) == ("bad_result", f"{text[:40]!r} is not a number")


@pytest.mark.parametrize("text", ["nan", "-NaN", "inf", "+Infinity", "***", "-INF"])
def test_a_missing_number_is_nan(text: str) -> None:
    assert math.isnan(required_number(text))


def failure(result: ResultReader, folder: Path, read: Any = read_number) -> tuple[str, str]:
    """Return reason and message with which a result is refused."""
    with pytest.raises(SimulationFailed) as caught:
        read(result, folder)
    return caught.value.reason, str(caught.value)


@pytest.mark.parametrize(
    ("content", "path", "found"),
    [
        ('{"a": [1, null]}', "a", ("nan", "value 2 of 2 is not finite (nan)")),
        ('{"a": [1, 2, 1e999, 3]}', "a", ("nan", "value 3 of 4 is not finite (inf)")),
        (f'{{"a": {"9" * 400}}}', "a", ("nan", "value 1 of 1 is not finite (inf)")),
        ('{"a": true}', "a", ("bad_result", "a: 'True' is not a number")),
        ('{"a": {"b": 1}}', "a", ("bad_result", "a: \"{'b': 1.0}\" is not a number")),
        ('{"a": "' + "w" * 50 + '"}', "a", ("bad_result", f"a: '{'w' * 40}' is not a number")),
        ('{"a": {"b": 1}}', "a.c", ("no_result", "o.json has no entry 'a.c' ('c' was not found)")),
        ('{"a": [5]}', "a.1", ("no_result", "o.json has no entry 'a.1' ('1' was not found)")),
        ('{"a": [5]}', "a.b", ("no_result", "o.json has no entry 'a.b' ('b' was not found)")),
        ('{"a": 5}', "a.b", ("no_result", "o.json has no entry 'a.b' ('b' was not found)")),
        ('{"a": []}', "a", ("no_result", "the result contains no numbers")),
        ("", "a", ("no_result", "o.json is empty")),
        ("\n \n", "a", ("no_result", "o.json is empty")),
        ("{\0}", "a", ("bad_result", "o.json is not a text file")),
        ("{,}", "a", ("bad_result", "o.json is not valid JSON: Expecting property name enclosed in double quotes")),
    ],
)
def test_a_json_result_is_refused_with_its_place(
    tmp_path: Path, content: str, path: str, found: tuple[str, str]
) -> None:
    (tmp_path / "o.json").write_text(content, encoding="utf-8")
    reason, message = failure(ResultReader(file="o.json", path=path), tmp_path)
    assert (reason, message[: len(found[1])]) == found


def test_numbers_in_json_may_be_texts_and_are_scaled(tmp_path: Path) -> None:
    (tmp_path / "o.json").write_text('{"a": {"b": ["1.5D1", 7]}, "x": [0, 1]}', encoding="utf-8")
    first = ResultReader(file="o.json", path="a.b", reduction="first", along="x", scale=-3.0)
    assert read_number(first, tmp_path) == -45.0
    x, y = read_curve(first, tmp_path)
    assert (x.tolist(), y.tolist()) == ([0.0, 1.0], [-45.0, -21.0])


@pytest.mark.parametrize(
    ("travel", "message"),
    [
        ([0.0], "the curve has 2 response values but 1 travel values"),
        ([1.0, 0.5], "the travel values of the curve are not in increasing order"),
        ([0.0, float("nan")], "the travel values of the curve are not in increasing order"),
        ([float("nan"), 0.0], "the travel values of the curve are not in increasing order"),
    ],
)
def test_a_wrong_travel_is_named(tmp_path: Path, travel: list[float], message: str) -> None:
    result = ResultReader(file="out.json", path="y", along="x")
    assert failure(result, _left(tmp_path, [1.0, 2.0], travel), read_curve) == ("bad_result", message)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("t,F\n0,1\n1,2\n", [1.0, 2.0]),
        ("t;F\n0;1\n1;2\n", [1.0, 2.0]),
        ("t\tF\n0\t1\n", [1.0]),
        (" t , F \n0, 1.5D0 \n", [1.5]),
        ('"t","F"\n0,"3"\n', [3.0]),
        ("t;F,x\n1;2\n", None),
        ("t,F,F,G\n1,2,3,4\n", [3.0]),
    ],
)
def test_columns_are_separated_by_the_most_frequent_mark(
    tmp_path: Path, text: str, numbers: list[float] | None
) -> None:
    (tmp_path / "o.csv").write_text(text, encoding="utf-8")
    result = ResultReader(file="o.csv", column="F", along="t")
    if numbers is None:
        assert failure(result, tmp_path) == ("no_result", "o.csv has no column 'F', only t;F, x")
    else:
        assert read_curve(result, tmp_path)[1].tolist() == numbers


def test_a_wrong_cell_has_its_row_and_a_missing_column_the_columns(tmp_path: Path) -> None:
    (tmp_path / "o.csv").write_text("t,F\n0,1\nx,broken\n", encoding="utf-8")
    force, travel = ResultReader(file="o.csv", column="F"), ResultReader(file="o.csv", column="F", along="u")
    assert failure(force, tmp_path) == ("bad_result", "o.csv, row 2: 'broken' is not a number")
    assert failure(travel, tmp_path) == ("no_result", "o.csv has no column 'u', only t, F")
    (tmp_path / "o.csv").write_text("t,F\n0,1\nx,2\n", encoding="utf-8")
    assert read_number(force, tmp_path) == 2.0
    assert failure(ResultReader(file="o.csv", column="t"), tmp_path)[1] == "o.csv, row 2: 'x' is not a number"
    (tmp_path / "o.csv").write_text("c" * 300 + "\n1\n", encoding="utf-8")
    assert failure(force, tmp_path)[1] == f"o.csv has no column 'F', only {'c' * 200}"
    (tmp_path / "o.csv").write_text("F\n" + "1" * 200_000 + "\n", encoding="utf-8")
    reason, message = failure(force, tmp_path)
    assert reason == "bad_result" and message.startswith("o.csv is not a valid CSV table: field larger")


def test_a_result_in_a_folder_of_the_run_is_read_and_one_beside_it_is_not(tmp_path: Path) -> None:
    (tmp_path / "run" / "sub").mkdir(parents=True)
    (tmp_path / "run" / "sub" / "o.json").write_text('{"a": 1}', encoding="utf-8")
    assert read_number(ResultReader(file="sub/o.json", path="a"), tmp_path / "run") == 1.0
    missing = failure(ResultReader(file="o.json", path="a"), tmp_path / "run")
    assert missing == ("no_result", "the program did not write the file o.json")
    assert failure(ResultReader(file="sub", path="a"), tmp_path / "run")[0] == "no_result"


@pytest.mark.parametrize(("bytes_more", "read"), [(0, True), (1, False)])
def test_a_result_has_at_most_twenty_mebibytes(tmp_path: Path, bytes_more: int, read: bool) -> None:
    with (tmp_path / "o.json").open("wb") as file:
        file.write(b'{"a": 5}'.ljust(20 * 1024**2 + bytes_more))
    result = ResultReader(file="o.json", path="a")
    if read:
        assert read_number(result, tmp_path) == 5.0
    else:
        assert failure(result, tmp_path) == ("bad_result", "o.json: is larger than 20 MiB")


@pytest.mark.parametrize(
    ("printed", "complete"),
    [
        ("END\n" + "step\n" * 9, True),
        ("END\n" + "step\n" * 10, False),
        ("END\n" + "\n \n" * 30 + "step\n" * 9, True),
        ("the END is near", True),
        ("END\n" + "." * 9995, True),
        ("END\n" + "." * 10_000, False),
    ],
)
def test_the_end_is_in_the_last_ten_lines(tmp_path: Path, printed: str, complete: bool) -> None:
    (tmp_path / "o.csv").write_text("F\n1\n", encoding="utf-8")
    result = ResultReader(file="o.csv", column="F", ends_with="END")
    require_end(ResultReader(file="none", column="F"), tmp_path, printed)  # without `ends_with` nothing is read
    if complete:
        require_end(result, tmp_path, printed)
        return
    place = "neither at the end of o.csv nor at the end of the printed output"
    message = f"'END' (`ends_with`) is {place}, so the program stopped early"
    assert failure(result, tmp_path, lambda *given: require_end(*given, printed)) == ("incomplete", message)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("F\n1\n2\nEND\n\n", [1.0, 2.0]),
        ("F\n1\n2\n", [1.0, 2.0]),
        ("F\n1\nEND 2\n", [1.0]),
        ("F END\n", None),
    ],
)
def test_the_line_of_the_end_is_no_row_of_a_table(tmp_path: Path, text: str, numbers: list[float] | None) -> None:
    (tmp_path / "o.csv").write_text(text, encoding="utf-8")
    first = ResultReader(file="o.csv", column="F", ends_with="END", reduction="first")
    last = ResultReader(file="o.csv", column="F", ends_with="END")
    if numbers is None:
        assert failure(last, tmp_path) == ("no_result", "o.csv has no column 'F', only F END")
    else:
        assert [read_number(first, tmp_path), read_number(last, tmp_path)] == [numbers[0], numbers[-1]]


def test_a_pattern_searches_ten_thousand_characters_of_each_line(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("F=1\n" + " " * 9996 + "F=25\n" + " " * 9998 + "F=3\n", encoding="utf-8")
    result = ResultReader(file="log", pattern=r"F=(\d+)")
    assert read_number(result, tmp_path) == 25.0
    groups = ResultReader(file="log", pattern=r"(F)=(?P<y>\d+)")
    assert read_number(groups, tmp_path) == 25.0
    none = ResultReader(file="log", pattern=r"G=(\d+)")
    assert failure(none, tmp_path) == ("no_result", "log contains no match for the pattern")
    (tmp_path / "log").write_text("F=1\nF=x\n", encoding="utf-8")
    wrong = ResultReader(file="log", pattern=r"F=(\S+)")
    assert failure(wrong, tmp_path) == ("bad_result", "log, line 2: 'x' is not a number")


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"column": "F", "path": "a"}, "has column and path"),
        ({}, "does not specify which numbers to read"),
        ({"pattern": "(.)", "along": "x"}, "has both `along` and `pattern`"),
        ({"pattern": "."}, "no capture group"),
        ({"pattern": "("}, "not a valid regular expression"),
        ({"column": "c" * 501}, "500"),
        ({"column": ""}, "1 character"),
        ({"column": "F", "file": "f" * 256}, "is not a file in the run folder"),
        ({"column": "F", "file": " "}, "is not a file in the run folder"),
        ({"column": "F", "file": "a\0"}, "is not a file in the run folder"),
        ({"column": "F", "file": "\\\\host\\x"}, "is not a file in the run folder"),
    ],
)
def test_a_reader_names_its_numbers_once(keys: dict[str, str], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        ResultReader(**{"file": "o.csv", **keys})  # type: ignore[arg-type]


def test_readers_by_default() -> None:
    reader = ResultReader(file="f" * 255, column="c" * 500)
    assert (reader.reduction, reader.scale, reader.along, reader.ends_with) == ("last", 1.0, None, None)
    assert ResultReader(file="a/..b/c", pattern="(.)").file == "a/..b/c"
