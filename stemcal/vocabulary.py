"""The names of a study's responses, condition and factors in tables, figures and sentences.

By default, the response is the maximum force in N, and the condition is the stem diameter in mm. In the code and in
files both are called ``response`` and ``condition`` in every study; each stage file contains their names once.
"""

import operator
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Self

from stemcal.formats import interval, minus, series, short, unit_written
from stemcal.responses import CUT, TABLE, Response, known_response, response_of, responses_in

FIRST = "response"  # the key of the first response in files and tables, independent of its name in the study
NOWHERE = 0.0  # the condition of a run in a study that has no condition

_WRITTEN = {"1": "", "deg": "°", "degC": "°C", "kg/m3": "kg/m³", "g/cm3": "g/cm³", "t/mm3": "t/mm³", "N/mm2": "N/mm²"}


@dataclass(frozen=True)
class Variable:
    """A response or a condition: name (columns of tables), label (headings), symbol (equations) and unit."""

    name: str
    label: str
    symbol: str
    unit: str
    apart: bool = field(default=False, metadata={"exclude_if": operator.not_})
    """Whether tables show the difference from the measured mean instead of the value; true for scores of curves."""

    @classmethod
    def of(cls, response: Response) -> Self:
        """Return the variable for a response, with the label of the cutting test."""
        return cls(response.name, response.label, response.symbol, response.unit)

    @property
    def in_table(self) -> Response | None:
        """The response of the cutting test with this name, label, symbol and unit; None for any other quantity."""
        response = response_of(self.name, CUT)
        return response if response is not None and Variable.of(response) == self else None

    @property
    def noun(self) -> str:
        """Name of the variable in sentences: ``force``, ``angle of repose``."""
        if self == DIAMETER:
            return "diameter"
        own = self.in_table
        return small(self.label) if own is None else own.noun or small(own.label)

    @property
    def long(self) -> str:
        """The label in sentences and on axes, with a lower-case first letter: ``maximum force``, but ``COR``."""
        return small(self.label)

    @property
    def written(self) -> str:
        """The unit as printed, such as kg/m³; empty for the unit 1."""
        return _WRITTEN.get(self.unit, self.unit)

    @property
    def unit_suffix(self) -> str:
        """The unit to append to a number, with a space except for degrees: `` N``, ``°``."""
        return self.written if self.written in ("", "°") else f" {self.written}"

    def headed(self, word: str) -> str:
        """Return a heading followed by the unit: ``Measured, N``."""
        return f"{word}, {self.written}" if self.written else word

    @property
    def capital(self) -> str:
        """The noun with a capital first letter, for a heading or the beginning of a sentence: ``Force``."""
        return capital(self.noun)

    def table_value(self, value: float, mean: float) -> float:
        """Return the value for tables: if `apart`, the difference of `value` from the measured `mean`, else `value`."""
        return round(value - mean, 4) if self.apart else value

    def text(self, value: float, form: str = "g") -> str:
        """Return a value with its unit: ``100.1 N``, ``32.6°``."""
        return f"{minus(f'{value:{form}}')}{self.unit_suffix}"


FORCE, TRAVEL, WORK = (Variable.of(response) for response in TABLE if response.name in ("force", "travel", "work"))
DIAMETER = Variable("diameter", "Stem diameter", "D", "mm")


