"""Studies done by hand, their sheets and tables that fill them in."""

from __future__ import annotations

import csv
import io
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from stemcal.by_hand.awaited import gone_on, sheet_rows
from stemcal.by_hand.entering import Correction, Entered
from stemcal.by_hand.face import enter_filled
from stemcal.by_hand.reading import filled
from stemcal.by_hand.sheet import sheet_text
from stemcal.folder.study_folder import StudyFolder
from stemcal.study.model import Study

ROOT = Path(__file__).parents[2]
DATA = ROOT / "configs" / "data"
Cells = list[list[str]]


def paper_by_hand(folder: Path) -> Path:
    """Write the paper's study with its runs to be entered, its designs in the printed order; return the spec."""
    printed = (ROOT / "configs" / "paper-replay.yaml").read_text("utf-8")
    spec = folder / "paper-replay.yaml"
    manual = printed.replace("kind: table", "kind: manual").replace("  validate: data/validate.csv\n", "", 1)
    spec.write_text(manual, encoding="utf-8")
    shutil.copytree(DATA, folder / "data")
    return spec


def printed_force(stage: str, number: int, diameter: str) -> str:
    """Return the force that the paper printed of a run."""
    rows = list(csv.reader((DATA / f"{stage}.csv").read_text("utf-8").splitlines()))[1:]
    if stage == "validate":
        return next(row[-1] for row in rows if float(row[0]) == float(diameter))
    return rows[number - 1][-1]


def cells_of(text: str) -> Cells:
    """Return the cells of a sheet, its heading first."""
    return list(csv.reader(text.removeprefix("\ufeff").splitlines()))


def text_of(cells: Sequence[Sequence[str]], separator: str = ",") -> str:
    """Return cells as CSV."""
    text = io.StringIO()
    csv.writer(text, delimiter=separator, lineterminator="\n").writerows(cells)
    return text.getvalue()


def filled_in(cells: Cells, value: Callable[[str, int, str], str] = printed_force) -> Cells:
    """Fill in the response of every row: a function of stage, number and condition."""
    head, *rows = cells
    at = next(i for i, title in enumerate(head) if title.startswith("diameter"))
    response = head.index("who") - 1
    done = [[*row[:response], value(*_run(row[0]), row[at]), *row[response + 1 :]] for row in rows]
    return [head, *done]


def _run(name: str) -> tuple[str, int]:
    stage, number = name.split()
    return stage, int(number)


def awaited(study: Study, folder: StudyFolder) -> Cells:
    """Return the sheet of what a study waits for, its heading first; nothing at the end."""
    with folder:
        waiting = gone_on(study, folder)
        return [] if waiting is None else cells_of(sheet_text(study, sheet_rows(study, folder, waiting)))


def entered(study: Study, folder: StudyFolder, sheet: str | bytes, how: Correction = Correction()) -> Entered:
    """Enter a sheet."""
    content = sheet.encode() if isinstance(sheet, str) else sheet
    with folder:
        return enter_filled(study, folder, filled(content, "sheet.csv", study), how)
