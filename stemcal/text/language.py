"""Fill templates with named fields. Being replaced by f-strings next to the facts (`stemcal.note`)."""

from collections.abc import Callable, Iterable, Mapping
from string import Formatter
from typing import Any

from stemcal.words import series


class Writer(Formatter):
    """Fills templates; `forms` has what ``{field:form}`` and ``{field:form .3g}`` mean beside Python's own formats."""

    def __init__(self, forms: Mapping[str, Callable[..., str]]) -> None:
        self.forms = forms

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return a field as its form writes it."""
        name, _, rest = format_spec.partition(" ")
        if name in self.forms:
            return self.forms[name](value, rest) if rest else self.forms[name](value)
        return str(super().format_field(value, format_spec)).replace("-", "−") if format_spec else str(value)

    def say(self, template: str, /, **fields: object) -> str:
        """Return a sentence.

        >>> say("{factor} raises the response by {effect:.1f}.", factor="yield_stress", effect=74.0)
        'yield_stress raises the response by 74.0.'
        """
        return self.vformat(template, (), fields)

    def say_number(self, one: str, many: str, count: int, /, **fields: object) -> str:
        """Return a sentence that depends on a number, which both templates know as ``count``.

        >>> say_number("{count} run failed.", "{count} runs failed.", 1)
        '1 run failed.'
        """
        return self.vformat(one if count == 1 else many, (), {"count": count, **fields})


def all_of(words: Iterable[object]) -> str:
    """List several things."""
    return series(words)


_plain = Writer({"all": all_of})
say, say_number = _plain.say, _plain.say_number
