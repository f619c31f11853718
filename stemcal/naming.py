"""What a study calls what it calibrates to: its responses and the condition they are measured at.

The shear test's own words are the default: the maximum force in N, over the stem's diameter in mm. In attributes and in
the keys of files they are ``response`` and ``condition`` in every study; their names head every table,
figure and sentence, and is once in each stage file.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass, field, replace

FIRST = "response"
"""The key of the first response, which does not depend on the study's name for it."""
NOWHERE = 0.0
"""The condition of every run of a study that has none."""

_WRITTEN = {"1": "", "deg": "°", "degC": "°C", "kg/m3": "kg/m³", "g/cm3": "g/cm³", "t/mm3": "t/mm³", "N/mm2": "N/mm²"}
_NOUNS = {
    "Maximum force": "force",
    "Stem diameter": "diameter",
    "Travel to the maximum force": "travel",
    "Work to the maximum force": "work",
}
_PREPOSITIONS = (" of ", " to ", " in ", " at ", " per ")


@dataclass(frozen=True)
class Named:
    """A response or a condition: its name at the head of columns, its label in headings, symbol and unit."""

    name: str
    label: str
    symbol: str
    unit: str
    apart: bool = field(default=False, metadata={"exclude_if": operator.not_})
    """Whether what counts is how far a value is from the measured mean, which by itself is of something else."""

    @property
    def noun(self) -> str:
        """What sentences call it.

        >>> FORCE.noun, Named("a", "Angle of repose", "θ", "deg").noun
        ('force', 'angle of repose')
        """
        return _NOUNS.get(self.label, small(self.label))

    @property
    def long(self) -> str:
        """The label unchanged inside a sentence or along an axis.

        >>> FORCE.long, Named("e", "COR", "e", "1").long
        ('maximum force', 'COR')
        """
        return small(self.label)

    @property
    def plural(self) -> str:
        """Several of it in a sentence.

        >>> FORCE.plural, Named("a", "Angle of repose", "θ", "deg").plural
        ('forces', 'angles of repose')
        >>> Named("rho", "Bulk density", "ρ", "kg/m3").plural, Named("s", "Stress at break", "σ", "MPa").plural
        ('bulk densities', 'stresses at break')
        """
        at = min((self.noun.find(word) for word in _PREPOSITIONS if word in self.noun), default=len(self.noun))
        head, rest = self.noun[:at], self.noun[at:]
        if head.endswith("y") and head[-2:-1] not in "aeiou":
            return f"{head[:-1]}ies{rest}"
        return f"{head}{'es' if head.endswith(('s', 'x', 'ch', 'sh')) else 's'}{rest}"

    @property
    def written(self) -> str:
        """The unit as people write it, nothing for a plain number.

        >>> FORCE.written, Named("rho", "", "", "kg/m3").written, Named("e", "", "", "1").written
        ('N', 'kg/m³', '')
        """
        return _WRITTEN.get(self.unit, self.unit)

    @property
    def unit_suffix(self) -> str:
        """The unit as it follows a number, with the space it needs.

        >>> FORCE.unit_suffix, Named("a", "", "", "deg").unit_suffix
        (' N', '°')
        """
        return self.written if self.written in ("", "°") else f" {self.written}"

    @property
    def squared(self) -> str:
        """The square of the unit.

        >>> FORCE.squared, Named("rho", "", "", "kg/m3").squared, Named("a", "", "", "deg").squared
        ('N²', '(kg/m³)²', '(°)²')
        """
        bracketed = "/" in self.written or self.written.startswith("°")
        return f"({self.written})²" if bracketed else self.written and f"{self.written}²"

    def headed(self, word: str) -> str:
        """Return a heading with the unit behind it.

        >>> FORCE.headed("Measured")
        'Measured, N'
        """
        return f"{word}, {self.written}" if self.written else word

    @property
    def capital(self) -> str:
        """The noun as it begins a sentence or a heading.

        >>> FORCE.capital, TRAVEL.capital
        ('Force', 'Travel')
        """
        return capital(self.noun)

    def axis(self, word: str = "") -> str:
        """Return the label of an axis.

        >>> FORCE.axis(), FORCE.axis("predicted by the surface")
        ('maximum force, N', 'predicted by the surface, N')
        """
        return self.headed(word or self.long)

    def counted(self, value: float, mean: float) -> float:
        """Return a value as shown next to its measured mean, or its difference from the mean.

        >>> FORCE.counted(178.5, 180.0), Named("curve_1", "", "", "N", apart=True).counted(178.5, 180.0)
        (178.5, -1.5)
        """
        return round(value - mean, 4) if self.apart else value

    def text(self, value: float, form: str = "g") -> str:
        """Return a value with its unit.

        >>> FORCE.text(100.1), Named("a", "", "", "deg").text(32.6)
        ('100.1 N', '32.6°')
        """
        return f"{value:{form}}{self.unit_suffix}"


