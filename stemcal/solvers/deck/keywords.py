"""Write keyword cards with fields of ten columns, and choose the form of a deck: its program and optional parts."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from stemcal.solvers.options import DeckSolver
from stemcal.study.model.study import Study

Card = Mapping[str, float | int | str]

WIDTH = 10  # columns of a field, LS-DYNA's standard format, which every reader supports
_HEADING = "$#"


def keyword(name: str, *cards: Card, title: str | None = None) -> Iterable[str]:
    """Yield the lines of a keyword: its name, an optional title, and each card below the names of its fields.

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
    """Return a number with the most digits that fit into `width` columns.

    >>> fitted(17.96, 10), fitted(14.204482103412, 10), fitted(-1.2345678901e-05, 10)
    ('17.96', '14.2044821', '-1.2346e-5')
    """
    exact = repr(float(value))
    if len(exact) <= width:
        return exact
    for digits in range(16, 0, -1):
        mantissa, exponent, power = f"{value:.{digits}g}".partition("e")
        text = f"{mantissa}e{int(power)}" if exponent else mantissa if "." in mantissa else f"{mantissa}.0"
        if len(text) <= width:
            return text
    raise ValueError(f"{value:g} does not fit in {width} columns")


_DeckProgramName = Literal["lsdyna", "openradioss"]


@dataclass(frozen=True)
class DeckForm:
    """The form of a deck.

    program    ``lsdyna``: *MAT_PLASTIC_KINEMATIC with all nine parameters; ``openradioss``: piecewise linear plasticity
               with isotropic hardening and a failure strain, which both programs can run
    lengths    whether the deck represents two lengths of the study: `internal_length` by nonlocal failure, and
               `edge_spread` by a rounded edge
    pictures   whether states are written for animations
    """

    program: _DeckProgramName = "openradioss"
    lengths: bool = False
    pictures: bool = True

    @property
    def for_ls_dyna(self) -> bool:
        """Whether the cards of material, contact and strain rate are those of LS-DYNA.

        Only the LS-DYNA cards use the rate of plastic strain (VP = 1), as the study does. OpenRadioss ignores the rate
        with VP = 1 (``sigeps44.F``): the peak force of a stem was 158.4 N, without a rate effect 158.2 N, but with
        VP = 0 220 N.
        """
        return self.program == "lsdyna"

    @property
    def by_density(self) -> bool:
        """Whether the density of the stem is increased, since OpenRadioss's nonlocal field diverges with added mass."""
        return self.lengths and not self.for_ls_dyna


def form_of(study: Study) -> DeckForm:
    """Return the form for the program of the study; the default form if its solver is the embedded one."""
    solver = study.solver
    return DeckForm(solver.program, solver.nonlocal_failure) if isinstance(solver, DeckSolver) else DeckForm()
