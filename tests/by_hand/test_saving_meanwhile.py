"""A user saves the sheet of the study folder while a command runs: at no moment is a saved value lost in silence."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from sheets import Cells, cells_of, text_of
from test_asking_and_telling import angle, command, spec_of

from stemcal.runs.study_folder import StudyFolder

pytestmark = pytest.mark.usefixtures("blank_figures")
RUNS, FIRST = 13, 7
_heard: list[Callable[[str], None]] = []


def _listen(event: str, arguments: tuple[Any, ...]) -> None:
    if _heard and event in ("open", "os.rename", "os.link", "os.remove"):
        places = " ".join(str(one) for one in arguments[:2])
        if "study" in places:
            act = _heard.pop()  # accesses of the user are no moments
            act(places)
            _heard.append(act)


sys.addaudithook(_listen)


@contextmanager
def saved_at(moment: int | None, save: Callable[[], object]) -> Iterator[list[str]]:
    """Save just before the n-th access to a file of the study folder; yield the accesses so far."""
    accesses: list[str] = []

    def act(places: str) -> None:
        accesses.append(places)
        if len(accesses) - 1 == moment:
            save()

    _heard.append(act)
    try:
        yield accesses
    finally:
        _heard.clear()


def begun(folder: Path) -> tuple[Path, Path, Cells]:
    """Begin a study whose sheet has 7 of 13 results; return spec, study folder and the sheet with all of them."""
    folder.mkdir()
    spec, out = spec_of(folder, replicates=""), folder / "study"
    assert command("run", spec, "--out", out).exit_code == 6
    head, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
    for row in rows:
        row[4] = f"{angle(dict(zip(head[1:4], map(float, row[1:4]), strict=True))):.6f}"
    assert len(rows) == RUNS
    save(out / "sheet.csv", [head, *rows[:FIRST], *([*row[:4], "", *row[5:]] for row in rows[FIRST:])])
    return spec, out, [head, *rows]


def save(sheet: Path, cells: Cells) -> None:
    """Save as spreadsheet programs do: a new file that replaces the sheet."""
    temporary = sheet.with_name("~save.tmp")
    temporary.write_text(text_of(cells), encoding="utf-8")
    temporary.replace(sheet)


def recorded(out: Path) -> list[Any]:
    folder = StudyFolder(out)
    records = [folder.peek(key) for key in folder.keys()]  # noqa: SIM118
    return [one for one in records if one is not None and one["request"]["stage"] == "rsm"]


@pytest.mark.parametrize("words", [("run",), ("rsm",), ("enter", "sheet.csv")], ids=" ".join)
def test_all_values_are_recorded_or_in_the_sheet(words: tuple[str, ...], tmp_path: Path) -> None:
    """The moments: each access to a sheet, and every sixtieth to another file of the study folder."""

    def done(name: str, moment: int | None) -> tuple[Path, Path, list[str]]:
        spec, out, cells = begun(tmp_path / name)
        others = [str(out / word) for word in words[1:]]
        with saved_at(moment, lambda: save(out / "sheet.csv", cells)) as accesses:
            assert command(words[0], spec, *others, "--out", out).exit_code in (0, 6)
        return spec, out, accesses

    accesses = done("first", None)[2]
    moments = [i for i, places in enumerate(accesses) if "sheet" in places or i % 60 == 0]
    assert len([places for places in accesses if "sheet" in places]) > 5
    for moment in moments:
        spec, out, _ = done(str(moment), moment)
        kept = [row[0] for row in cells_of((out / "sheet.csv").read_text("utf-8")) if row[0][:3] == "rsm" and row[4]]
        assert max(len(recorded(out)), len(kept)) == RUNS, accesses[moment]
        command("run", spec, "--out", out)
        assert len(recorded(out)) == RUNS, accesses[moment]


def test_a_rejected_row_saved_meanwhile_stays_in_the_sheet(tmp_path: Path) -> None:
    """The message names it; the sheet is not replaced, the other values are recorded."""
    spec, out, cells = begun(tmp_path / "first")
    with saved_at(None, lambda: None) as accesses:
        command("run", spec, "--out", out)
    moments = [i for i, places in enumerate(accesses) if "sheet" in places]
    for moment in moments[1:]:
        spec, out, cells = begun(tmp_path / str(moment))
        cells[9][4] = "28,8x"
        with saved_at(moment, lambda out=out, cells=cells: save(out / "sheet.csv", cells)):
            done = command("run", spec, "--out", out)
        if done.exit_code != 2:  # saved after the last access of the command
            done = command("run", spec, "--out", out)
        assert done.exit_code == 2 and f"sheet.csv:10: {cells[9][0]}, angle" in done.stderr
        assert cells_of((out / "sheet.csv").read_text("utf-8")) == cells and len(recorded(out)) == RUNS - 1


def test_a_replaced_sheet_is_named_and_remarks_on_open_runs_stay(tmp_path: Path) -> None:
    """A column that the user added is in the earlier sheet, whose place is printed."""
    spec, out, cells = begun(tmp_path / "study")
    head, *rows = cells
    rows[8] = [*rows[8][:4], "", "Ann", "", "in the oven", *rows[8][8:]]
    save(out / "sheet.csv", [[*head, "moisture"], *([*row, "11 %"] for row in rows)])
    done = command("run", spec, "--out", out)
    assert done.exit_code == 6 and "1 result from the rsm stage" in done.stderr
    after = {row[0]: row for row in cells_of((out / "sheet.csv").read_text("utf-8"))}
    assert after[rows[8][0]][4:8] == ["", "Ann", "", "in the oven"]
    (earlier,) = [path for path in (out / "sheets").iterdir() if str(path) in done.stderr]
    assert "11 %" in earlier.read_text("utf-8")
