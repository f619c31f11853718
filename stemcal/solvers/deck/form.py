"""How a deck is written, where there is a choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from stemcal.study.model import LsDynaSolver, Study


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
    """

    material: Literal["mat024", "mat003"] = "mat024"
    long: bool = False
    pictures: bool = True


def form_of(study: Study) -> DeckForm:
    """Return the form that the study's solver reads: all nine parameters and all digits for LS-DYNA."""
    return DeckForm("mat003", long=True) if isinstance(study.solver, LsDynaSolver) else DeckForm()
