"""The sentence of any note, or other fact of a kind. Each topic's module says those of its kinds."""

from dataclasses import dataclass
from functools import singledispatch

from stemcal.files.typed import Tagged
from stemcal.notes import Note, Weight
from stemcal.text.names import Names

__all__ = ["Remark", "remark", "sentence", "states"]


@dataclass(frozen=True)
class Remark:
    """A sentence about a result, what it weighs, and its kind: of several of a kind one is read first.

    One that `claims` holds for a calibrated study only.
    """

    sentence: str
    weight: Weight
    kind: str
    claims: bool = False


@singledispatch
def sentence(fact: Tagged, names: Names) -> str:
    """Return what a note says, or a reason of the verdict, or its remedy."""
    raise TypeError(f"no sentence for facts of kind {fact.kind}")


def states(kind: type[Tagged], template: str, many: str = "", *, count: str = "") -> None:
    """Give a kind of fact its template, whose fields are the fact's.

    Where it differs for one and for many, the field `count` tells: a number, or something to be counted.
    """

    def say(fact: Tagged, names: Names) -> str:
        if not many:
            return names.say(template, **vars(fact))
        number = getattr(fact, count)
        return names.say_number(template, many, number if isinstance(number, int) else len(number), **vars(fact))

    sentence.register(kind, say)


def remark(note: Note, names: Names) -> Remark:
    """Return a note as a sentence that knows its weight."""
    return Remark(sentence(note, names), note.weight, note.kind, note.claims)
