"""What a reader knows things by: responses and conditions as the study calls them, factors by name or by label."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from stemcal.naming import CUTTING, DIAMETER, Named, Naming
from stemcal.stages.base import stage_called
from stemcal.text.language import Writer, all_of, say
from stemcal.text.numbers import duration, fixed, in_bytes, interval, short, signed_probability, significant, tenths


@dataclass(frozen=True)
class Names:
    """The names that sentences are made with.

    `labels` has what the page writes for a factor; the terminal writes its name, as specs and commands know it.

    In templates ``{x:factor}`` is a factor or a term, ``{x:factors}`` a list of them, ``{x:response}`` a value of the
    response with its unit (``{x:response +.3g}`` as Python formats it), ``{x:responses}`` an interval of it,
    ``{x:condition}`` a value of the condition, ``{x:conditions}`` several of them, ``p {x:p}`` a p-value with its sign,
    ``{x:fixed 1}`` a number with so many decimals, ``{x:tenths}`` with one or, where that is 0.0, its first digit,
    ``{x:significant 3}`` with so many digits, ``{x:duration}`` seconds, ``{x:memory}`` bytes, ``{x:program}`` a kind of
    solver, ``{x:stage}`` a stage by its title.
    """

    naming: Naming = CUTTING
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def response(self) -> Named:
        """The response that is spoken of."""
        return self.naming.response

    def of(self, naming: Naming) -> Names:
        """Return them with the responses of another result, or another response in front."""
        return replace(self, naming=naming)

    def say(self, template: str, /, **fields: object) -> str:
        """Return a sentence.

        >>> Names().say("{first:factor} raises it by {effect:response .3g}.", first="yield_stress", effect=74.69)
        'yield_stress raises it by 74.7 N.'
        """
        return self._writer.say(template, **fields)

    def say_number(self, one: str, many: str, count: int, /, **fields: object) -> str:
        """Return a sentence that depends on a number, which both templates know as ``count``."""
        return self._writer.say_number(one, many, count, **fields)

    def factor(self, name: str) -> str:
        """Return a factor, or a term of several, as the reader knows it.

        >>> Names(labels={"yield_stress": "Yield stress"}).factor("yield_stress:failure_strain")
        'Yield stress:failure_strain'
        """
        return re.sub(r"[^:^]+", lambda found: self.labels.get(found[0]) or found[0], name)

    def factors(self, names: Iterable[str]) -> str:
        """List factors.

        >>> Names().factors(["a", "b", "c"])
        'a, b and c'
        """
        return all_of(self.factor(name) for name in names)

    def quantity(self, value: float, form: str = ".4g") -> str:
        """Return a value of the response with its unit.

        >>> Names().quantity(-74.69)
        '−74.69 N'
        """
        return self.response.text(value, form).replace("-", "−")

    @property
    def condition(self) -> Named:
        """The condition, by a general name where a study has none."""
        return self.naming.condition or Named("condition", "Condition", "", "1")

    @property
    def placed(self) -> bool:
        """Whether there is a condition at which things are measured."""
        return self.naming.condition is not None

    def conditions(self, values: Iterable[float]) -> str:
        """List values of the condition; a stem's diameter goes without its name.

        >>> Names().conditions([7.0, 8.0, 11.0])
        '7, 8 and 11 mm'
        """
        template = "{values}{unit}" if self.condition == DIAMETER else "{condition} {values}{unit}"
        listed = all_of(short(value) for value in values)
        return self.say(template, condition=self.condition.long, values=listed, unit=self.condition.unit_suffix)

    @cached_property
    def _writer(self) -> Writer:
        return Writer(
            {
                "factor": self.factor,
                "factors": self.factors,
                "response": self.quantity,
                "responses": lambda ends: f"{interval(ends)}{self.response.unit_suffix}",
                "condition": lambda value: self.conditions([value]),
                "conditions": self.conditions,
                "p": signed_probability,
                "all": all_of,
                "duration": duration,
                "memory": in_bytes,
                "program": program,
                "stage": lambda name: stage_called(name).title,
                "fixed": lambda value, decimals="2": fixed(value, int(decimals)),
                "tenths": tenths,
                "significant": lambda value, digits="4": significant(value, int(digits)),
            }
        )


def program(kind: str) -> str:
    """Return what is called by the name of a kind of solver."""
    known = {"embedded": say("the other model"), "lsdyna": "LS-DYNA", "openradioss": "OpenRadioss"}
    return known.get(kind, say("the other program"))
