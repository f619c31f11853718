"""What a study calls what it calibrates to, and how sentences name it: responses, condition, factors.

The shear test's own words are the default: the maximum force in N, over the stem's diameter in mm. In attributes and in
the keys of files they are ``response`` and ``condition`` in every study; their names head every table,
figure and sentence, and is once in each stage file.
"""

import operator
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

from stemcal.formats import interval, minus, series, short, unit_written
from stemcal.responses import CUT, TABLE, Response, known_response, response_of, responses_in

FIRST = "response"
"""The key of the first response, which does not depend on the study's name for it."""
NOWHERE = 0.0
"""The condition of every run of a study that has none."""

_WRITTEN = {"1": "", "deg": "°", "degC": "°C", "kg/m3": "kg/m³", "g/cm3": "g/cm³", "t/mm3": "t/mm³", "N/mm2": "N/mm²"}


@dataclass(frozen=True)
class Variable:
    """A response or a condition: its name at the head of columns, its label in headings, symbol and unit."""

    name: str
    label: str
    symbol: str
    unit: str
    apart: bool = field(default=False, metadata={"exclude_if": operator.not_})
    """Whether what counts is how far a value is from the measured mean, which by itself is of something else."""

    @classmethod
    def of(cls, response: Response) -> Self:
        """Return the names of a response of the table, as the cutting test has it."""
        return cls(response.name, response.label, response.symbol, response.unit)

    @property
    def in_table(self) -> Response | None:
        """The response of the cutting test that it names; None for any other quantity."""
        response = response_of(self.name, CUT)
        return response if response is not None and Variable.of(response) == self else None

    @property
    def noun(self) -> str:
        """What sentences call it: ``force``, ``angle of repose``."""
        if self == DIAMETER:
            return "diameter"
        own = self.in_table
        return small(self.label) if own is None else own.noun or small(own.label)

    @property
    def long(self) -> str:
        """The label unchanged inside a sentence or along an axis: ``maximum force``, ``COR``."""
        return small(self.label)

    @property
    def written(self) -> str:
        """The unit as people write it, such as kg/m³; nothing for a plain number."""
        return _WRITTEN.get(self.unit, self.unit)

    @property
    def unit_suffix(self) -> str:
        """The unit as it follows a number, with the space it needs: `` N``, ``°``."""
        return self.written if self.written in ("", "°") else f" {self.written}"

    def headed(self, word: str) -> str:
        """Return a heading with the unit behind it: ``Measured, N``."""
        return f"{word}, {self.written}" if self.written else word

    @property
    def capital(self) -> str:
        """The noun as it begins a sentence or a heading: ``Force``."""
        return capital(self.noun)

    def counted(self, value: float, mean: float) -> float:
        """Return a value as shown next to its measured mean, or its difference from the mean."""
        return round(value - mean, 4) if self.apart else value

    def text(self, value: float, form: str = "g") -> str:
        """Return a value with its unit: ``100.1 N``, ``32.6°``."""
        return f"{value:{form}}{self.unit_suffix}"


FORCE, TRAVEL, WORK = (Variable.of(one) for one in TABLE if one.name in ("force", "travel", "work"))
DIAMETER = Variable("diameter", "Stem diameter", "D", "mm")


@dataclass(frozen=True)
class Vocabulary:
    """The condition, if there is one, and the responses, of which the first is what a study calibrates to."""

    condition: Variable | None = DIAMETER
    responses: tuple[Variable, ...] = (FORCE, TRAVEL, WORK)

    @property
    def is_cutting(self) -> bool:
        """Whether these are the shear test's own words, with or without further responses of the table."""
        return self.is_force_on_stems and not self.others and set(CUTTING.further) <= set(self.further)

    @property
    def response(self) -> Variable:
        """The first response."""
        return self.responses[0]

    @property
    def further(self) -> tuple[Variable, ...]:
        """The responses next to the first."""
        return self.responses[1:]

    @property
    def others(self) -> tuple[Variable, ...]:
        """The responses next to the first that the cutting test does not have: of a program, other tests and curves."""
        own_test = self.condition != DIAMETER  # the study declares a test whose responses may have the same names
        return tuple(response for response in self.further if own_test or response.in_table is None)

    def named(self, name: str) -> Variable:
        """Return a response by its name, or the first one for `FIRST`."""
        if name == FIRST:
            return self.response
        own = (response for response in self.responses if response.name == name)
        return next(own, None) or Variable.of(known_response(name))

    def measuring(self, names: Collection[str]) -> Self:
        """Return it with those of the names that are responses of the cutting test."""
        more = (Variable.of(one) for one in responses_in(CUT, measured=names) if one.name in names)
        return replace(self, responses=tuple(dict.fromkeys((*self.responses, *more))))

    def with_primary(self, name: str) -> Self:
        """Return it with another of the responses as the first."""
        first = self.named(name)
        return replace(self, responses=(first, *(one for one in self.responses if one != first)))

    @property
    def is_force_on_stems(self) -> bool:
        """Whether the response is a force over the stem's diameter, which cutting forces grow with by a power law."""
        return (self.response, self.condition) == (FORCE, DIAMETER)

    @property
    def of_logarithm(self) -> Self:
        """The names where the first response is replaced by its logarithm, ``ln F``."""
        first = self.response
        logarithm = Variable(f"ln_{first.name}", f"Logarithm of the {first.long}", f"ln {first.symbol}", "1")
        return replace(self, responses=(logarithm, *self.responses[1:]))

    @property
    def headings(self) -> dict[str, str | None]:
        """What columns of condition and response are headed; None for one that is left out."""
        return {"condition": None if self.condition is None else self.condition.name, FIRST: self.response.name}


