"""How a deck is written, where there is a choice."""

from dataclasses import dataclass
from typing import Literal

from stemcal.study.model import LsDynaSolver, OpenRadiossSolver, Study


@dataclass(frozen=True)
class DeckForm:
    """Choices in writing a deck.

    Parameters
    ----------
    material : str
        ``mat024``: piecewise linear plasticity with failure, which LS-DYNA and OpenRadioss both read as isotropic
        hardening and delete elements by. ``mat003``: plastic kinematic with all nine parameters, whose failure strain
        OpenRadioss does not delete elements by.
    long : bool
        Whether a keyword whose values need more than ten columns gets twenty (``+``), which LS-DYNA reads and
        OpenRadioss does not.
    pictures : bool
        Whether states are written to look at.
    lengths : str or None
        The program whose own cards carry the study's lengths: nonlocal failure over an equivalent of
        `internal_length`, and a nose of radius `edge_spread`. None: no card that the other program does not read.
    """

    material: Literal["mat024", "mat003"] = "mat024"
    long: bool = False
    pictures: bool = True
    lengths: Literal["lsdyna", "openradioss"] | None = None

    @property
    def plastic_rate(self) -> bool:
        """Whether the rate is that of plastic strain, as in the study (VP = 1), or of all strain.

        With VP = 1 OpenRadioss forgets the rate (``sigeps44.F``): a stem gave 158.4 N with its effect, 158.2 N without,
        where VP = 0 gives 220 N. So only decks for LS-DYNA say so.
        """
        return self.for_ls_dyna

    @property
    def for_ls_dyna(self) -> bool:
        """Whether the deck is for LS-DYNA alone: then its contact and rate are as that has them."""
        return self.material == "mat003" or self.lengths == "lsdyna"


def form_of(study: Study) -> DeckForm:
    """Return the form that the study's solver reads: all nine parameters and all digits for LS-DYNA."""
    solver = study.solver
    lengths = solver.kind if isinstance(solver, LsDynaSolver | OpenRadiossSolver) and solver.nonlocal_failure else None
    return DeckForm("mat003", True, lengths=lengths) if isinstance(solver, LsDynaSolver) else DeckForm(lengths=lengths)
