"""Numbers as papers print them: whether a computed one agrees, and the tables of the published study."""

import csv
import re
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path

TABLES = Path(__file__).parent / "paper" / "data"


def read_printed(name: str) -> list[dict[str, str]]:
    """Return the rows of a printed table."""
    with (TABLES / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def agrees(printed: str, value: float) -> bool:
    """Compare at the printed digits; a half in the next digit may go either way.

    >>> agrees("16,225.35", 16225.352), agrees("<0.0001", 5e-8), agrees("-2.88", 2.883)
    (True, True, False)
    """
    number = Decimal(re.sub("[<>,%]", "", printed))
    if printed[0] in "<>":
        return value < float(number) if printed[0] == "<" else value > float(number)
    half = 0.5 * 10.0 ** int(number.as_tuple().exponent)
    return abs(value - float(number)) <= half * (1.0 + 1e-9) + 1e-15 * abs(value)


def differing(printed: Mapping[str, str], computed: Mapping[str, float]) -> dict[str, float]:
    """Return the computed values that differ from the printed ones of the same name."""
    return {name: computed[name] for name, text in printed.items() if not agrees(text, computed[name])}
