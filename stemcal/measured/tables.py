"""Read tables as testing machines write them; encoding, separator and decimal mark are detected or specified.

A file is read as lines of cells. The data of a table are its longest run of lines that have the same number of cells
and at least one number. After the first few lines of a run, a line may be shorter, because some machines omit the
separators after the last filled cell. A workbook may contain a table on each of its sheets.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.formats import counted
from stemcal.measured import headings
from stemcal.measured.cells import MAX_BYTES, Line, decoded_table, split, workbook
from stemcal.notes import Note, Remedy
from stemcal.storage.plain import read_plain

_SEPARATORS = {"tab": "\t", "semicolon": ";", "comma": ",", "space": " "}
_DECIMALS = {"point": ".", "comma": ","}
_MOST_SHOWN = 12  # largest number of columns listed in a message
_PROBED = 3000  # lines from which the separator and the decimal mark are detected
_MOST_ABOVE = 4  # lines of headings, symbols and units above the data
_SAMPLE = 20  # rows of data from which the columns of numbers are detected
_SETTLED = 3  # lines of full width after which shorter lines are part of the run


@dataclass(frozen=True)
class Form:
    """The format of a file; entries that are None are detected. `sheet` is the title of the worksheet to read."""

    encoding: str | None = None
    separator: str | None = None
    decimal: str | None = None
    sheet: str | None = None


@dataclass(frozen=True)
class TextTable:
    """The cells of a table as texts, with the detected form of the file.

    preamble         lines above the headings
    columns, units   name and unit of each column; without headings, its number and an empty unit
    unread           number of other lines of numbers outside the table
    labels           text above the heading of each column, such as the name of a specimen; may be empty
    headed           whether the table has headings
    sheet            title of the worksheet; empty for a text file
    stated           all units in the lines above the headings, of any quantity
    """

    source: str
    form: Form
    preamble: tuple[str, ...]
    columns: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    unread: int = 0
    labels: tuple[str, ...] = ()
    headed: bool = True
    sheet: str = ""
    stated: tuple[str, ...] = ()

    def values(self, column: int) -> list[float | None]:
        """Return the cells of a column as numbers; None for a cell that is empty or a word."""
        return [headings.as_number(cells[column], self.form.decimal or ".") for cells in self.rows]

    def numbers(self, column: int) -> list[float]:
        """Return a column of numbers; raise `UsageError` with the row of the first cell that is not a number."""
        values = self.values(column)
        if None in values:
            row = values.index(None)
            place = f"{self.source}: data row {row + 1}, {headings.quoted(self.columns[column])[1:-1]}"
            raise UsageError(f"{place}: {headings.quoted(self.rows[row][column])} is not a number")
        return [value for value in values if value is not None]

    @property
    def synthetic(self) -> bool:
        """Whether the file declares that its data are synthetic."""
        return any("synthetic" in line.lower() for line in self.preamble)


def read_table(path: Path, form: Form = Form()) -> TextTable:
    """Return the only table in a file; raise `UsageError` if there is none or if several sheets have one."""
    tables = read_tables(path, form)
    if len(tables) > 1:
        titles = ", ".join(headings.quoted(table.sheet) for table in tables)
        raise UsageError(f"{path}: several sheets contain tables ({titles}); choose a sheet with `--sheet`")
    return tables[0]


def read_tables(path: Path, form: Form = Form()) -> list[TextTable]:
    """Return the tables in a file: one of a text file, or one for each worksheet that contains numbers."""
    try:
        content = read_plain(path, MAX_BYTES)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; pass a readable data file") from None
    decimals = [_named(form.decimal, _DECIMALS, "--decimal")] if form.decimal else list(_DECIMALS.values())
    if (lines_of := workbook(content, str(path))) is None:
        if form.sheet is not None:
            raise UsageError(f"--sheet {headings.quoted(form.sheet)}: {path} is not a workbook; remove `--sheet`")
        text, encoding = decoded_table(content, form.encoding, path)
        return [_of_text(text.splitlines(), replace(form, encoding=encoding), path, decimals)]
    if form.sheet is not None and form.sheet not in lines_of:
        known = ", ".join(map(headings.quoted, lines_of))
        raise UsageError(f"{path}: the workbook has no sheet {headings.quoted(form.sheet)}; its sheets are {known}")
    tables = []
    for title in lines_of if form.sheet is None else [form.sheet]:
        # cells may contain numbers as texts, with either decimal mark
        decimal = max(decimals, key=lambda mark: _score(lines_of[title][:_PROBED], mark, ragged=True))
        tables.append(_table(lines_of[title], Form(None, None, decimal, title), f"{path} [{title}]", ragged=True))
    if not any(table.rows for table in tables):
        where = "the workbook" if form.sheet is None else f"sheet {headings.quoted(form.sheet)}"
        raise UsageError(f"{path}: no numeric rows found in {where}; use a sheet that contains measured values")
    return [table for table in tables if table.rows]


def _of_text(texts: Sequence[str], form: Form, path: Path, decimals: Sequence[str]) -> TextTable:
    separators = [_named(form.separator, _SEPARATORS, "--separator")] if form.separator else list(_SEPARATORS.values())
    # a comma can be both marks only if the numbers are in quotes
    has_quotes = any('"' in text for text in texts[:_PROBED])
    ways = [(s, d) for s in separators for d in decimals if s != d or has_quotes]
    if not ways:
        raise UsageError(
            "--decimal comma --separator comma: a comma can be both the decimal mark and the separator only if the "
            "numbers are in quotes; remove one of the options"
        )
    separator, decimal = max(ways, key=lambda way: _score(split(texts[:_PROBED], way[0]), way[1], ragged=way[0] != " "))
    table = _table(split(texts, separator), Form(form.encoding, separator, decimal), str(path), ragged=separator != " ")
    if not table.rows:
        how = "describe the format with `--separator`, `--decimal` and `--encoding`"
        raise UsageError(f"{path}: no numeric rows found; {how}")
    return table


def _named(value: str, known: dict[str, str], option: str) -> str:
    if value in known or value in known.values():
        return known.get(value, value)
    raise UsageError(f"{option} {headings.quoted(value)[1:-1]}: unknown value; use one of {', '.join(known)}")


# ---- the lines of data and the headings above them


class _Run(NamedTuple):
    """The data among the lines: index of the first line, index after the last, and number of cells in a full line."""

    begin: int
    end: int
    width: int


def _score(lines: Sequence[Line], decimal: str, ragged: bool) -> tuple[int, bool, int, int]:
    """Return a rating of a way to split lines into cells: (rows of data, heading as wide as data, numbers, columns)."""
    run = _data_run(lines, decimal, ragged)
    as_wide = 0 < run.begin < run.end and len(lines[run.begin - 1].cells) == run.width
    cells = (cell for line in lines[run.begin : run.end] for cell in line.cells)
    return run.end - run.begin, as_wide, sum(headings.as_number(cell, decimal) is not None for cell in cells), run.width


def _table(lines: Sequence[Line], form: Form, source: str, ragged: bool) -> TextTable:
    decimal = form.decimal or "."
    run = _data_run(lines, decimal, ragged)
    _refuse_broken(lines, run, decimal, source)
    apart = [*lines[: run.begin], *lines[run.end :]] if run.width > 1 else []
    above = _above(lines, run, decimal)
    columns, units, used = headings.names_and_units([lines[index].cells for index in above], run.width)
    top = above[used - 1] if used else run.begin
    over = next((line.cells for line in reversed(lines[:top]) if line.cells), ()) if used else ()
    return TextTable(
        source=source,
        form=form,
        preamble=tuple(line.text.strip() for line in lines[:top] if line.cells),
        columns=columns,
        units=units,
        rows=tuple(_filled(line.cells, run.width) for line in lines[run.begin : run.end] if line.cells),
        unread=sum(_is_data(line, len(line.cells), decimal) and len(line.cells) > 1 for line in apart),
        labels=_filled(over, run.width) if 2 <= len(over) <= run.width else (),
        headed=bool(used),
        sheet=form.sheet or "",
        stated=tuple(unit for line in lines[:top] for unit in headings.units_in(line.cells)),
    )


def _filled(cells: Sequence[str], width: int) -> tuple[str, ...]:
    return (*cells, *[""] * (width - len(cells)))


def _data_run(lines: Sequence[Line], decimal: str, ragged: bool) -> _Run:
    """Return the longest run of data; with `ragged`, shorter lines do not end a run."""
    best, most, begin, width, filled = _Run(0, 0, 0), 0, 0, 0, 0
    for index, line in enumerate(lines):
        absent = len(line.cells) == width and any(line.cells) and all(map(headings.is_missing, line.cells))
        if not line.cells or absent:
            continue  # neither an empty line nor one of missing values ends a run
        if line.remark or all(headings.as_number(cell, decimal) is None for cell in line.cells):
            width = filled = 0
            continue
        if len(line.cells) != width and not (ragged and filled >= _SETTLED and len(line.cells) < width):
            begin, width, filled = index, len(line.cells), 0
        filled += 1
        if filled > most:
            best, most = _Run(begin, index + 1, width), filled
    return _without_headings(lines, best)


def _is_number(cell: str) -> bool:
    """Test whether a cell is a number with either decimal mark; the mark of the file is not known yet."""
    return any(headings.as_number(cell, decimal) is not None for decimal in _DECIMALS.values())


def _without_headings(lines: Sequence[Line], run: _Run) -> _Run:
    """Return the run without headings at its beginning, which look like data if they contain a number (of a sensor)."""
    full = [index for index in range(run.begin, run.end) if lines[index].cells]
    sample = [lines[index].cells for index in full[_MOST_ABOVE:][:_SAMPLE] or full[-1:]]
    numeric = [all(map(_is_number, column)) for column in zip(*sample, strict=False)]
    begin = run.begin
    for index in full[:_MOST_ABOVE]:
        cells = lines[index].cells
        over = [cell for cell, below in zip(cells, numeric, strict=False) if below]
        if headings.is_heading(cells) and any(not _is_number(cell) and not headings.is_missing(cell) for cell in over):
            begin = index + 1
    return run._replace(begin=begin)


def _is_data(line: Line, width: int, decimal: str) -> bool:
    return len(line.cells) == width and all(headings.as_number(cell, decimal) is not None for cell in line.cells)


def _refuse_broken(lines: Sequence[Line], run: _Run, decimal: str, source: str) -> None:
    """Raise `UsageError` for a faulty line within the data: only the longer part would be read, with another maximum.

    Such a line has a different number of cells than the data on both sides. A line of words alone, as between two
    cycles of a test, is not an error.
    """
    for outwards in (range(run.end, len(lines)), range(run.begin - 1, -1, -1)):
        places = list(islice((i for i in outwards if lines[i].cells), 2))
        if run.width > 1 and len(places) == 2 and _is_data(lines[places[1]], run.width, decimal):
            odd, cells = lines[places[0]], len(lines[places[0]].cells)
            numbers = any(headings.as_number(cell, decimal) is not None for cell in odd.cells)
            open_quote = odd.text.count('"') % 2 == 1
            if not odd.remark and (numbers or open_quote or cells > run.width):
                raise UsageError(
                    f"{source}: line {places[0] + 1} and the adjacent lines differ in the number of cells ({cells} and "
                    f"{run.width}); correct or delete this line"
                )


def _above(lines: Sequence[Line], run: _Run, decimal: str) -> list[int]:
    """Return the indices of the lines above the data that may be headings or units, the nearest first.

    Such a line has a cell without a number for every column, or names a quantity or units. Ruled lines are skipped.
    """
    above: list[int] = []
    for index in range(run.begin - 1, -1, -1):
        cells = lines[index].cells
        if all(not cell.strip("-=_ ") for cell in cells):
            continue
        words = len(cells) == run.width and all(headings.as_number(cell, decimal) is None for cell in cells)
        while len(cells) > run.width and not cells[-1]:
            cells = cells[:-1]
        if not (words or (len(cells) <= run.width and headings.is_heading(cells))) or len(above) == _MOST_ABOVE:
            break
        above.append(index)
    # a remark above a single column is not a heading
    return [] if above and lines[above[0]].remark and run.width == 1 else above


# ---- columns of a quantity


def matching(table: TextTable, words: Sequence[str], known: Collection[str] = ()) -> list[int]:
    """Return the columns whose names contain one of the words; if some of them have a `known` unit, only these.

    Columns of stress, strain and speed are left out, because 应力 (stress) contains the word for force.
    """
    if not table.headed:
        return []
    is_called, others = headings.is_called, headings.NOT_MEANT
    named = [i for i, name in enumerate(table.columns) if is_called(name, words) and not is_called(name, others)]
    return [i for i in named if table.units[i] in known] or [i for i in named if not table.units[i]] or named


def rows_with_numbers(table: TextTable, *columns: int) -> tuple[TextTable, list[Note]]:
    """Return the table without the rows that have no value in one of the columns, and notes on the omitted rows.

    Omitted are rows with an empty cell or NaN, and the summary in words that a machine writes below the data. Rows
    with other words among the numbers remain, so that reading the numbers reports them as errors. Raises `UsageError`
    if a column has no number at all.
    """
    values = [table.values(column) for column in columns]
    for column, numbers in zip(columns, values, strict=True):
        if all(number is None for number in numbers):
            filled = (row[column] for row in table.rows if not headings.is_missing(row[column]))
            content = next(filled, "empty cells")
            where = f"{table.source}: column {headings.quoted(table.columns[column])}"
            raise UsageError(f"{where} contains {headings.quoted(content)} instead of numbers; export plain numbers")
    last = max((i for i, row in enumerate(zip(*values, strict=True)) if None not in row), default=-1)
    kept = [row for row in table.rows[: last + 1] if not any(headings.is_missing(row[column]) for column in columns)]
    notes: list[Note] = []
    if len(kept) < len(table.rows):
        omitted = counted(len(table.rows) - len(kept), "row")
        text = f"Rows without a number for force or displacement were omitted ({omitted})."
        notes.append(Note("rows_left_out", "info", text))
    if table.unread:
        text = f"Numeric rows outside the curve table were skipped ({counted(table.unread, 'row')})."
        remedy = Remedy("If the rows are a further curve, save the curve in a separate file.")
        notes.append(Note("rows_apart", "caution", text, remedy))
    return replace(table, rows=tuple(kept)), notes


def scale_of(
    table: TextTable, column: int, known: dict[str, float], default: str, unit: str | None = None, option: str = ""
) -> float:
    """Return the factor that converts a column to the unit `default`; `known` has the factors of all units.

    The `unit` replaces the one in the heading; `option` is the command-line option for it. Raises `UsageError` if the
    unit is unknown, or if the column has none and the lines above the data contain a unit other than `default`.
    """
    stated, where = unit or table.units[column], f"{table.source}: column {headings.quoted(table.columns[column])}"
    how = f"specify the unit with `{option}`" if option else "write the unit in its heading"
    others = [unit for unit in dict.fromkeys(table.stated) if known.get(unit, known[default]) != known[default]]
    if not stated and others:
        raise UsageError(f"{where} has no unit, but the lines above the data contain {', '.join(others)}; {how}")
    unit = stated or default
    for name, factor in known.items():
        if unit == name or (unit.lower() == name.lower() and name != "mN" and unit.lower() != "mn"):
            return factor
    raise UsageError(f"{where}: unknown unit {headings.quoted(unit)}; {how}, one of {', '.join(known)}")


def given_columns(table: TextTable, option: str, what: str) -> list[int]:
    """Return the columns that an option specifies by a name, or by names or numbers (from 1) separated by commas."""
    columns = []
    for part in [option] if option in table.columns else [part.strip() for part in option.split(",")]:
        if part in table.columns:
            columns.append(table.columns.index(part))
        elif part.isascii() and part.isdigit() and 1 <= int(part[:6]) <= len(table.columns):
            columns.append(int(part) - 1)
        else:
            there = f"its columns are {columns_of(table)}"
            raise UsageError(f"{table.source}: the table has no column {headings.quoted(part)} for {what}; {there}")
    return columns


def columns_of(table: TextTable) -> str:
    """Return the names of the columns for a message; without headings, the range of the numbers in each."""
    listed = [headings.quoted(name) for name in table.columns[:_MOST_SHOWN]]
    for column, name in enumerate(() if table.headed else table.columns[:_MOST_SHOWN]):
        values = [value for value in table.values(column) if value is not None]
        listed[column] = f"{name} ({min(values):g} to {max(values):g})" if values else f"{name} (no numbers)"
    more = len(table.columns) - len(listed)
    return ", ".join(listed) + (f" and {more} more" if more else "")
