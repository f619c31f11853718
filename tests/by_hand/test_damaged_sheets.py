"""What people and spreadsheet programs do to a sheet: each row is taken rightly or refused with row and remedy."""

import io
import math
from collections import Counter
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from sheets import Cells, awaited, entered, text_of

from stemcal.errors import UsageError
from stemcal.runs.study_folder import StudyFolder
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

RUNS = 15
ANGLE, BULK, WHO, _, REMARK, STUDY = range(4, 10)
HURT = 3  # the row that most kinds of damage are done to
HEAP = (Path(__file__).parents[2] / "examples" / "by-hand" / "heap.yaml").read_text("utf-8")


@pytest.fixture(scope="module")
def heap(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Return the example's study with a second response."""
    spec = tmp_path_factory.mktemp("heap") / "heap.yaml"
    text = HEAP.replace("unit: deg}\n", "unit: deg}\n  - {name: bulk, unit: kg/m3}\n", 1)
    spec.write_text(
        text.replace("sd: 1.1 deg, n: 6}", "n: 6, bulk: 690 kg/m3, sd: {angle: 1.1 deg, bulk: 3 kg/m3}}"),
        encoding="utf-8",
    )
    return load_study(spec)


def measured(levels: list[str]) -> tuple[float, float]:
    """Return angle and bulk density of a heap that nobody has made."""
    sliding, rolling, wall = map(float, levels)
    return round(18.3 + 16 * sliding + 38 * rolling + 1.5 * wall, 1), round(720.5 - 40 * sliding - 60 * rolling, 1)


@pytest.fixture
def sheet(heap: Study, tmp_path: Path) -> Cells:
    """Return the sheet with every result written."""
    head, *rows = awaited(heap, StudyFolder(tmp_path / "asking"))
    assert [len(rows), head[ANGLE], head[BULK], head[WHO]] == [RUNS, "angle (deg)", "bulk (kg/m3)", "who"]
    return [
        head,
        *([*row[:ANGLE], *(f"{value:.1f}" for value in measured(row[1:4])), "Li", "", "", "heap"] for row in rows),
    ]


def put(column: int, text: str) -> Callable[[Cells], str]:
    """Return what writes something into a cell."""

    def change(cells: Cells) -> str:
        cells[HURT][column] = text
        return text_of(cells)

    return change


def each(change: Callable[[list[str]], list[str]]) -> Callable[[Cells], str]:
    """Return what changes every row, the heading too."""
    return lambda cells: text_of([change(row) for row in cells])


def rows(change: Callable[[Cells], Cells]) -> Callable[[Cells], str]:
    """Return what changes the rows as a whole."""
    return lambda cells: text_of([cells[0], *change(cells[1:])])


def comma(text: str) -> str:
    """Return a number with a decimal comma."""
    return text.replace(".", ",") if text.replace(".", "").isdigit() else text


def each_but_study(cells: Cells) -> Cells:
    return [row[:STUDY] for row in cells]


def german(cells: Cells) -> str:
    return text_of([[comma(cell) for cell in row] for row in cells], ";")


def in_radians(cells: Cells) -> str:
    cells[0][ANGLE] = "angle (rad)"
    for row in cells[1:]:
        row[ANGLE] = repr(math.radians(float(row[ANGLE])))
    return text_of(cells)


def unquoted_comma(cells: Cells) -> str:
    line = ",".join(cells[HURT])
    return text_of(cells).replace(line, line.replace(cells[HURT][ANGLE], comma(cells[HURT][ANGLE]), 1))


def names_moved_on(cells: Cells) -> str:
    """One of the ends of a design is no other: the names of those rows are moved on by one."""
    edges = [row for row in cells[1:] if row[1:4] != ["0.4", "0.11", "0.5"]]
    names = [row[0] for row in edges]
    for row, name in zip(edges, [*names[1:], names[0]], strict=True):
        row[0] = name
    return text_of(cells)


def cut_short(cells: Cells) -> str:
    """The file ends in the middle of its last row, as while it is being written."""
    return text_of(cells)[: -len(",Li,,,heap\n") - 2]


def headed(*titles: tuple[int, str]) -> Callable[[Cells], str]:
    def change(cells: Cells) -> str:
        for column, title in titles:
            cells[0][column] = title
        return text_of(cells)

    return change


def twice(column: int, text: str) -> Callable[[Cells], str]:
    """Return what repeats a row with something else in a cell."""

    def change(cells: Cells) -> str:
        again = list(cells[HURT])
        again[column] = text or again[column]
        return text_of([*cells, again])

    return change


def failed(column: int, text: str, *, empty: bool = True) -> Callable[[Cells], str]:
    def change(cells: Cells) -> str:
        if empty:
            cells[HURT][ANGLE] = cells[HURT][BULK] = ""
        cells[HURT][column] = text
        return text_of(cells)

    return change


def workbook(change: Callable[[Any, Any], None] = lambda _book, _sheet: None) -> Callable[[Cells], bytes]:
    """Return what saves the sheet as a workbook, changed."""

    def save(cells: Cells) -> bytes:
        book = openpyxl.Workbook()
        sheet = book.active
        assert sheet is not None
        for number, row in enumerate(cells):
            sheet.append([float(cell) if number and 0 < i < WHO else cell for i, cell in enumerate(row)])
        change(book, sheet)
        text = io.BytesIO()
        book.save(text)
        return text.getvalue()

    return save


def cell(value: object) -> Callable[[Cells], bytes]:
    def change(_book: Any, sheet: Any) -> None:
        sheet.cell(HURT + 1, ANGLE + 1).value = value

    return workbook(change)


def merged(_book: Any, sheet: Any) -> None:
    sheet.merge_cells(start_row=HURT + 1, end_row=HURT + 2, start_column=ANGLE + 1, end_column=ANGLE + 1)


def with_notes(book: Any, _sheet: Any) -> None:
    book.create_sheet("notes").append(["Friday", "the drum squeaks"])


def with_a_copy(book: Any, sheet: Any) -> None:
    book.copy_worksheet(sheet)


TAKEN: dict[str, Callable[[Cells], str | bytes]] = {
    "as it is": text_of,
    "sorted": rows(sorted),
    "columns moved": each(lambda row: row[::-1]),
    "the study's name deleted": put(STUDY, ""),
    "columns for remarks deleted": each(lambda row: row[:WHO]),
    "a column of one's own": each(lambda row: [*row, "dry"]),
    "semicolons and decimal commas": german,
    "decimal commas in quotes": each(lambda row: [*row[:ANGLE], *map(comma, row[ANGLE:])]),
    "another unit in the heading": in_radians,
    "no unit in the heading": headed((ANGLE, "angle"), (BULK, "Bulk")),
    "the same row twice": twice(WHO, ""),
    "a level rounded": lambda cells: put(1, f"{float(cells[HURT][1]) + 2e-5:.5f}")(cells),
    "wide digits": lambda cells: put(ANGLE, cells[HURT][ANGLE].translate({46: 0xFF0E, 50: 0xFF12}))(cells),
    "blanks around a number": lambda cells: put(ANGLE, f"\u00a0 {cells[HURT][ANGLE]} ")(cells),
    "lines above the heading": lambda cells: "Sheet of Friday\n\n" + text_of(cells),
    "Excel's line on its separator": lambda cells: "sep=;\n" + german(cells),
    "empty lines": lambda cells: text_of(cells).replace("\n", "\n\n"),
    "the last line without its end": lambda cells: text_of(cells)[:-1],
    "lines of commas": lambda cells: text_of([*cells, [""] * 10, [""] * 10]),
    "a Chinese Excel's CSV": lambda cells: put(REMARK, "堆积角偏大")(cells).encode("gbk"),
    "a German Excel's CSV": lambda cells: headed((ANGLE, "angle (°)"))(cells).encode("cp1252"),
    "a workbook": workbook(),
    "a workbook with notes": workbook(with_notes),
}


@pytest.mark.parametrize("damage", TAKEN)
def test_taken_rightly(damage: str, heap: Study, sheet: Cells, tmp_path: Path) -> None:
    wanted = {row[0]: measured(row[1:4]) for row in sheet[1:]}
    folder = StudyFolder(tmp_path / "study")
    found = entered(heap, folder, TAKEN[damage](sheet))
    assert (len(found.taken), found.refused) == (RUNS, ())
    assert recorded(folder) == {name: pytest.approx(values) for name, values in wanted.items()}


def recorded(folder: StudyFolder) -> dict[str, Any]:
    """Return the results that are recorded, by run."""
    found = [record for key in folder.keys() if (record := folder.peek(key)) is not None]  # noqa: SIM118
    return {
        f"{record['request']['stage']} {record['request']['row'] + 1}": (
            (record["response"], record["details"]["responses"]["bulk"])
            if record["status"] == "ok"
            else record["message"]
        )
        for record in found
    }


def twin_slips(cells: Cells) -> str:
    """Two of fifteen have the same slip: neither hides the other."""
    for row in cells[HURT : HURT + 2]:
        row[ANGLE] = row[ANGLE].replace(".", "")
    return text_of(cells)


def exchanged(cells: Cells) -> str:
    row = cells[HURT]
    row[ANGLE], row[BULK] = row[BULK], row[ANGLE]
    return text_of(cells)


def moved(place: int) -> Callable[[Cells], str]:
    """Return what types the angle in another column of a row without results."""

    def change(cells: Cells) -> str:
        row = cells[HURT]
        row[place], row[ANGLE], row[BULK] = row[ANGLE], "", ""
        return text_of(cells)

    return change


REFUSED: dict[str, tuple[Callable[[Cells], str | bytes], dict[str, int]]] = {
    "a decimal comma that splits a cell": (unquoted_comma, {"broken_row": 1}),
    "a last row cut short": (cut_short, {"broken_row": 1}),
    "a last line without its end": (lambda cells: text_of(each_but_study(cells))[:-1], {"broken_row": 1}),
    "a cell deleted with its comma": (lambda cells: text_of([*cells[:HURT], cells[HURT][:-2], *cells[HURT + 1 :]]),
                                      {"broken_row": 1}),
    "a unit in a cell": (put(ANGLE, "28.2 deg"), {"unreadable": 1}),
    "per cent": (put(ANGLE, "28 %"), {"unreadable": 1}),
    "an unknown unit in the heading": (headed((ANGLE, "angle (gon)")), {"unreadable": RUNS}),
    "two results of a run": (twice(ANGLE, "31.4"), {"two_results": 2}),
    "a level changed": (put(1, "0.45"), {"other_levels": 1}),
    "a level deleted": (put(2, ""), {"other_levels": 1}),
    "names moved on": (names_moved_on, {"other_levels": 12}),
    "another study's levels": (each(lambda row: [row[0], "0.9", *row[2:]] if row[0].startswith("rsm") else row),
                               {"other_levels": RUNS}),
    "a run that is not asked for": (put(0, "rsm 99"), {"unknown_run": 1}),
    "another stage's run": (put(0, "screen 3"), {"unknown_run": 1}),
    "a name deleted": (put(0, ""), {"unknown_run": 1}),
    "one of two responses": (put(BULK, ""), {"incomplete": 1}),
    "words": (put(ANGLE, "about 28"), {"unreadable": 1}),
    "a range": (put(ANGLE, "28-29"), {"unreadable": 1}),
    "an error of Excel's": (put(ANGLE, "#DIV/0!"), {"unreadable": 1}),
    "no number": (put(ANGLE, "NaN"), {"unreadable": 1}),
    "more than a number can be": (put(ANGLE, "1e400"), {"unreadable": 1}),
    "a comma with two meanings": (put(BULK, "1,234"), {"unreadable": 1}),
    "failed, nobody says why": (failed(REMARK, "failed"), {"no_reason": 1}),
    "failed with a result": (failed(REMARK, "failed: too wet", empty=False), {"failed_with_value": 1}),
    "merged cells": (workbook(merged), {"incomplete": 1}),
    "a formula that was not calculated": (cell("=A1*2"), {"unreadable": 1}),
    "a date that Excel made": (cell(datetime(2026, 2, 28)), {"unreadable": 1}),
    "a tick": (cell(True), {"unreadable": 1}),
    "a decimal point forgotten": (put(ANGLE, "295"), {"far_from_others": 1}),
    "a decimal point too early": (put(ANGLE, "2.9"), {"far_from_others": 1}),
    "a decimal point slipped twice": (twin_slips, {"far_from_others": 2}),
    "a minus": (put(ANGLE, "-28"), {"far_from_others": 1}),
    "a zero": (put(ANGLE, "0"), {"far_from_others": 1}),
    "one digit too many of the second response": (put(BULK, "6900"), {"far_from_others": 1}),
    "two columns exchanged": (exchanged, {"far_from_others": 1}),
    **{f"the value under column {place}": (moved(place), {"wrong_column": 1}) for place in (0, 1, *range(WHO, 10))},
}  # fmt: skip


@pytest.mark.parametrize("damage", REFUSED)
def test_refused_with_row_and_remedy(damage: str, heap: Study, sheet: Cells, tmp_path: Path) -> None:
    """The other rows are taken; the right sheet, entered after it, fills the gap."""
    whole, folder = text_of(sheet), StudyFolder(tmp_path / "study")
    change, kinds = REFUSED[damage]
    found = entered(heap, folder, change(sheet))
    assert Counter(one.kind for one in found.refused) == kinds
    runs = {one.place for one in found.refused}
    taken = RUNS - len(runs) + (1 if "two_results" in kinds else 0)
    assert len(found.taken) == len(recorded(folder)) == taken
    for one in found.refused:
        assert str(one).startswith(f"{one.place}: ") and one.place.split(":")[1].isdigit() and "; " in str(one)
    after = entered(heap, folder, whole)
    assert (len(after.known), len(after.taken), after.refused) == (taken, RUNS - taken, ())


def test_a_value_far_off_is_recorded_once_it_is_confirmed(heap: Study, sheet: Cells, tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "study")
    sheet[HURT][ANGLE] = "295"
    (question,) = entered(heap, folder, text_of(sheet)).refused
    assert all(text in str(question) for text in ("angle = 295°", "23° to 36.2°", "`confirmed`"))
    sheet[HURT][REMARK] = "Confirmed: stones in it"
    found = entered(heap, folder, text_of(sheet))
    assert (found.taken, len(found.known), found.refused) == ((sheet[HURT][0],), RUNS - 1, ())


def test_few_values_and_another_condition_are_no_reason_to_ask(heap: Study, sheet: Cells, tmp_path: Path) -> None:
    """Of a design three others do not show its range; those of the climb to a far target would be asked about."""
    folder = StudyFolder(tmp_path / "study")
    first = [sheet[0], *sheet[1:3], [*sheet[3][:ANGLE], "120", *sheet[3][BULK:]]]
    found = entered(heap, folder, text_of(first))
    assert (len(found.taken), found.refused) == (3, ())


@pytest.mark.parametrize(
    ("place", "text"), [(WHO, "20231234"), (WHO, "Li 28.3"), (WHO + 1, "46082"), (REMARK, "4"), (1, ""), (1, "0,4")]
)
def test_cells_of_a_row_that_waits_may_have_other_numbers(
    place: int, text: str, heap: Study, sheet: Cells, tmp_path: Path
) -> None:
    """A staff number, the number of a date, a count; a level with a decimal comma."""
    row = sheet[HURT]
    text = row[1].replace(".", ",") if text == "0,4" else text
    row[place], row[ANGLE], row[BULK] = text, "", ""
    found = entered(heap, StudyFolder(tmp_path / "study"), text_of(sheet))
    assert (len(found.taken), found.refused) == (RUNS - 1, ())


UNREADABLE: dict[str, tuple[Callable[[Cells], str | bytes], str]] = {
    "no heading": (lambda cells: text_of(cells[1:]), "no row contains the `run` heading; fill in the sheet"),
    "a response deleted": (
        each(lambda row: [*row[:ANGLE], *row[BULK:]]),
        "no column has the heading angle (deg); use the headings",
    ),
    "a factor deleted": (each(lambda row: [row[0], *row[2:]]), "no column has the heading sliding; use the headings"),
    "two columns of a response": (
        each(lambda row: [*row, row[ANGLE]]),
        "two columns have the heading 'angle (deg)'; delete",
    ),
    "another study's sheet": (headed((1, "density (kg/m3)")), "no column has the heading sliding"),
    "an empty file": (lambda _cells: "", "no row contains the `run` heading"),
    "a torn workbook": (lambda cells: workbook()(cells)[:3000], "cannot be read as an Excel workbook"),
    "two sheets alike": (workbook(with_a_copy), "several worksheets have a `run` heading"),
    "an old workbook": (lambda _cells: b"\xd0\xcf\x11\xe0" + bytes(500), "save the file as .xlsx or CSV"),
    "a picture": (lambda _cells: b"\x89PNG\r\n" + bytes(range(256)), "save the sheet as .xlsx or CSV"),
    "another study's name": (put(STUDY, "heap 2"), "sheet.csv:4: the sheet is for the study 'heap 2', not for 'heap'"),
}


@pytest.mark.parametrize("damage", UNREADABLE)
def test_refused_whole(damage: str, heap: Study, sheet: Cells, tmp_path: Path) -> None:
    change, said = UNREADABLE[damage]
    with pytest.raises(UsageError) as caught:
        entered(heap, StudyFolder(tmp_path / "study"), change(sheet))
    assert str(caught.value).startswith("sheet.csv") and said in str(caught.value)
    assert recorded(StudyFolder(tmp_path / "study")) == {}


def test_a_quote_that_is_left_open_swallows_no_rows(heap: Study, sheet: Cells, tmp_path: Path) -> None:
    lines = text_of(sheet).splitlines()
    lines[HURT] = lines[HURT].replace(",,heap", ',"too wet,heap')
    with pytest.raises(UsageError, match=r"sheet\.csv:"):
        entered(heap, StudyFolder(tmp_path / "study"), "\n".join(lines))


@pytest.mark.parametrize("where", [ANGLE, BULK, REMARK])
def test_a_run_that_failed_is_taken_as_that(where: int, heap: Study, sheet: Cells, tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "study")
    found = entered(heap, folder, failed(where, "Failed： too wet")(sheet))
    assert (len(found.taken), found.refused) == (RUNS, ())
    assert recorded(folder)[sheet[HURT][0]] == "too wet"


def test_foreign_rows_are_refused_at_the_first_or_by_their_number(heap: Study, tmp_path: Path) -> None:
    folder, head = StudyFolder(tmp_path / "study"), "run,sliding,rolling,wall,angle,bulk,study\n"
    for count, name, said in (
        (1_000, "rsm 1,0.4,0.2,0.2,28,690,hay", "sheet.csv:2: the sheet is for the study 'hay'"),
        (100_000, "rsm 99,0.4,0.2,0.2,28,690,", "sheet.csv:20001: the sheet has more than 20,000 rows"),
    ):
        with pytest.raises(UsageError, match=said):
            entered(heap, folder, head + f"{name}\n" * count)
    found = entered(heap, folder, head + "rsm 99,0.4,0.2,0.2,28,690,\n" * 100)
    with pytest.raises(UsageError, match="100 rows") as caught:
        found.require_all()
    assert len(str(caught.value).splitlines()) == 22 and str(caught.value).endswith("and 80 more")