CUTTING = Vocabulary()


def small(label: str) -> str:
    """Return a label with a small first letter, unless it begins with a symbol, an abbreviation or a possessive."""
    first = label.partition(" ")[0]
    kept = len(first) == 1 or first[1:2].isupper() or first.endswith(("'s", "’s"))
    return label if kept else label[:1].lower() + label[1:]


def capital(label: str) -> str:
    """Return a label with a capital as its first letter, the others as they are."""
    return label[:1].upper() + label[1:]


# ---- in sentences

MOST_LISTED = 12
"""A sentence lists at most this number of values of the condition, otherwise it gives their number."""


@dataclass(frozen=True)
class Wording:
    """The names and units that sentences are written with.

    Notes and the terminal write a factor's name, as specs and commands do; the page writes its label (`labels`).
    """

    naming: Vocabulary = CUTTING
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def response(self) -> Variable:
        """The first response."""
        return self.naming.response

    @property
    def condition(self) -> Variable:
        """The condition, under a general name if the study has none."""
        return self.naming.condition or Variable("condition", "Condition", "", "1")

    @property
    def placed(self) -> bool:
        """Whether the study measures at several values of a condition."""
        return self.naming.condition is not None

    def factor(self, name: str) -> str:
        """Return the name of a factor, or of a term of several: ``Yield stress:failure_strain``."""
        return re.sub(r"[^:^]+", lambda found: self.labels.get(found[0]) or found[0], name)

    def in_text(self, name: str, unit: str = "") -> str:
        """Return the name of a factor inside a sentence, ``yield stress``, without the `unit` of its value."""
        label = self.labels.get(name)
        return small(label).removesuffix(f" ({unit_written(unit)})") if label else name

    def factors(self, names: Iterable[str]) -> str:
        """List factors inside a sentence: ``a, b and c``."""
        return series(map(self.in_text, names))

    def quantity(self, value: float, form: str = ".4g") -> str:
        """Return a value of the response with its unit: ``−74.69 N``."""
        return minus(self.response.text(value, form))

    def quantities(self, ends: tuple[float, float]) -> str:
        """Return an interval of the response with its unit: ``153.2 to 160.0 N``."""
        return f"{interval(ends)}{self.response.unit_suffix}"

    def conditions(self, values: Iterable[float]) -> str:
        """List values of the condition, or count many of them; a stem's diameter goes without its name."""
        values = list(values)
        many = len(values) > MOST_LISTED
        listed = f"{len(values)} values from {short(min(values))} to {short(max(values))}" if many else ""
        listed = f"{listed or series(map(short, values))}{self.condition.unit_suffix}"
        return listed if self.condition == DIAMETER else f"{self.condition.long} {listed}"

    def at(self, *values: float) -> str:
        """Return `` at a diameter of 8 mm``, or nothing if the study has no condition."""
        of = ("a diameter of " if len(values) == 1 else "diameters of ") if self.condition == DIAMETER else ""
        return f" at {of}{self.conditions(values)}" if self.placed else ""


def program(kind: str) -> str:
    """Return the name of a program, by its kind of solver."""
    known = {"embedded": "the other model", "lsdyna": "LS-DYNA", "openradioss": "OpenRadioss"}
    return known.get(kind, "the other program")
