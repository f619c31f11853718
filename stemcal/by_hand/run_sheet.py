"""Write the run sheet of a study as CSV, and read a filled-in sheet (CSV or xlsx) without checking its values."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Literal, Self

from stemcal.errors import UsageError
from stemcal.formats import counted, did_you_mean, listed
from stemcal.measured.cells import Line, decoded_table, workbook
from stemcal.solvers.protocol import Request
from stemcal.storage.plain import MIB
from stemcal.study.model.study import Study
from stemcal.vocabulary import Variable

RUN, REPLICATE, WHO, WHEN, REMARK, STUDY = "run", "replicate", "who", "when", "remark", "study"
FAILED = "failed"
_DIGITS = 10  # significant digits of a number in the sheet
MAX_BYTES, _MAX_ROWS = 10 * MIB, 20_000
_HEADING = re.compile(r"(.*?)\s*[(\[]([^()\[\]]*)[)\]]\s*")  # name and unit
_WIDE = {code: code - 0xFEE0 for code in range(0xFF01, 0xFF5F)} | {0x3000: 0x20}  # full-width characters

Kind = Literal["run", "factor", "condition", "replicate", "response", "origin", "study"]
_LEVEL_KINDS: tuple[Kind, ...] = ("factor", "condition", "replicate")
SheetRow = tuple[Request, Mapping[str, str | float]]  # a run, and its cells that are already known, by column name


@dataclass(frozen=True)
class Field:
    """A column of the sheet: name, unit, kind, and `content`, the text in every row of a column of kind `study`."""

    name: str
    unit: str
    kind: Kind
    content: str = ""

    @property
    def heading(self) -> str:
        """Heading of the column, such as ``force (N)``; only the name if there is no unit."""
        return f"{self.name} ({self.unit})" if self.unit not in ("", "1") else self.name

    def cell(self, run: Request) -> str | float:
        """Return the cell of a run in this column; empty if people fill in the column."""
        if self.kind == "factor":
            return run.levels[self.name]
        cells: dict[Kind, str | float] = {"run": run_name(run), "condition": run.condition, "replicate": run.replicate}
        return cells.get(self.kind, self.content)


def run_name(request: Request) -> str:
    """Return the name of a run in a sheet, such as ``screen 3``: the stage and the number of the row, from 1."""
    return f"{request.stage} {request.row + 1}"


def fields_of(study: Study) -> list[Field]:
    """Return the columns of the sheet of a study."""
    factors = [Field(f.name, f.unit, "factor") for f in study.factors]
    at = study.naming.condition
    conditions = [] if at is None else [Field(at.name, at.unit, "condition")]
    replicates = [Field(REPLICATE, "", "replicate")] if study.solver.repeats > 1 else []
    responses = [Field(response.name, response.unit, "response") for response in entered_responses(study)]
    columns = [Field(RUN, "", "run"), *factors, *conditions, *replicates, *responses]
    origin = [Field(name, "", "origin") for name in (WHO, WHEN, REMARK)]
    origin.append(Field(STUDY, "", "study", content=study.name))
    used = {field.name.casefold() for field in columns}  # a factor may be called `study`
    return [*columns, *(field for field in origin if field.name not in used)]


def entered_responses(study: Study) -> tuple[Variable, ...]:
    """Return the responses whose values people enter: the first, and those that are not from the cutting test."""
    return study.naming.response, *study.naming.others


def sheet_text(study: Study, rows: Sequence[SheetRow]) -> str:
    """Return the sheet as CSV, beginning with the byte order mark by which Excel recognises UTF-8."""
    fields, text = fields_of(study), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([field.heading for field in fields])
    for run, known in rows:
        cells = [known.get(field.name, field.cell(run)) for field in fields]
        writer.writerow([cell if isinstance(cell, str) else f"{cell:.{_DIGITS}g}" for cell in cells])
    return "\ufeff" + text.getvalue()


@dataclass(frozen=True)
class Filled:
    """The cells of a row in a filled-in sheet, as texts by the names of the columns.

    place     file and line
    values    responses
    levels    factors, condition and replicate
    origin    person, date, remark and study
    units     unit of each column
    decimal   decimal mark of the sheet
    broken    error of the row as a whole, such as a wrong number of cells; empty if there is none
    """

    place: str
    run: str
    values: dict[str, str]
    levels: dict[str, str]
    origin: dict[str, str]
    units: dict[str, str]
    decimal: str = "."
    broken: str = ""

    @property
    def run_name(self) -> str:
        """Name of the run in lower case and with single spaces, as the function `run_name` returns it."""
        return " ".join(self.run.split()).casefold()

    @property
    def remark(self) -> str:
        return self.origin.get(REMARK, "")

    @property
    def is_empty(self) -> bool:
        """Whether the row has no result yet."""
        return not any(self.values.values()) and not self.remark.casefold().startswith(FAILED) and not self.broken

    def without_empty_levels(self) -> Self:
        return replace(self, levels={name: text for name, text in self.levels.items() if text})


def narrow(text: str) -> str:
    """Replace full-width letters, digits and signs, which Chinese input methods write, by ASCII; strip spaces."""
    return text.translate(_WIDE).strip()


def filled(content: bytes, source: str, study: Study, *, partial: bool = False) -> list[Filled]:
    """Return the rows of a sheet; `UsageError` if columns are missing (except levels if `partial`)."""
    if len(content) > MAX_BYTES:
        message = f"{source} is larger than {MAX_BYTES // MIB} MiB; save the worksheet with the runs as a separate file"
        raise UsageError(message)
    if (sheets := workbook(content, source)) is not None:
        return _filled_rows(_lines_of_workbook(sheets, source), source, study, partial)
    text = decoded_table(content, None, Path(source))[0]
    if "\0" in text:
        raise UsageError(f"{source} is not a text file; save the sheet as .xlsx or CSV")
    return _filled_rows(_split(text, source), source, study, partial, complete=text.endswith(("\n", "\r")))


def rows_from_mappings(rows: Sequence[Mapping[str, Any]], study: Study) -> list[Filled]:
    """Convert mappings (column name to cell) to rows; the key ``failed`` contains the reason of a failed run."""
    fields = fields_of(study)
    lines = [(0, [field.heading for field in fields])]
    lines += [(number, _cells(row, f"row {number}", fields)) for number, row in enumerate(rows, 1)]
    filled_rows = _filled_rows(lines, "row", study, partial=True)
    return [replace(row.without_empty_levels(), place=row.place.replace(":", " ")) for row in filled_rows]


def _cells(row: object, place: str, fields: Sequence[Field]) -> list[str]:
    if not isinstance(row, Mapping) or not isinstance(row.get(RUN), str):
        raise UsageError(f'{place}: the run has no name; write a mapping such as {{"run": "screen 1", "force": 12.5}}')
    names = [field.name for field in fields]
    for name in row:
        if name not in (*names, FAILED):
            raise UsageError(f"{place}: no column {name!r:.60}; {did_you_mean(str(name), names)}")
    cells = {name: "" if row.get(name) is None else str(row[name]).strip() for name in names}
    reason = row.get(FAILED)
    if reason is not None and reason is not False:
        cells[REMARK] = f"{FAILED}: {reason if isinstance(reason, str) else ''}"
    return [cells[name] for name in names]


Lines = Sequence[tuple[int, Sequence[str]]]


def _lines_of_workbook(rows_of: Mapping[str, Sequence[Line]], source: str) -> Lines:
    """Return the rows of the worksheet with a `run` heading, padded to the same width; empty if there is none."""
    sheets: list[tuple[str, Lines]] = []
    for title, rows in rows_of.items():
        width = max((len(row.cells) for row in rows), default=0)
        lines = [(number, [*row.cells, *[""] * (width - len(row.cells))]) for number, row in enumerate(rows, 1)]
        if _head(lines) is not None:
            sheets.append((title, lines))
    if len(sheets) > 1:
        titles = listed([title for title, _ in sheets])
        message = f"{source}: several worksheets have a `{RUN}` heading ({titles}); keep only one of these worksheets"
        raise UsageError(message)
    return sheets[0][1] if sheets else []


def _split(text: str, source: str) -> Lines:
    ways: list[Lines] = []
    for separator in (",", ";", "\t"):
        reader = csv.reader(text.splitlines(keepends=True), delimiter=separator, strict=True)
        try:
            ways.append([(reader.line_num, cells) for cells in islice(reader, _MAX_ROWS + 1)])
        except csv.Error as error:
            message = f"{source}:{reader.line_num}: the line is not valid CSV ({error}); correct the line"
            raise UsageError(message) from None
    return max(ways, key=lambda lines: 0 if (head := _head(lines)) is None else len(lines[head][1]))


def _head(lines: Lines) -> int | None:
    return next((i for i, (_, cells) in enumerate(lines) if RUN in [narrow(c).casefold() for c in cells]), None)


def _filled_rows(lines: Lines, source: str, study: Study, partial: bool, complete: bool = True) -> list[Filled]:
    head = _head(lines)
    if head is None:
        raise UsageError(f"{source}: no row contains the `{RUN}` heading; fill in the sheet that stemcal wrote")
    columns, units = _columns(lines[head][1], source, study, partial)
    rows = [(number, cells) for number, cells in lines[head + 1 :] if any(cell.strip() for cell in cells)]
    factors = [column for column in columns if column.kind == "factor"]
    numbers = [cells[columns[c]] for _, cells in rows for c in factors if columns[c] < len(cells)]
    decimal = "," if any("," in n for n in numbers) and not any("." in n for n in numbers) else "."
    if len(lines) > _MAX_ROWS:
        raise UsageError(f"{source}:{lines[-1][0]}: the sheet has more than {_MAX_ROWS:,} rows; delete unrelated rows")
    width = len(lines[head][1])
    cut = None if complete or not rows or narrow(rows[-1][1][-1]) == narrow(study.name) else rows[-1][0]
    return [
        Filled(
            place=f"{source}:{number}",
            run=_cells_of_kind(cells, columns, "run")[RUN],
            values=_cells_of_kind(cells, columns, "response"),
            levels=_cells_of_kind(cells, columns, *_LEVEL_KINDS),
            origin=_cells_of_kind(cells, columns, "origin", "study"),
            units=units,
            decimal=decimal,
            broken=_broken(len(cells), width, number == cut),
        )
        for number, cells in rows
    ]


def _broken(cells: int, width: int, cut: bool) -> str:
    if cells > width:
        return f"the row has {cells} cells, but the header row has {width}; put quotes around cells that contain commas"
    if cells < width:
        return f"the row has only {counted(cells, 'cell')}, but the header row has {width}; complete the row"
    message = "the last line may be truncated because it has no line break; check the line and add a line break"
    return message if cut else ""


def _columns(head: Sequence[str], source: str, study: Study, partial: bool) -> tuple[dict[Field, int], dict[str, str]]:
    fields, places, units = fields_of(study), {}, {}
    wanted = {field.name.casefold(): field for field in fields}
    for i, cell in enumerate(head):
        heading = narrow(cell)
        match = _HEADING.fullmatch(heading)
        title, unit = (match[1], match[2].strip()) if match else (heading, "")
        column = wanted.get(title.casefold())
        if column is not None and column in places:
            raise UsageError(f"{source}: two columns have the heading {column.heading!r}; delete one of the columns")
        if column is not None:
            places[column] = i
            units[column.name] = unit or column.unit
    optional = ("origin", "study", *(_LEVEL_KINDS if partial else ()))
    missing = [column.heading for column in fields if column not in places and column.kind not in optional]
    if missing:
        raise UsageError(
            f"{source}: no column has the heading {listed(missing)}; use the headings of the sheet that stemcal wrote"
        )
    return places, units


def _cells_of_kind(cells: Sequence[str], columns: Mapping[Field, int], *kinds: Kind) -> dict[str, str]:
    places = {column.name: place for column, place in columns.items() if column.kind in kinds}
    return {name: narrow(cells[place]) if place < len(cells) else "" for name, place in places.items()}
