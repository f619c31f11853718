"""Units by name: what people write ("100 mm/min") to the internal system and back.

Inside stemcal everything is mm, tonne, s, N, MPa, and angles are degrees. The table is small on purpose:
a unit that is not in it is an error with a suggestion, never an expression to be evaluated.

>>> parse("100 mm/min", "speed")
1.6666666666666667
>>> convert(1100, "kg/m3")
1.1e-09
"""

from __future__ import annotations

import difflib
import math
import re
from typing import NamedTuple

from stemcal.errors import UsageError

__all__ = ["INTERNAL", "Unit", "UnitError", "convert", "from_internal", "parse", "parse_unit", "units_of"]


class UnitError(UsageError):
    """A text that is no quantity, with the remedy apart so that a report can show it."""

    def __init__(self, message: str, remedy: str = "") -> None:
        self.message, self.remedy = message, remedy
        super().__init__(f"{message}; {remedy}" if remedy else message)

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (self.message, self.remedy)


class Unit(NamedTuple):
    """One unit: internal value = value · numerator / denominator."""

    name: str
    dimension: str
    numerator: float
    denominator: float = 1.0


INTERNAL = {
    "length": "mm",
    "mass": "t",
    "time": "s",
    "force": "N",
    "stress": "MPa",
    "density": "t/mm3",
    "speed": "mm/s",
    "angle": "deg",
    "energy": "mJ",
    "toughness": "N/mm",
    "rate": "1/s",
    "decay": "s/mm",
    "dimensionless": "1",
}

_UNITS = (
    Unit("mm", "length", 1),
    Unit("um", "length", 1, 1000),
    Unit("cm", "length", 10),
    Unit("m", "length", 1000),
    Unit("in", "length", 25.4),
    Unit("t", "mass", 1),
    Unit("kg", "mass", 1, 1000),
    Unit("g", "mass", 1, 1e6),
    Unit("s", "time", 1),
    Unit("ms", "time", 1, 1000),
    Unit("us", "time", 1, 1e6),
    Unit("min", "time", 60),
    Unit("h", "time", 3600),
    Unit("N", "force", 1),
    Unit("mN", "force", 1, 1000),
    Unit("kN", "force", 1000),
    Unit("kgf", "force", 9.80665),
    Unit("MPa", "stress", 1),
    Unit("Pa", "stress", 1, 1e6),
    Unit("kPa", "stress", 1, 1000),
    Unit("GPa", "stress", 1000),
    Unit("N/mm2", "stress", 1),
    Unit("t/mm3", "density", 1),
    Unit("kg/m3", "density", 1, 1e12),
    Unit("g/cm3", "density", 1, 1e9),
    Unit("mm/s", "speed", 1),
    Unit("mm/min", "speed", 1, 60),
    Unit("cm/s", "speed", 10),
    Unit("m/s", "speed", 1000),
    Unit("m/min", "speed", 1000, 60),
    Unit("deg", "angle", 1),
    Unit("rad", "angle", 180, math.pi),
    Unit("mJ", "energy", 1),
    Unit("J", "energy", 1000),
    Unit("N/mm", "toughness", 1),
    Unit("kJ/m2", "toughness", 1),
    Unit("J/m2", "toughness", 1, 1000),
    Unit("mJ/mm2", "toughness", 1),
    Unit("1/s", "rate", 1),
    Unit("1/ms", "rate", 1000),
    Unit("1/min", "rate", 1, 60),
    Unit("s/mm", "decay", 1),
    Unit("s/m", "decay", 1, 1000),
    Unit("1", "dimensionless", 1),
    Unit("%", "dimensionless", 1, 100),
)
_BY_NAME = {unit.name: unit for unit in _UNITS}
_ALIASES = {
    "tonne": "t",
    "tonne/mm3": "t/mm3",
    "sec": "s",
    "inch": "in",
    "degree": "deg",
    "degrees": "deg",
    "s-1": "1/s",
    "ms-1": "1/ms",
    "min-1": "1/min",
    "-": "1",
}
_SIGNS = str.maketrans(
    {"²": "2", "³": "3", "¹": "1", "⁻": "-", "−": "-", "^": "", "µ": "u", "μ": "u", "°": "deg", " ": ""}
)
_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER})[ \t]*(\S.*)?", re.ASCII)
_LONGEST = 60


def units_of(dimension: str) -> tuple[str, ...]:
    """Names of the units of one dimension, the internal one first."""
    return tuple(unit.name for unit in _UNITS if unit.dimension == dimension)


def parse_unit(text: str, dimension: str | None = None) -> Unit:
    """Return the unit called `text`; raise `UnitError` if there is none or it measures something else."""
    name = text.strip().translate(_SIGNS)
    unit = _BY_NAME.get(_ALIASES.get(name, name))
    if unit is None:
        raise UnitError(f"unknown unit {_shown(text)}", _suggest(name, dimension))
    if dimension is not None and unit.dimension != dimension:
        raise UnitError(f"{unit.name} is a unit of {unit.dimension}, not of {dimension}", _use(dimension))
    return unit


def convert(value: float, unit: str, dimension: str | None = None) -> float:
    """Convert `value` in `unit` to the internal unit of the same dimension."""
    known = parse_unit(unit, dimension)
    return value * known.numerator / known.denominator


def from_internal(value: float, unit: str) -> float:
    """Convert an internal value back to `unit`."""
    known = parse_unit(unit)
    return value * known.denominator / known.numerator


def parse(text: str, dimension: str) -> float:
    """Read a quantity such as ``"8 mm"`` and return it in the internal unit of `dimension`."""
    match = _QUANTITY.fullmatch(text.strip().replace("−", "-")) if len(text) <= _LONGEST else None
    if match is None:
        raise UnitError(f"{_shown(text)} is not a number with a unit", _example(text, dimension))
    number, unit = float(match[1]), match[2]
    if unit is None:
        raise UnitError(f"{match[1]} has no unit", f'write "{match[1]} {INTERNAL[dimension]}"')
    if re.match(r",[0-9]", unit):
        raise UnitError(f"{_shown(text)} has a decimal comma", "use a point, as in 37.5")
    value = convert(number, unit, dimension)
    if not math.isfinite(value):
        raise UnitError(f"{_shown(text)} is too large for a computer number", "check the exponent")
    return value


def _example(text: str, dimension: str) -> str:
    return f'write a number and a unit, such as "1 {INTERNAL[dimension]}"'


def _use(dimension: str) -> str:
    return "use " + ", ".join(units_of(dimension))


def _suggest(name: str, dimension: str | None) -> str:
    names = units_of(dimension) if dimension else tuple(_BY_NAME)
    for known in names:
        if known.lower() == name.lower():
            return f"did you mean {known}?"
    near = difflib.get_close_matches(name[:_LONGEST], names, n=1)
    if near:
        return f"did you mean {near[0]}?"
    return _use(dimension) if dimension else "use one of " + ", ".join(names)


def _shown(text: str) -> str:
    return repr(text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "...")
