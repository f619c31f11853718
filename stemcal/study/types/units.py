"""Conversion of quantities with units, such as "100 mm/min", to internal units and back.

The internal units are mm, tonne, s, N and MPa; angles are in degrees. A unit that is not in the table below is an error
with a suggestion; unit expressions are not evaluated.

>>> parse("100 mm/min", "speed")
1.6666666666666667
>>> convert(1100, "kg/m3")
1.1e-09
"""

import math
import re
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.formats import did_you_mean, listed


class UnitError(UsageError):
    """Raised for a text that is not a valid quantity; `message` and `remedy` can be shown separately."""

    def __init__(self, message: str, remedy: str = "") -> None:
        self.message, self.remedy = message, remedy
        super().__init__(f"{message}; {remedy}" if remedy else message)


class Unit(NamedTuple):
    """One unit: internal value = value · numerator / denominator."""

    name: str
    dimension: str
    numerator: float
    denominator: float


# Numerator and denominator of the factor from each unit to the internal unit, by dimension; the internal unit is first.
_TABLE: dict[str, dict[str, tuple[float, float]]] = {
    "length": {"mm": (1, 1), "um": (1, 1000), "cm": (10, 1), "m": (1000, 1), "in": (25.4, 1)},
    "mass": {"t": (1, 1), "kg": (1, 1000), "g": (1, 1e6)},
    "time": {"s": (1, 1), "ms": (1, 1000), "us": (1, 1e6), "min": (60, 1), "h": (3600, 1)},
    "force": {"N": (1, 1), "mN": (1, 1000), "kN": (1000, 1), "kgf": (9.80665, 1)},
    "stress": {"MPa": (1, 1), "Pa": (1, 1e6), "kPa": (1, 1000), "GPa": (1000, 1), "N/mm2": (1, 1)},
    "density": {"t/mm3": (1, 1), "kg/m3": (1, 1e12), "g/cm3": (1, 1e9)},
    "speed": {"mm/s": (1, 1), "mm/min": (1, 60), "cm/s": (10, 1), "m/s": (1000, 1), "m/min": (1000, 60)},
    "angle": {"deg": (1, 1), "rad": (180, math.pi)},
    "energy": {"mJ": (1, 1), "J": (1000, 1)},
    "force per length": {"N/mm": (1, 1), "kJ/m2": (1, 1), "J/m2": (1, 1000), "mJ/mm2": (1, 1)},
    "rate": {"1/s": (1, 1), "1/ms": (1000, 1), "1/min": (1, 60)},
    "decay": {"s/mm": (1, 1), "s/m": (1, 1000)},
    "dimensionless": {"1": (1, 1), "%": (1, 100)},
}
INTERNAL = {dimension: next(iter(units)) for dimension, units in _TABLE.items()}
_BY_NAME = {name: Unit(name, dimension, *both) for dimension, units in _TABLE.items() for name, both in units.items()}
_ALIASES = {"tonne": "t", "tonne/mm3": "t/mm3", "s-1": "1/s", "-": "1"}
_QUANTITIES = {"rate": "strain rate", "decay": "friction decay", "dimensionless": "a dimensionless quantity"}
_SIGNS = str.maketrans(
    {"²": "2", "³": "3", "¹": "1", "⁻": "-", "−": "-", "^": "", "µ": "u", "μ": "u", "°": "deg", " ": ""}
)
_NUMBER = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER})[ \t]*(\S.*)?", re.ASCII)
_LONGEST = 60


def parse_unit(text: str, dimension: str | None = None) -> Unit:
    """Return the unit called `text`; raise `UnitError` if it is unknown or has another dimension."""
    name = text.strip().translate(_SIGNS)
    unit = _BY_NAME.get(_ALIASES.get(name, name))
    possible = tuple(dict.fromkeys((usual_unit(dimension), *_TABLE[dimension]))) if dimension else tuple(_BY_NAME)
    if unit is None:
        raise UnitError(f"unknown unit {_shown(text)}", did_you_mean(name, possible))
    if dimension is not None and unit.dimension != dimension:
        actual, wanted = (_QUANTITIES.get(name, name) for name in (unit.dimension, dimension))
        raise UnitError(f"{unit.name} is a unit of {actual}, not of {wanted}", f"use {listed(possible)}")
    return unit


def convert(value: float, unit: str, dimension: str | None = None) -> float:
    """Convert `value` in `unit` to the internal unit of the same dimension."""
    known = parse_unit(unit, dimension)
    return value * known.numerator / known.denominator


def fits(unit: str, dimension: str) -> bool:
    """Check that a unit is known and has the given dimension."""
    try:
        parse_unit(unit, dimension)
    except UnitError:
        return False
    return True


def from_internal(value: float, unit: str) -> float:
    """Convert an internal value back to `unit`."""
    known = parse_unit(unit)
    return value * known.denominator / known.numerator


def parse(text: str, dimension: str, usual: str = "") -> float:
    """Return a quantity such as ``"8 mm"`` in internal units; errors suggest `usual`, by default `usual_unit`."""
    usual = usual or usual_unit(dimension)
    match = _QUANTITY.fullmatch(text.strip().replace("−", "-")) if len(text) <= _LONGEST else None
    if match is None:
        example = f'write a number and a unit, such as "1 {usual}"'
        raise UnitError(f"{_shown(text)} is not a number with a unit", example)
    number, unit = float(match[1]), match[2]
    if unit is None:
        raise UnitError(f"{match[1]} has no unit", with_unit(match[1], dimension, usual))
    if re.match(r",[0-9]", unit):
        raise UnitError(f"{_shown(text)} has a decimal comma", f"write {with_point(text)}")
    value = convert(number, unit, dimension)
    if not math.isfinite(value):
        raise UnitError(f"{_shown(text)} is too large", "check the exponent")
    return value


# Plausible internal values of a number without a unit. If the number is not plausible in the usual unit, the first unit
# of _OTHERS in which it is plausible is suggested.
_PLAUSIBLE = {"length": (0.02, 5e3), "stress": (1e-3, 1e6), "density": (5e-11, 2e-8)}
_OTHERS = {"length": ("m",), "stress": ("Pa", "GPa"), "density": ("g/cm3", "t/mm3")}


def with_unit(number: str, dimension: str, usual: str) -> str:
    """Return the remedy for a number without a unit: add the usual unit, or the first one with a plausible value."""
    low, high = _PLAUSIBLE.get(dimension, (-math.inf, math.inf))
    values = {unit: convert(abs(float(number)), unit) for unit in (usual, *_OTHERS.get(dimension, ()))}
    likely = next((unit for unit, value in values.items() if low <= value <= high), usual)
    if likely == usual:
        return f'write "{number} {usual}"'
    same = f"{from_internal(convert(float(number), likely), usual):g} {usual}"
    return f'write "{number} {likely}" ({same}), or "{number} {usual}"'


def with_point(text: str) -> str:
    """Return the correction of a number with a comma: 1.500 for 1,500, or 1500 if the comma separates thousands."""
    point = text.strip().replace(",", ".", 1)[:_LONGEST]
    if not re.fullmatch(r"[-+]?[1-9][0-9]{0,2},[0-9]{3}(?![0-9]).*", text.strip()):
        return point
    return f"{point} (or {text.strip().replace(',', '')[:_LONGEST]}, if the comma separates thousands)"


def usual_unit(dimension: str) -> str:
    """Return the unit that error messages suggest: mm/min for speeds, kg/m3 for densities, else the internal unit."""
    return {"speed": "mm/min", "density": "kg/m3"}.get(dimension, INTERNAL[dimension])


def _shown(text: str) -> str:
    return repr(text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "...")
