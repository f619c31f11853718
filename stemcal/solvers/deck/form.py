"""How a deck is written: for which program, with which of its cards."""

from dataclasses import dataclass
from typing import Literal

from stemcal.solvers.options import DeckSolver
from stemcal.study.model import Study

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
