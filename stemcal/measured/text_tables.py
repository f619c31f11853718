"""Tables as testing machines write them: encoding, separator and decimal mark are found out, or given.

A file is read as lines of cells; `lines` finds the numbers among them and what stands over them. A workbook may hold
a table on each of its sheets.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from stemcal.errors import UsageError
from stemcal.files.reading import MIB, open_plain
from stemcal.measured import sheets
from stemcal.measured.headings import NOT_MEANT, as_number, is_called, shown
from stemcal.measured.lines import Line, broken_line, data_rows, data_run, heading_of, like_data, split

SEPARATORS = {"tab": "\t", "semicolon": ";", "comma": ",", "space": " "}
DECIMALS = {"point": ".", "comma": ","}
MAX_BYTES = 64 * MIB
MAX_LINE = 50_000  # characters; no machine writes longer lines, however many specimens stand side by side
_MOST_SHOWN = 12  # columns in a message
_PROBED = 3000  # lines that decide on separator and decimal mark


@dataclass(frozen=True)
class Form:
    """How a file is written; what is None is found out. `sheet` names the one of a workbook that counts."""

    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None
    sheet: str | None = None


@dataclass(frozen=True)
class TextTable:
    """The cells of a file as texts, with the form it was found to have.

    Attributes
    ----------
    columns, units : tuple of str
        Name and unit of each column; without a heading, its number and no unit.
    labels : tuple of str
        What stands over the heading of each column, the name of a specimen perhaps; empty if there is nothing.
    headed : bool
        Whether there is a heading.
    sheet : str
        Title of the workbook's sheet, empty for a text.
    """

    source: str
    form: Form
    preamble: tuple[str, ...]
    columns: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    unread: int = 0  # lines of as many numbers that lie apart from these
    labels: tuple[str, ...] = ()
    headed: bool = True
    sheet: str = ""

    def number(self, row: int, column: int) -> float | None:
        """Return a cell as a number, None if it is empty or a word."""
        return as_number(self.rows[row][column], self.form.decimal or ".")

    def is_number(self, cell: str) -> bool:
        """Tell whether a cell holds a number."""
        return as_number(cell, self.form.decimal or ".") is not None

    def numbers(self, column: int) -> list[float]:
        """Return a column of numbers.

        Raises
        ------
        UsageError
            Naming the line of the first cell that is none.
        """
        values = []
        for row in range(len(self.rows)):
            value = self.number(row, column)
            if value is None:
                place = f"{self.source}: data row {row + 1}, {shown(self.columns[column])[1:-1]}"
                raise UsageError(f"{place}: {shown(self.rows[row][column])} is not a number")
            values.append(value)
        return values

    @property
    def synthetic(self) -> bool:
        """Whether the file says of itself that its data are made up."""
        return any("synthetic" in line.lower() for line in self.preamble)


def read_table(path: Path, form: Form = Form()) -> TextTable:
    """Return the one table in a file; raise `UsageError` if it holds none, or a workbook several."""
    tables = read_tables(path, form)
    if len(tables) > 1:
        titles = ", ".join(shown(table.sheet) for table in tables)
        raise UsageError(f"{path}: several sheets hold tables, {titles}; name one with --sheet")
    return tables[0]


def read_tables(path: Path, form: Form = Form()) -> list[TextTable]:
    """Return the tables in a file: one of a text, one for each sheet of a workbook that holds numbers."""
    content = _content(path)
    if sheets.is_workbook(content):
        return _of_workbook(content, path, form)
    if sheets.is_foreign(content):
        raise UsageError(
            f"{path} is a file of a spreadsheet program; open it there, save it as .xlsx or CSV, give that"
        )
    if form.sheet is not None:
        raise UsageError(f"--sheet {shown(form.sheet)}: {path} is no workbook")
    return [_of_text(content, path, form)]


def _content(path: Path) -> bytes:
    """Return the bytes of a file; one that is too long is refused before all of it is read."""
    content, lines = bytearray(), 0
    try:
        with open_plain(path) as file:
            while chunk := file.read(MIB):
                content += chunk
                lines += max(chunk.count(b"\n"), chunk.count(b"\r"))
                if len(content) > MAX_BYTES:
                    raise UsageError(f"{path} is larger than {MAX_BYTES // MIB} MiB; name the file of one specimen")
                if lines > sheets.MAX_LINES and not sheets.is_workbook(bytes(content[:4])):
                    raise sheets.too_long(str(path))
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; name the file of one specimen") from None
    return bytes(content)


def _of_workbook(content: bytes, path: Path, form: Form) -> list[TextTable]:
    """Return the tables of the sheets; numbers in cells have no decimal mark, numbers in texts may have a comma."""
    found = sheets.sheets(content, str(path))
    if form.sheet is not None:
        titles = [title for title, _ in found]
        if form.sheet not in titles:
            raise UsageError(f"{path}: no sheet {shown(form.sheet)}; there are {', '.join(map(shown, titles))}")
        found = [(title, lines) for title, lines in found if title == form.sheet]
    marks = [_named(form.decimal, DECIMALS, "--decimal")] if form.decimal else list(DECIMALS.values())
    tables = []
    for title, lines in found:
        decimal = max(marks, key=lambda mark: _score(lines[:_PROBED], mark, ragged=True))
        table = _table(lines, Form(None, None, decimal, title), f"{path} [{title}]", ragged=True)
        if table.rows:
            tables.append(table)
    if not tables:
        raise UsageError(f"{path}: no rows of numbers found on its sheets")
    return tables


def _of_text(content: bytes, path: Path, form: Form) -> TextTable:
    text, encoding = sheets.decoded(content, form.encoding, path)
    texts = text.splitlines()
    _refuse_long(texts, path)
    probed = texts[:_PROBED]
    separator, decimal = max(
        _candidates(form, texts), key=lambda pair: _score(split(probed, pair[0]), pair[1], ragged=pair[0] != " ")
    )
    table = _table(split(texts, separator), Form(encoding, separator, decimal), str(path), ragged=separator != " ")
    if not table.rows:
        raise UsageError(
            f"{path}: no rows of numbers found; say how the file is written with --separator, --decimal and --encoding"
        )
    return table


def _refuse_long(texts: Sequence[str], path: Path) -> None:
    for number, text in enumerate(texts, start=1):
        if len(text) > MAX_LINE:
            raise UsageError(
                f"{path}: line {number} has {len(text):,} characters; no testing machine writes such lines"
            )


def _table(lines: Sequence[Line], form: Form, source: str, ragged: bool) -> TextTable:
    decimal = form.decimal or "."
    run = data_run(lines, decimal, ragged)
    broken = broken_line(lines, run, decimal)
    if broken is not None:
        cells = len(lines[broken].cells)
        raise UsageError(
            f"{source}: line {broken + 1} has {cells} cells, those around it {run.width}; correct or delete it"
        )
    heading = heading_of(lines, run, decimal)
    return TextTable(
        source=source,
        form=form,
        preamble=tuple(line.text.strip() for line in lines[: heading.top] if line.cells),
        columns=heading.columns,
        units=heading.units,
        rows=tuple(data_rows(lines, run)),
        unread=like_data([*lines[: run.begin], *lines[run.end :]], run.width, decimal) if run.width > 1 else 0,
        labels=heading.labels,
        headed=heading.found,
        sheet=form.sheet or "",
    )


def _candidates(form: Form, texts: Sequence[str]) -> list[tuple[str, str]]:
    """Return the ways of splitting to be tried; a comma can be both marks only where numbers are quoted."""
    separators = [_named(form.separator, SEPARATORS, "--separator")] if form.separator else list(SEPARATORS.values())
    decimals = [_named(form.decimal, DECIMALS, "--decimal")] if form.decimal else list(DECIMALS.values())
    quoted = any('"' in text for text in texts[:_PROBED])
    ways = [(s, d) for s in separators for d in decimals if s != d or quoted]
    if not ways:
        raise UsageError(
            "--decimal comma --separator comma: a comma cannot be both unless the numbers are in quotes; "
            "leave one of them out"
        )
    return ways


def _named(given: str, known: dict[str, str], option: str) -> str:
    if given in known or given in known.values():
        return known.get(given, given)
    raise UsageError(f"{option} {shown(given)[1:-1]}: unknown; take one of {', '.join(known)}")


def _score(lines: Sequence[Line], decimal: str, ragged: bool) -> tuple[int, bool, int, int]:
    """Judge a way of splitting by the rows it finds, whether the header splits alike, the numbers, and the columns."""
    run = data_run(lines, decimal, ragged)
    alike = 0 < run.begin < run.end and len(lines[run.begin - 1].cells) == run.width
    cells = (cell for line in lines[run.begin : run.end] for cell in line.cells)
    return run.end - run.begin, alike, sum(as_number(cell, decimal) is not None for cell in cells), run.width


def find_column(
    table: TextTable,
    words: Sequence[str],
    what: str,
    remedy: str,
    given: str | None = None,
    known: Collection[str] = (),
) -> int:
    """Return the column that `given` names (or numbers from 1), else the first of those that `matching` gives.

    Raises
    ------
    UsageError
        Telling the columns there are, and the remedy.
    """
    if given is not None:
        return given_column(table, given, what)
    found = matching(table, words, known)
    if not found:
        raise UsageError(f"{table.source}: no column for {what} among {columns_of(table)}; {remedy}")
    return found[0]


def matching(table: TextTable, words: Sequence[str], known: Collection[str] = ()) -> list[int]:
    """Return the columns whose names hold one of the words: of several those with a unit that is `known`.

    Stress, strain and speeds are none: 应力 holds the word for force.
    """
    if not table.headed:
        return []
    found = [i for i, name in enumerate(table.columns) if is_called(name, words) and not is_called(name, NOT_MEANT)]
    return [i for i in found if table.units[i] in known] or [i for i in found if not table.units[i]] or found


def scale_of(table: TextTable, column: int, known: dict[str, float], default: str, given: str | None = None) -> float:
    """Return the factor that turns a column into `default` (N, mm or s)."""
    unit = given or table.units[column] or default
    for name, factor in known.items():
        if unit == name or (unit.lower() == name.lower() and name != "mN" and unit.lower() != "mn"):
            return factor
    where = f"{table.source}: column {shown(table.columns[column])}"
    raise UsageError(f"{where}: unknown unit {shown(unit)}; use one of {', '.join(known)}")


def given_column(table: TextTable, given: str, what: str) -> int:
    """Return the column of a name or number that was given."""
    if given in table.columns:
        return table.columns.index(given)
    if given.isascii() and given.isdigit() and len(given) < 6 and 1 <= int(given) <= len(table.columns):
        return int(given) - 1
    raise UsageError(f"{table.source}: no column {shown(given)} for {what}; there are {columns_of(table)}")


def given_columns(table: TextTable, given: str, what: str) -> list[int]:
    """Return the columns of one name, or of several numbers or names between commas."""
    parts = [given] if given in table.columns else [part.strip() for part in given.split(",")]
    return [given_column(table, part, what) for part in parts]


def columns_of(table: TextTable) -> str:
    """Return the names of the columns; of columns without names the range of their numbers."""
    names = table.columns[:_MOST_SHOWN]
    listed = [shown(name) if table.headed else f"{name} ({_range(table, i)})" for i, name in enumerate(names)]
    more = len(table.columns) - len(names)
    return ", ".join(listed) + (f" and {more} more" if more else "")


def _range(table: TextTable, column: int) -> str:
    values = [value for row in range(len(table.rows)) if (value := table.number(row, column)) is not None]
    return f"{min(values):g} to {max(values):g}" if values else "no numbers"