FORCE = Named("force", "Maximum force", "F", "N")
TRAVEL = Named("travel", "Travel to the maximum force", "u", "mm")
WORK = Named("work", "Work to the maximum force", "W", "mJ")
DIAMETER = Named("diameter", "Stem diameter", "D", "mm")


@dataclass(frozen=True)
class Naming:
    """The condition, if there is one, and the responses, of which the first is what a study calibrates to."""

    condition: Named | None = DIAMETER
    responses: tuple[Named, ...] = (FORCE, TRAVEL, WORK)

    def __post_init__(self) -> None:
        if not self.responses:
            raise ValueError("no response is named")

    @property
    def is_cutting(self) -> bool:
        """Whether these are the shear test's own words."""
        return self == CUTTING

    @property
    def response(self) -> Named:
        """The first response."""
        return self.responses[0]

    @property
    def further(self) -> tuple[Named, ...]:
        """The responses next to the first."""
        return self.responses[1:]

    @property
    def others(self) -> tuple[Named, ...]:
        """The responses next to the first that a study itself has named: travel and work go without saying."""
        return tuple(response for response in self.further if response not in CUTTING.further)

    @property
    def values(self) -> str:
        """A measured quantity of any kind.

        >>> CUTTING.values, Naming(None, (Named("a", "angle of repose", "θ", "deg"),)).values
        ('forces', 'angles of repose')
        """
        return "responses" if self.others else self.response.plural

    def named(self, name: str) -> Named:
        """Return a response by its name, or the first one for `FIRST`."""
        if name == FIRST:
            return self.response
        return next(response for response in self.responses if response.name == name)

    def place(self, value: float) -> str:
        """Name the condition at which something is, as a sentence does; nothing where there is none.

        >>> CUTTING.place(8.0)
        '8 mm'
        >>> Naming(condition=Named("moisture", "Moisture", "w", "%")).place(12.0)
        'moisture 12 %'
        """
        if self.condition is None:
            return ""
        text = self.condition.text(value)
        return text if self.condition == DIAMETER else f"{self.condition.noun} {text}"

    def at(self, value: float) -> str:
        """Return the condition as it follows a noun.

        >>> CUTTING.at(8.0), Naming(condition=None).at(0.0)
        (' at 8 mm', '')
        """
        return f" at {self.place(value)}" if self.condition is not None else ""

    def with_primary(self, name: str) -> Naming:
        """Return it with another of the responses as the first.

        >>> CUTTING.with_primary("work").response.unit
        'mJ'
        """
        first = self.named(name)
        return replace(self, responses=(first, *(one for one in self.responses if one != first)))

    @property
    def condition_noun(self) -> str:
        """The noun of the condition, a general one where there is none."""
        return "condition" if self.condition is None else self.condition.noun

    @property
    def is_force_on_stems(self) -> bool:
        """Whether the response is a force over the stem's diameter, which cutting forces grow with by a power law."""
        return (self.response, self.condition) == (FORCE, DIAMETER)

    @property
    def headings(self) -> dict[str, str | None]:
        """What columns of condition and response are headed; None for one that is left out.

        >>> CUTTING.headings
        {'condition': 'diameter', 'response': 'force'}
        """
        return {"condition": None if self.condition is None else self.condition.name, FIRST: self.response.name}

    @property
    def fitted_at(self) -> str:
        """The key of a spec that chooses where the parameters are fitted together."""
        return "invert.diameters"


CUTTING = Naming()


def small(label: str) -> str:
    """Return a label with a small first letter, unless it begins with an abbreviation."""
    return label if label[1:2].isupper() else label[:1].lower() + label[1:]


def capital(label: str) -> str:
    """Return a label with a capital as its first letter, the others as they are."""
    return label[:1].upper() + label[1:]
