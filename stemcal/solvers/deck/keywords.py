"""Keyword cards: fields in columns, numbers with as many digits as these hold; and which of them a deck has.

A keyword is written in LS-DYNA's standard format, fields of ten columns, which every reader supports. On request, where
one of its numbers needs more, that keyword is in long format, fields of twenty columns, marked by a ``+`` behind its
name: LS-DYNA then reads all digits, OpenRadioss does not support the keyword.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from stemcal.solvers.options import DeckSolver
from stemcal.study.model import Study

Card = Mapping[str, float | int | str]

STANDARD, LONG = 10, 20
_HEADING = "$#"


def keyword(name: str, *cards: Card, title: str | None = None, long: bool = False) -> Iterable[str]:
    """Yield the lines of a keyword: its name, a title if it has one, and each card below its fields' names.

    `long` allows the long format where a number needs it; else numbers are rounded to what ten columns hold.

    >>> print(*keyword("DATABASE_GLSTAT", {"dt": 0.001, "binary": 1}), sep="\\n")
    *DATABASE_GLSTAT
    $#      dt    binary
         0.001         1
    """
    widest = max((len(_text_of(value)) for card in cards for value in card.values()), default=0)
    width = LONG if long and widest > STANDARD else STANDARD
    yield f"*{name}{'+' if width == LONG else ''}"
    if title is not None:
        yield title[:80]
    for card in cards:
        heading = "".join(f"{name:>{width}}" for name in card)
        yield _HEADING + heading[len(_HEADING) :]
        yield "".join(f"{_in_columns(value, width):>{width}}" for value in card.values())


def _in_columns(value: float | int | str, width: int) -> str:
    text = _text_of(value)
    if len(text) <= width:
        return text
    if isinstance(value, float):
        return fitted(value, width)
    raise ValueError(f"{text} has more than {width} characters")


def _text_of(value: float | int | str) -> str:
    """Return the shortest text that reads back as the same value.

    >>> _text_of(17.96), _text_of(1.1e-09), _text_of(1000.0), _text_of(4)
    ('17.96', '1.1e-09', '1000.0', '4')
    """
    return value if isinstance(value, str) else repr(float(value) if isinstance(value, float) else int(value))


def fitted(value: float, width: int) -> str:
    """Return a number with as many of its digits as `width` columns hold.

    >>> fitted(17.96, 10), fitted(14.204482103412, 10), fitted(-1.2345678901e-05, 10)
    ('17.96', '14.2044821', '-1.2346e-5')
    """
    exact = repr(float(value))
    if len(exact) <= width:
        return exact
    for digits in range(16, 0, -1):
        text = _short_exponent(f"{value:.{digits}g}")
        if len(text) <= width:
            return text
    raise ValueError(f"{value:g} does not fit into {width} columns")


def _short_exponent(text: str) -> str:
    """Return ``1.5e-05`` as ``1.5e-5``, and a whole number with its point."""
    mantissa, exponent, power = text.partition("e")
    if not exponent:
        return mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{mantissa}e{int(power)}"


# ---- which of them a deck has


DeckProgramName = Literal["lsdyna", "openradioss"]


@dataclass(frozen=True)
class DeckForm:
    """Choices in writing a deck.

    Parameters
    ----------
    program : str
        ``lsdyna``: *MAT_PLASTIC_KINEMATIC with all nine parameters, and twenty columns where a value needs more than
        ten, which OpenRadioss does not read. ``openradioss``: piecewise linear plasticity with failure, by which both
        programs delete elements; the hardening is isotropic.
    lengths : bool
        Whether cards of this program carry the study's lengths: nonlocal failure over an equivalent of
        `internal_length`, and a nose of radius `edge_spread`.
    pictures : bool
        Whether states are written to look at.
    """

    program: DeckProgramName = "openradioss"
    lengths: bool = False
    pictures: bool = True

    @property
    def for_ls_dyna(self) -> bool:
        """Whether material, contact and rate are as LS-DYNA has them.

        The rate is that of plastic strain, as in the study (VP = 1), in LS-DYNA alone: with VP = 1 OpenRadioss forgets
        the rate (``sigeps44.F``). A stem gave 158.4 N with its effect, 158.2 N without, where VP = 0 gives 220 N.
        """
        return self.program == "lsdyna"

    @property
    def by_density(self) -> bool:
        """Whether the stem is made denser instead of mass on single nodes.

        OpenRadioss's nonlocal field diverges where nodes are given mass.
        """
        return self.lengths and not self.for_ls_dyna


def form_of(study: Study) -> DeckForm:
    """Return the form that the study's own program reads."""
    solver = study.solver
    return DeckForm(solver.program, solver.nonlocal_failure) if isinstance(solver, DeckSolver) else DeckForm()
