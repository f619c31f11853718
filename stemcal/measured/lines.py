"""Lines of a table, split into cells, and where among them the numbers stand.

The data of a table are its longest run of lines with equally many cells and a number among them. Once a run has
settled, a line may be shorter: machines leave out the separators after the last cell that is filled.
"""

import csv
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple

from stemcal.measured.headings import as_number, names_and_units

_SETTLED = 3  # lines of full width after which a shorter one belongs to the run


class Line(NamedTuple):
    """A line as it stands in the file, its cells, and whether it is a remark (``# …``)."""

    text: str
    cells: Sequence[str]
    remark: bool = False


class DataRun(NamedTuple):
    """First line of the data, the line past the last, and how many cells a full line has."""

    begin: int
    end: int
    width: int


def split(texts: Sequence[str], separator: str) -> list[Line]:
    """Return lines of text with their cells."""
    lines = []
    for text in texts:
        remark = text.lstrip().startswith("#")
        lines.append(Line(text, cells_of(text.lstrip("# ") if remark else text, separator), remark))
    return lines


def cells_of(text: str, separator: str) -> list[str]:
    """Return the cells of a line; an empty line has none."""
    if not text.strip():
        return []
    if separator == " ":
        cells = text.split()
    elif '"' in text:  # a quoted cell may hold the separator
        cells = next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
    else:
        cells = text.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def data_run(lines: Sequence[Line], decimal: str, ragged: bool) -> DataRun:
    """Return the longest run of data; with `ragged`, shorter lines go on with it."""
    best, most, begin, width, filled = DataRun(0, 0, 0), 0, 0, 0, 0
    for index, line in enumerate(lines):
        if not line.cells:
            continue  # an empty line ends nothing
        if line.remark or all(as_number(cell, decimal) is None for cell in line.cells):
            width = filled = 0
            continue
        goes_on = len(line.cells) == width or (ragged and filled >= _SETTLED and len(line.cells) < width)
        if not goes_on:
            begin, width, filled = index, len(line.cells), 0
        filled += 1
        if filled > most:
            best, most = DataRun(begin, index + 1, width), filled
    return best


def data_rows(lines: Sequence[Line], run: DataRun) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a run, shorter ones filled up with empty cells."""
    for line in lines[run.begin : run.end]:
        if line.cells:
            yield (*line.cells, *[""] * (run.width - len(line.cells)))


def like_data(lines: Sequence[Line], width: int, decimal: str) -> int:
    """Return how many lines hold as many cells, all of them numbers."""
    return sum(
        len(line.cells) == width and all(as_number(cell, decimal) is not None for cell in line.cells) for line in lines
    )


def broken_line(lines: Sequence[Line], run: DataRun, decimal: str) -> int | None:
    """Return the line that cuts a table in two: of another number of cells, with like rows on both sides of it.

    A line of words alone, as between two cycles of a test, cuts nothing.
    """
    if run.width < 2:
        return None
    for outwards in (range(run.end, len(lines)), range(run.begin - 1, -1, -1)):
        places = list(islice((i for i in outwards if lines[i].cells), 2))
        if len(places) == 2 and like_data([lines[places[1]]], run.width, decimal):
            odd = lines[places[0]]
            numbers = any(as_number(cell, decimal) is not None for cell in odd.cells)
            open_quote = odd.text.count('"') % 2 == 1
            if not odd.remark and (numbers or open_quote or len(odd.cells) > run.width):
                return places[0]
    return None


class Heading(NamedTuple):
    """What stands over the data: a name, a unit and perhaps a label for each column, and on which line it begins."""

    columns: tuple[str, ...]
    units: tuple[str, ...]
    labels: tuple[str, ...]
    top: int
    found: bool


def heading_of(lines: Sequence[Line], run: DataRun, decimal: str) -> Heading:
    """Return the heading of a run: the line above it, a line of units between, a line of labels over that."""
    above: list[tuple[int, Sequence[str]]] = []
    for index in range(run.begin - 1, -1, -1):
        cells = lines[index].cells
        if not cells:
            continue
        if len(cells) != run.width or any(as_number(cell, decimal) is not None for cell in cells) or len(above) == 2:
            break
        above.append((index, cells))
    if above and lines[above[0][0]].remark and run.width == 1:
        above = []  # a remark, no name
    columns, units, taken = names_and_units([cells for _, cells in above], run.width)
    top = above[taken - 1][0] if taken else run.begin
    labels = _labels(lines, top, run.width) if taken else ()
    return Heading(columns, units, labels, top, bool(taken))


def _labels(lines: Sequence[Line], top: int, width: int) -> tuple[str, ...]:
    """Return the cells of the line over the heading if they may be names of specimens, else none."""
    cells = next((line.cells for line in reversed(lines[:top]) if line.cells), ())
    if not 2 <= len(cells) <= width:
        return ()
    return (*cells, *[""] * (width - len(cells)))
