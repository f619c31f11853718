"""Keyword cards: fields of ten columns, numbers with as many digits as these hold; and which of them a deck has."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from stemcal.solvers.options import DeckSolver
from stemcal.study.model.study import Study

Card = Mapping[str, float | int | str]

WIDTH = 10  # columns of a field, LS-DYNA's standard format, which every reader supports
_HEADING = "$#"


def keyword(name: str, *cards: Card, title: str | None = None) -> Iterable[str]:
    """Yield the lines of a keyword: its name, a title if it has one, and each card below its fields' names.

    >>> print(*keyword("DATABASE_GLSTAT", {"dt": 0.001, "binary": 1}), sep="\\n")
    *DATABASE_GLSTAT
    $#      dt    binary
         0.001         1
    """
    yield f"*{name}"
    if title is not None:
        yield title[:80]
    for card in cards:
        heading = "".join(f"{name:>{WIDTH}}" for name in card)
        yield _HEADING + heading[len(_HEADING) :]
        yield "".join(f"{_text_of(value):>{WIDTH}}" for value in card.values())


def _text_of(value: float | int | str) -> str:
    text = fitted(value, WIDTH) if isinstance(value, float) else str(value)
    if len(text) > WIDTH:
        raise ValueError(f"{text} has more than {WIDTH} characters")
    return text


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
    raise ValueError(f"{value:g} does not fit in {width} columns")


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

    program    ``lsdyna``: *MAT_PLASTIC_KINEMATIC with all nine parameters. ``openradioss``: piecewise linear plasticity
               with failure, by which both programs delete elements; the hardening is isotropic.
    lengths    whether cards of this program carry the study's lengths: nonlocal failure over an equivalent of
               `internal_length`, and a nose of radius `edge_spread`
    pictures   whether states are written to look at
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
