"""CalculiX's ``.dat``: what ``*NODE PRINT`` and ``*EL PRINT`` have written, set by set and time by time.

A block is a heading such as `` forces (fx,fy,fz) for set TIP and time  0.1000000E+01``, an empty line and a row for
each node: its number, then its components. Totals have rows without a number.
"""

import re
from collections.abc import Iterator

from stemcal.solvers.programs.reductions import NoResult, Series, required_number

_SET = re.compile(r"(\S+) and time\s+(\S+)\s*")
# Summed over a set: what the set as a whole carries.
_SUMMED = "forces"


def printed_series(text: str, quantity: str, name: str, component: str, node: int | None = None) -> Series:
    """Return a component of a printed quantity over time.

    Raises
    ------
    NoResult
        ``no_result`` if it was not printed, ``bad_result`` if a row cannot be read or one of several must be chosen.
    """
    found = [block for block in _blocks(text) if block[0] == quantity and block[2] == name.upper()]
    if not found:
        there = ", ".join(sorted({f"{block[0]} of {block[2]}" for block in _blocks(text)})) or "nothing"
        raise NoResult("no_result", f"no {quantity} of set {name} was printed, only {there[:200]}")
    return Series([_value(block, component, node) for block in found], [block[3] for block in found])


_Block = tuple[str, list[str], str, float, list[str]]


def _blocks(text: str) -> Iterator[_Block]:
    """Yield quantity, names of components, set, time and rows of each block."""
    block: _Block | None = None
    for line in text.splitlines():
        if (heading := _heading(line)) is not None:
            if block is not None:
                yield block
            block = heading
        elif line.strip() and block is not None:
            block[4].append(line)
    if block is not None:
        yield block


def _heading(line: str) -> _Block | None:
    """Return a block without rows if the line is ``quantity (names) for set NAME and time T``."""
    before, for_set, after = line.partition(") for set ")
    quantity, bracket, names = before.rpartition(" (")
    found = _SET.fullmatch(after) if for_set and bracket else None
    if found is None or ")" in names or not quantity.strip():
        return None
    return (
        quantity.strip(),
        [part.strip() for part in names.split(",")],
        found[1].upper(),
        required_number(found[2]),
        [],
    )


def _value(block: _Block, component: str, node: int | None) -> float:
    quantity, names, name, time, rows = block
    place = f"{quantity} of {name} at {time:g}"
    if component not in names:
        raise NoResult("no_result", f"{place} have no component {component}, only {', '.join(names)}")
    numbered = [row.split() for row in rows]
    chosen = [row for row in numbered if node is None or row[0] == str(node)]
    numbers = 0 if quantity.startswith("total") or "elem" in names else 1
    if any(len(row) != numbers + len(names) for row in chosen):
        raise NoResult("bad_result", f"{place}: a row has not the {len(names)} numbers of its heading")
    values = [required_number(row[numbers + names.index(component)]) for row in chosen]
    if not values:
        raise NoResult("no_result", f"{place} have no node {node}" if node else f"{place} have no rows")
    if len(values) > 1 and quantity != _SUMMED:
        raise NoResult("bad_result", f"{place} have {len(values)} rows; name one as solver.result.node")
    return sum(values)
