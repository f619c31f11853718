"""Studies done by hand, their sheets and tables that fill them in."""

import csv
import io
from collections.abc import Callable, Sequence
from pathlib import Path

from stemcal.by_hand.entering import Entered, advance_study, awaited_runs, record_results
from stemcal.by_hand.run_sheet import filled, sheet_text
from stemcal.runs.study_folder import StudyFolder
from stemcal.study.model.study import Study

ROOT = Path(__file__).parents[2]
Cells = list[list[str]]
PRINTED: Cells = list(csv.reader((ROOT / "configs" / "data" / "paper-forces.csv").read_text("utf-8").splitlines()))


def paper_by_hand(folder: Path) -> Path:
    """Write the paper's study with its forces to be entered, its designs in the printed order; return the spec."""
    spec = folder / "paper-replay.yaml"
    spec.write_bytes((ROOT / "configs" / "paper-replay.yaml").read_bytes())
    (folder / "data").mkdir()
    head, *rows = PRINTED
    asked = [[*row[:-1], ""] for row in rows if not row[0].startswith("validate")]
    (folder / "data" / "paper-forces.csv").write_text(text_of([head, *asked]), encoding="utf-8")
    return spec


def printed_force(stage: str, number: int, _diameter: str) -> str:
    """Return the force that the paper printed of a run."""
    return next(row[-1] for row in PRINTED if row[0] == f"{stage} {number}")


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
        waiting = advance_study(study, folder)
        runs = [] if waiting is None else awaited_runs(study, folder, waiting)
    return cells_of(sheet_text(study, [(run, {}) for run in runs])) if runs else []


def entered(study: Study, folder: StudyFolder, sheet: str | bytes, because: str = "") -> Entered:
    """Enter a sheet."""
    content = sheet.encode() if isinstance(sheet, str) else sheet
    with folder:
        return record_results(study, folder, filled(content, "sheet.csv", study), replace_because=because)
