"""A comparison with a known solution, and its topic."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, log10
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Strains and stresses are in single precision: relative errors of sums of them, and the numbers below which only the
# power of ten is shown.
SINGLE = 1e-6


@dataclass(frozen=True)
class Case:
    """A computed value and its exact value; the tolerance is relative to the exact value if `relative`."""

    name: str
    computed: float
    exact: float
    tolerance: float
    source: str
    unit: str = ""
    relative: bool = True

    @property
    def difference(self) -> float:
        """Return computed − exact, as a share of the exact one if `relative`."""
        off = self.computed - self.exact
        return off / abs(self.exact) if self.relative else off

    @property
    def holds(self) -> bool:
        """Return whether the difference lies within the tolerance."""
        return bool(abs(self.difference) <= self.tolerance)

    @property
    def share(self) -> float:
        """Return the difference as a share of the tolerance; 0 where both are none."""
        if self.tolerance == 0.0:
            return inf if self.difference else 0.0
        return abs(self.difference) / self.tolerance

    def cells(self) -> tuple[str, ...]:
        """Return name, computed, exact, difference, tolerance and source as text."""
        scale, unit = (1.0, self.unit) if not self.relative else (100.0, "%") if self.tolerance >= 1e-3 else (1.0, "")
        return (
            self.name,
            _with_unit(number(self.computed), self.unit),
            _with_unit(number(self.exact), self.unit),
            _with_unit(number(scale * self.difference, 2, "+"), unit),
            _with_unit(f"{scale * self.tolerance:.2g}".replace("e-0", "e-"), unit),
            self.source,
        )


@dataclass(frozen=True)
class Drawing:
    """A figure: its file is ``verification-NAME.png``."""

    name: str
    figure: Figure
    caption: str


@dataclass(frozen=True)
class Topic:
    """A section of the page."""

    title: str
    text: str
    cases: tuple[Case, ...]
    drawings: tuple[Drawing, ...] = ()


def number(value: float, digits: int = 5, sign: str = "") -> str:
    """Return a number with so many digits; of round-off only the power of ten above it.

    >>> number(0.0123456, 2, "+"), number(3.2e-16), number(18.0), number(0.0)
    ('+0.012', '< 1e-15', '18', '0')
    """
    if value == 0.0:
        return "0"
    if abs(value) < SINGLE:
        return f"< 1e-{-ceil(log10(abs(value))):d}"
    return f"{value:{sign}.{digits}g}".replace("e-0", "e-").replace("e+0", "e")


def _with_unit(text: str, unit: str) -> str:
    return f"{text} {unit}".rstrip()
