"""Finding a column by its name or number, and the factor that turns its unit into ours."""

from collections.abc import Collection, Sequence

from stemcal.errors import UsageError
from stemcal.measured.numerals import shown
from stemcal.measured.text_tables import TextTable
from stemcal.measured.vocabulary import OTHERS, is_called

_MOST_SHOWN = 12


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
    found = [i for i, name in enumerate(table.columns) if is_called(name, words) and not is_called(name, OTHERS)]
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
