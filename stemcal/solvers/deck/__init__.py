"""The shear test as an LS-DYNA keyword deck, in mm, tonne, s, N and MPa."""

from __future__ import annotations

from stemcal.solvers.deck.writer import deck_lines, deck_text

__all__ = ["deck_lines", "deck_text"]
