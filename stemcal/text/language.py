"""Templates become sentences here and nowhere else, so that another language is a file of messages.

Every template is a whole sentence with named fields, written where it is used. A catalogue of GNU gettext (``.mo``)
translates them; ``xgettext -ksay -ksay_number:1,2 -kstates:2,3`` collects them.
"""

from collections.abc import Callable, Iterable, Mapping
from gettext import NullTranslations
from string import Formatter
from typing import Any

Form = Callable[[Any], str]
_catalogue = NullTranslations()


def use(catalogue: NullTranslations | None) -> None:
    """Take a catalogue of translated templates; None: the English ones."""
    global _catalogue
    _catalogue = NullTranslations() if catalogue is None else catalogue


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
        return self.vformat(_catalogue.gettext(template), (), fields)

    def say_number(self, one: str, many: str, count: int, /, **fields: object) -> str:
        """Return a sentence that depends on a number, which both templates know as ``count``.

        >>> say_number("{count} run failed.", "{count} runs failed.", 1)
        '1 run failed.'
        """
        return self.vformat(_catalogue.ngettext(one, many, count), (), {"count": count, **fields})


def all_of(words: Iterable[object]) -> str:
    """List all of several things.

    >>> all_of(["a"]), all_of(["a", "b"]), all_of(["a", "b", "c"])
    ('a', 'a and b', 'a, b and c')
    """
    return _listed(words, "{first} and {last}")


def _listed(words: Iterable[object], last: str) -> str:
    *first, end = [str(word) for word in words] or [""]
    return say(last, first=", ".join(first), last=end) if first else end


_plain = Writer({"all": all_of})
say, say_number = _plain.say, _plain.say_number
