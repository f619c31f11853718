"""The calibrated material for one's own model: its card, and failure strain over element size as a curve."""

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap

from stemcal.solvers.deck.fixed_width import keyword
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.writer import stem_material

CURVE = 1001


def material_text(deck: Deck, said: Iterable[str]) -> str:
    """Return an include file with the stem's card and what is said of it, one comment each."""
    return _text([*_comments(said), *stem_material(deck.material, deck.form)])


def curve_text(points: Sequence[tuple[float, float]], said: Iterable[str]) -> str:
    """Return an include file with failure strain over element size (mm) as a curve of rising sizes."""
    return _text([*_comments(said), *_curve(points)])


def _text(lines: Iterable[str]) -> str:
    return "\n".join(["*KEYWORD", *lines, "*END", ""])


def _comments(said: Iterable[str]) -> Iterator[str]:
    for sentence in said:
        yield from wrap(sentence, 78, initial_indent="$ ", subsequent_indent="$   ")


def _curve(points: Sequence[tuple[float, float]]) -> Iterator[str]:
    yield from keyword("DEFINE_CURVE", {"lcid": CURVE})
    for size, strain in sorted(points):
        yield f"{size!r:>20}{strain!r:>20}"