@dataclass(frozen=True)
class Vocabulary:
    """The condition of a study (None if it has none) and its responses; the first response is calibrated."""

    condition: Variable | None = DIAMETER
    responses: tuple[Variable, ...] = (FORCE, TRAVEL, WORK)

    @property
    def is_cutting(self) -> bool:
        """Whether the condition and all responses are those of the cutting test, and the force is the first."""
        return self.is_force_on_stems and not self.others and set(CUTTING.further) <= set(self.further)

    @property
    def response(self) -> Variable:
        return self.responses[0]

    @property
    def further(self) -> tuple[Variable, ...]:
        """The responses after the first."""
        return self.responses[1:]

    @property
    def others(self) -> tuple[Variable, ...]:
        """The further responses that are not those of the cutting test, but of a program, another test or a curve."""
        own_test = self.condition != DIAMETER  # responses that a study declares may have names of the cutting test
        return tuple(response for response in self.further if own_test or response.in_table is None)

    def named(self, name: str) -> Variable:
        """Return the response with this name, or the first response for the name `FIRST`."""
        if name == FIRST:
            return self.response
        own = (response for response in self.responses if response.name == name)
        return next(own, None) or Variable.of(known_response(name))

    def measuring(self, names: Collection[str]) -> Self:
        """Return a copy with those responses of the cutting test whose names are in `names`, after the others."""
        more = (Variable.of(response) for response in responses_in(CUT, measured=names) if response.name in names)
        return replace(self, responses=tuple(dict.fromkeys((*self.responses, *more))))

    def with_primary(self, name: str) -> Self:
        """Return a copy in which the response with this name comes first."""
        first = self.named(name)
        return replace(self, responses=(first, *(response for response in self.responses if response != first)))

    @property
    def is_force_on_stems(self) -> bool:
        """Whether the first response is the cutting force over the stem diameter, which follows a power law."""
        return (self.response, self.condition) == (FORCE, DIAMETER)

    @property
    def of_logarithm(self) -> Self:
        """A copy in which the first response is replaced by its logarithm, ``ln F``."""
        first = self.response
        logarithm = Variable(f"ln_{first.name}", f"Logarithm of the {first.long}", f"ln {first.symbol}", "1")
        return replace(self, responses=(logarithm, *self.responses[1:]))

    @property
    def headings(self) -> dict[str, str | None]:
        """The headings of the columns ``condition`` and ``response``; None if a column is to be omitted."""
        return {"condition": None if self.condition is None else self.condition.name, FIRST: self.response.name}


CUTTING = Vocabulary()


def small(label: str) -> str:
    """Return a label with a lower-case first letter, unless it begins with a symbol, an abbreviation or a name."""
    first = label.partition(" ")[0]
    kept = len(first) == 1 or first[1:2].isupper() or first.endswith(("'s", "’s"))
    return label if kept else label[:1].lower() + label[1:]


def capital(label: str) -> str:
    """Return a label with a capital first letter; the other letters stay unchanged."""
    return label[:1].upper() + label[1:]


MOST_LISTED = 12
"""Largest number of condition values that a sentence lists; for more values it states their number and range."""


@dataclass(frozen=True)
class Wording:
    """Names and units for sentences: those of the study (`naming`), and the `labels` of factors by their names.

    The report page uses labels. Notes and the terminal have no `labels` and use the names of factors in the spec.
    """

    naming: Vocabulary = CUTTING
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def response(self) -> Variable:
        return self.naming.response

    @property
    def condition(self) -> Variable:
        """The condition; a variable named ``condition`` if the study has none."""
        return self.naming.condition or Variable("condition", "Condition", "", "1")

    @property
    def has_condition(self) -> bool:
        return self.naming.condition is not None

    def factor(self, name: str) -> str:
        """Return the label, else the name, of a factor or of each factor in a term: ``Yield stress:density``."""
        return re.sub(r"[^:^]+", lambda match: self.labels.get(match[0]) or match[0], name)

    def in_text(self, name: str, unit: str = "") -> str:
        """Return the label of a factor for a sentence, without its `unit`: ``yield stress``."""
        label = self.labels.get(name)
        return small(label).removesuffix(f" ({unit_written(unit)})") if label else name

    def factors(self, names: Iterable[str]) -> str:
        """List factors in a sentence: ``a, b and c``."""
        return series(map(self.in_text, names))

    def quantity(self, value: float, form: str = ".4g") -> str:
        """Format a value of the first response with its unit: ``−74.69 N``."""
        return minus(self.response.text(value, form))

    def quantities(self, ends: tuple[float, float]) -> str:
        """Format an interval of the first response with its unit: ``153.2 to 160.0 N``."""
        return f"{interval(ends)}{self.response.unit_suffix}"

    def conditions(self, values: Iterable[float]) -> str:
        """List values of the condition, or their number and range, after its name (omitted for the stem diameter)."""
        values = list(values)
        many = len(values) > MOST_LISTED
        listed = f"{len(values)} values from {short(min(values))} to {short(max(values))}" if many else ""
        listed = f"{listed or series(map(short, values))}{self.condition.unit_suffix}"
        return listed if self.condition == DIAMETER else f"{self.condition.long} {listed}"

    def at(self, *values: float) -> str:
        """Return the phrase `` at a diameter of 8 mm``; empty if the study has no condition."""
        of = ("a diameter of " if len(values) == 1 else "diameters of ") if self.condition == DIAMETER else ""
        return f" at {of}{self.conditions(values)}" if self.has_condition else ""


def program(kind: str) -> str:
    """Return the name of a program in sentences; `kind` is its solver kind or program name."""
    known = {"embedded": "the other model", "lsdyna": "LS-DYNA", "openradioss": "OpenRadioss"}
    return known.get(kind, "the other program")
