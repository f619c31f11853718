"""Names that fill templates: those of `stemcal.names`, as forms of fields."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from stemcal import names
from stemcal.numbers import duration, fixed, in_bytes, signed_probability, significant, tenths
from stemcal.stages.base import stage_called
from stemcal.text.language import Writer, all_of


@dataclass(frozen=True)
class Names(names.Names):
    """The names that templates are filled with.

    In templates ``{x:factor}`` is a factor or a term, ``{x:factors}`` a list of them, ``{x:response}`` a value of the
    response with its unit (``{x:response +.3g}`` as Python formats it), ``{x:responses}`` an interval of it,
    ``{x:condition}`` a value of the condition, ``{x:conditions}`` several of them, ``p {x:p}`` a p-value with its sign,
    ``{x:fixed 1}`` a number with so many decimals, ``{x:tenths}`` with one or, where that is 0.0, its first digit,
    ``{x:significant 3}`` with so many digits, ``{x:duration}`` seconds, ``{x:memory}`` bytes,
    ``{x:stage}`` a stage by its title.
    """

    def say(self, template: str, /, **fields: object) -> str:
        """Return a sentence.

        >>> Names().say("{first:factor} raises it by {effect:response .3g}.", first="yield_stress", effect=74.69)
        'yield_stress raises it by 74.7 N.'
        """
        return self._writer.say(template, **fields)

    def say_number(self, one: str, many: str, count: int, /, **fields: object) -> str:
        """Return a sentence that depends on a number, which both templates know as ``count``."""
        return self._writer.say_number(one, many, count, **fields)

    @cached_property
    def _writer(self) -> Writer:
        return Writer(
            {
                "factor": self.factor,
                "factors": self.factors,
                "response": self.quantity,
                "responses": self.quantities,
                "condition": lambda value: self.conditions([value]),
                "conditions": self.conditions,
                "p": signed_probability,
                "all": all_of,
                "duration": duration,
                "memory": in_bytes,
                "stage": lambda name: stage_called(name).title,
                "fixed": lambda value, decimals="2": fixed(value, int(decimals)),
                "tenths": tenths,
                "significant": lambda value, digits="4": significant(value, int(digits)),
            }
        )
