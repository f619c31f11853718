"""Terms of a response surface: their value at a point, and how they are written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from stemcal.report.numbers import fixed

ONE = "1"


def term_value(term: str, coded: Mapping[str, Any]) -> Any:
    """Return the value of a term where the factors have these coded values (numbers or arrays).

    >>> point = {"a": 2.0, "b": 3.0}
    >>> [term_value(term, point) for term in ("1", "a", "a:b", "b^2")]
    [1.0, 2.0, 6.0, 9.0]
    """
    if term == ONE:
        return 1.0
    if term.endswith("^2"):
        return coded[term.removesuffix("^2")] ** 2
    value: Any = 1.0
    for name in term.split(":"):
        value = value * coded[name]
    return value


def surface_value(coefficients: Sequence[Mapping[str, Any]], coded: Mapping[str, Any]) -> Any:
    """Return the force that a surface predicts at coded values (numbers or arrays), in N."""
    return sum(row["value"] * term_value(row["term"], coded) for row in coefficients)


def written(term: str, symbols: Mapping[str, str]) -> str:
    """Return a term as it stands in an equation.

    >>> written("yield_stress:failure_strain", {"yield_stress": "X4", "failure_strain": "X9"})
    'X4·X9'
    """
    if term.endswith("^2"):
        name = term.removesuffix("^2")
        return f"{symbols.get(name, name)}²"
    return "·".join(symbols.get(name, name) for name in term.split(":"))


def equation(coefficients: Sequence[Mapping[str, Any]], symbols: Mapping[str, str]) -> str:
    """Return the surface as an equation in coded units.

    >>> equation([{"term": "1", "value": 120.415}, {"term": "a^2", "value": -0.829}], {"a": "X9"})
    'F = 120.42 − 0.83·X9²'
    """
    text = ""
    for row in coefficients:
        value, term = row["value"], row["term"]
        size = fixed(abs(value)) + ("" if term == ONE else f"·{written(term, symbols)}")
        sign = "−" if value < 0.0 else "+"
        text += f" {sign} {size}" if text else f"{'−' if value < 0.0 else ''}{size}"
    return f"F = {text}"


def symbols_of(rsm: Mapping[str, Any]) -> dict[str, str]:
    """Return the symbol of every factor of a surface, its name where it has none."""
    return {entry["factor"]: entry.get("symbol") or entry["factor"] for entry in rsm["factors"]}
