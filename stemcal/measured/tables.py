"""Read tables as testing machines write them; encoding, separator and decimal mark are detected or specified."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from stemcal.errors import UsageError
from stemcal.formats import counted, listed
from stemcal.measured import cells, headings
from stemcal.notes import Note, Remedy
from stemcal.storage.plain import read_plain

_SEPARATORS = {"tab": "\t", "semicolon": ";", "comma": ",", "space": " "}
_MOST_SHOWN = 12  # largest number of columns listed in a message
_PROBED = 3000  # lines from which the separator and the decimal mark are detected


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
    stated           units of any quantity in the lines above the data
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
        return [cells.as_number(row[column], self.form.decimal or ".") for row in self.rows]

    def numbers(self, column: int) -> list[float]:
        """Return a column of numbers; raise `UsageError` with the row of the first cell that is not a number."""
        values = self.values(column)
        if None in values:
            row = values.index(None)
            place = f"{self.source}: data row {row + 1}, {cells.quoted(self.columns[column])[1:-1]}"
            raise UsageError(f"{place}: {cells.not_a_number(self.rows[row][column])}")
        return [value for value in values if value is not None]

    @property
    def synthetic(self) -> bool:
        """Whether the file declares that its data are synthetic."""
        return any("synthetic" in line.lower() for line in self.preamble)

    def matching(self, words: Sequence[str], known: Collection[str] = ()) -> list[int]:
        """Return the columns whose names contain one of the words; if some of them have a `known` unit, only these.

        Columns of stress, strain and speed are left out, because 应力 (stress) contains the word for force.
        """
        if not self.headed:
            return []
        is_called, others = headings.is_called, headings.NOT_MEANT
        named = [i for i, name in enumerate(self.columns) if is_called(name, words) and not is_called(name, others)]
        return [i for i in named if self.units[i] in known] or [i for i in named if not self.units[i]] or named

    def chosen(self, option: str, what: str) -> list[int]:
        """Return the columns specified by an option: one name, or names or numbers (from 1) separated by commas."""
        columns = []
        for part in [option] if option in self.columns else [part.strip() for part in option.split(",")]:
            if part in self.columns:
                columns.append(self.columns.index(part))
            elif part.isascii() and part.isdigit() and 1 <= int(part[:6]) <= len(self.columns):
                columns.append(int(part) - 1)
            else:
                there = f"its columns are {self.listed_columns()}"
                raise UsageError(f"{self.source}: the table has no column {cells.quoted(part)} for {what}; {there}")
        return columns

    def listed_columns(self) -> str:
        """Return the names of the columns for a message; without headings, the range of the numbers in each."""
        names = [cells.quoted(name) for name in self.columns[:_MOST_SHOWN]]
        for column, name in enumerate(() if self.headed else self.columns[:_MOST_SHOWN]):
            values = [value for value in self.values(column) if value is not None]
            names[column] = f"{name} ({min(values):g} to {max(values):g})" if values else f"{name} (no numbers)"
        more = len(self.columns) - len(names)
        return ", ".join(names) + (f" and {more} more" if more else "")

    def scale_of(
        self, column: int, known: dict[str, float], default: str, unit: str | None = None, option: str = ""
    ) -> float:
        """Return the factor that converts a column to the unit `default`; `known` has the factors of all units.

        The `unit` replaces the one in the heading; `option` is the command-line option for it. Raises `UsageError` if
        the unit is unknown, or if the column has none and the lines above the data have a unit other than `default`.
        """
        stated, where = unit or self.units[column], f"{self.source}: column {cells.quoted(self.columns[column])}"
        how = f"specify the unit with `{option}`" if option else "write the unit in its heading"
        others = [unit for unit in dict.fromkeys(self.stated) if known.get(unit, known[default]) != known[default]]
        if not stated and others:
            raise UsageError(f"{where} has no unit, but the lines above the data contain {', '.join(others)}; {how}")
        unit = stated or default
        for name, factor in known.items():
            if unit == name or (unit.lower() == name.lower() and name != "mN" and unit.lower() != "mn"):
                return factor
        raise UsageError(f"{where}: unknown unit {cells.quoted(unit)}; {how}: {listed(known)}")

    def with_numbers(self, *columns: int) -> tuple[Self, list[Note]]:
        """Return the table without the rows that have no value in one of the columns, and notes on the omitted rows.

        Omitted are rows with an empty cell or NaN, and a summary in words below the data. Rows with other words among
        the numbers remain: reading the numbers reports them. Raises `UsageError` if a column has no number at all.
        """
        values = [self.values(column) for column in columns]
        for column, numbers in zip(columns, values, strict=True):
            where = f"{self.source}: column {cells.quoted(self.columns[column])}"
            filled = [row[column] for row in self.rows if not cells.is_missing(row[column])]
            if formulas := [cell for cell in filled if cell.startswith("=")]:
                raise UsageError(f"{where}: {cells.not_a_number(formulas[0])}")
            if all(number is None for number in numbers):
                content = cells.quoted(filled[0] if filled else "empty cells")
                raise UsageError(f"{where} contains {content} instead of numbers; export plain numbers")
        last = max((i for i, row in enumerate(zip(*values, strict=True)) if None not in row), default=-1)
        kept = [row for row in self.rows[: last + 1] if not any(cells.is_missing(row[column]) for column in columns)]
        notes: list[Note] = []
        if len(kept) < len(self.rows):
            omitted = counted(len(self.rows) - len(kept), "row")
            text = f"Rows without a number for force or displacement were omitted ({omitted})."
            notes.append(Note("rows_left_out", "info", text))
        if self.unread:
            text = f"Numeric rows outside the curve table were skipped ({counted(self.unread, 'row')})."
            remedy = Remedy("If the rows are a further curve, save the curve in a separate file.")
            notes.append(Note("rows_apart", "caution", text, remedy))
        return replace(self, rows=tuple(kept)), notes


def read_table(path: Path, form: Form = Form()) -> TextTable:
    """Return the only table in a file; raise `UsageError` if there is none or if several sheets have one."""
    tables = read_tables(path, form)
    if len(tables) > 1:
        titles = ", ".join(cells.quoted(table.sheet) for table in tables)
        raise UsageError(f"{path}: several sheets contain tables ({titles}); choose a sheet with `--sheet`")
    return tables[0]


def read_tables(path: Path, form: Form = Form()) -> list[TextTable]:
    """Return the tables in a file: one of a text file, or one for each worksheet that contains numbers."""
    try:
        content = read_plain(path, cells.MAX_BYTES)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; pass a readable data file") from None
    decimals = [_named(form.decimal, cells.DECIMALS, "--decimal")] if form.decimal else list(cells.DECIMALS.values())
    if (lines_of := cells.workbook(content, str(path))) is None:
        if form.sheet is not None:
            raise UsageError(f"--sheet {cells.quoted(form.sheet)}: {path} is not a workbook; remove `--sheet`")
        text, encoding = cells.decoded_table(content, form.encoding, path)
        return [_of_text(text.splitlines(), replace(form, encoding=encoding), path, decimals)]
    if form.sheet is not None and form.sheet not in lines_of:
        known = ", ".join(map(cells.quoted, lines_of))
        raise UsageError(f"{path}: the workbook has no sheet {cells.quoted(form.sheet)}; its sheets are {known}")
    tables = []
    for title in lines_of if form.sheet is None else [form.sheet]:
        # cells may contain numbers as texts, with either decimal mark
        decimal = max(decimals, key=lambda mark: cells.score(lines_of[title][:_PROBED], mark, ragged=True))
        tables.append(_table(lines_of[title], Form(None, None, decimal, title), f"{path} [{title}]", ragged=True))
    if not any(table.rows for table in tables):
        where = "the workbook" if form.sheet is None else f"sheet {cells.quoted(form.sheet)}"
        texts = (cell for table in tables for line in lines_of[table.sheet] for cell in line.cells)
        reasons = (cells.not_a_number(text) for text in texts if text.startswith("="))
        no_rows = f"no numeric rows found in {where}; use a sheet that contains measured values"
        raise UsageError(f"{path}: {next(reasons, no_rows)}")
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
    lines_of = {separator: cells.split(texts[:_PROBED], separator) for separator in separators}
    separator, decimal = max(ways, key=lambda way: cells.score(lines_of[way[0]], way[1], ragged=way[0] != " "))
    form = Form(form.encoding, separator, decimal)
    table = _table(cells.split(texts, separator), form, str(path), ragged=separator != " ")
    if not table.rows:
        how = "describe the format with `--separator`, `--decimal` and `--encoding`"
        raise UsageError(f"{path}: no numeric rows found; {how}")
    return table


def _named(value: str, known: dict[str, str], option: str) -> str:
    if value in known or value in known.values():
        return known.get(value, value)
    raise UsageError(f"{option} {cells.quoted(value)[1:-1]}: unknown value; use one of {', '.join(known)}")


def _table(lines: Sequence[cells.Line], form: Form, source: str, ragged: bool) -> TextTable:
    run, above, unread = cells.find_data(lines, form.decimal or ".", ragged, source)
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
        unread=unread,
        labels=_filled(over, run.width) if 2 <= len(over) <= run.width else (),
        headed=bool(used),
        sheet=form.sheet or "",
        stated=tuple(unit for line in lines[:top] for unit in headings.units_in(line.cells)),
    )


def _filled(cells: Sequence[str], width: int) -> tuple[str, ...]:
    return (*cells, *[""] * (width - len(cells)))
