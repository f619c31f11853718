"""The sentence of any note, or other fact of a kind. Each topic's module says those of its kinds."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import singledispatch
from operator import attrgetter
from typing import Any, TypeVar

from stemcal.files.typed import Tagged
from stemcal.notes import Note, Weight
from stemcal.text.names import Names

K = TypeVar("K", bound=Tagged)


@dataclass(frozen=True)
class Remark:
    """A sentence about a result, what it weighs, and its kind."""

    sentence: str
    weight: Weight
    kind: str


@singledispatch
def sentence(fact: Tagged, names: Names) -> str:
    """Return what a note says, or a reason of the verdict, or its remedy."""
    raise TypeError(f"no sentence for facts of kind {fact.kind}")


def states(
    kind: type[K],
    template: str | Mapping[Any, str],
    many: str = "",
    *,
    otherwise: str = "",
    by: str | Callable[[K], object] = "",
    **derived: Callable[[K, Names], object],
) -> None:
    """Give a kind of fact its template.

    Its fields are the fact's, ``{best.low:.2f}`` and ``{range[0]}`` within these, ``{names.response.long}`` and the
    like of the reader's names, and those that are `derived`. What `by` names, or returns, chooses among several
    templates by its value; whether there is any between a template and what is said `otherwise`; between one and
    `many` it tells how many: a number, or something to be counted.
    """

    def say(fact: K, names: Names) -> str:
        fields = {"names": names, **vars(fact), **{name: of(fact, names) for name, of in derived.items()}}
        value: Any = by(fact) if callable(by) else _decides(by, fact, names)
        if not isinstance(template, str):
            return names.say(template[value], **fields)
        if not many:
            return names.say(otherwise if otherwise and not value else template, **fields)
        return names.say_number(template, many, value if isinstance(value, int) else len(value), **fields)

    sentence.register(kind, say)


def _decides(path: str, fact: Tagged, names: Names) -> Any:
    """Return an attribute of the fact, or of the names, by the path to it."""
    root, _, rest = path.partition(".")
    return attrgetter(rest)(names) if root == "names" else attrgetter(path)(fact) if path else None


def remark(note: Note, names: Names) -> Remark:
    """Return a note as a sentence with its weight."""
    return Remark(sentence(note, names), note.weight, note.kind)
