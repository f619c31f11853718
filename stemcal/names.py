"""How sentences name things: responses and conditions as the study calls them, factors by name or by label."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

from stemcal.naming import CUTTING, DIAMETER, Named, Naming
from stemcal.numbers import interval, minus, short
from stemcal.words import series

MOST_LISTED = 12
"""A sentence lists at most this number of values of the condition, otherwise it gives their number."""


@dataclass(frozen=True)
class Names:
    """The names and units that sentences are written with.

    Notes and the terminal write a factor's name, as specs and commands do; the page has `labels` for its tables.
    """

    naming: Naming = CUTTING
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def response(self) -> Named:
        """The first response."""
        return self.naming.response

    @property
    def condition(self) -> Named:
        """The condition, under a general name if the study has none."""
        return self.naming.condition or Named("condition", "Condition", "", "1")

    @property
    def placed(self) -> bool:
        """Whether the study measures at several values of a condition."""
        return self.naming.condition is not None

    def of(self, naming: Naming) -> Self:
        """Return the same labels with other responses, or with another response first."""
        return replace(self, naming=naming)

    def factor(self, name: str) -> str:
        """Return the name of a factor, or of a term of several.

        >>> Names(labels={"yield_stress": "Yield stress"}).factor("yield_stress:failure_strain")
        'Yield stress:failure_strain'
        """
        return re.sub(r"[^:^]+", lambda found: self.labels.get(found[0]) or found[0], name)

    def factors(self, names: Iterable[str]) -> str:
        """List factors.

        >>> Names().factors(["a", "b", "c"])
        'a, b and c'
        """
        return series(self.factor(name) for name in names)

    def quantity(self, value: float, form: str = ".4g") -> str:
        """Return a value of the response with its unit.

        >>> Names().quantity(-74.69), Names().quantity(74.69, "+.3g")
        ('−74.69 N', '+74.7 N')
        """
        return minus(self.response.text(value, form))

    def quantities(self, ends: tuple[float, float]) -> str:
        """Return an interval of the response with its unit.

        >>> Names().quantities((153.2, 160.0))
        '153.2 to 160.0 N'
        """
        return f"{interval(ends)}{self.response.unit_suffix}"

    def conditions(self, values: Iterable[float]) -> str:
        """List values of the condition, or count many of them; a stem's diameter goes without its name.

        >>> Names().conditions([7.0, 8.0, 11.0]), Names().conditions(range(1, 501))
        ('7, 8 and 11 mm', '500 values from 1 to 500 mm')
        """
        values = list(values)
        many = len(values) > MOST_LISTED
        listed = f"{len(values)} values from {short(min(values))} to {short(max(values))}" if many else ""
        listed = f"{listed or series(map(short, values))}{self.condition.unit_suffix}"
        return listed if self.condition == DIAMETER else f"{self.condition.long} {listed}"

    @staticmethod
    def beside_mean(named: Named, value: float, mean: float) -> str:
        """Return a value of a response with its unit, as it is counted against its measured mean.

        >>> Names.beside_mean(Named("curve_1", "", "", "N", apart=True), 178.5, 180.0)
        '−1.5 N'
        """
        return f"{short(named.counted(value, mean), 4)}{named.unit_suffix}"

    def at(self, *values: float) -> str:
        """Return `` at 8 mm``, or nothing if the study has no condition.

        >>> Names().at(7.0, 8.0), Names(Naming(condition=None)).at(0.0)
        (' at 7 and 8 mm', '')
        """
        return f" at {self.conditions(values)}" if self.placed else ""


def program(kind: str) -> str:
    """Return what a program is called, by its kind of solver."""
    known = {"embedded": "the other model", "lsdyna": "LS-DYNA", "openradioss": "OpenRadioss"}
    return known.get(kind, "the other program")
