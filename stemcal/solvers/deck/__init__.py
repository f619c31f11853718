"""The shear test as an LS-DYNA keyword deck, in mm, tonne, s, N and MPa."""

from stemcal.solvers.deck.keywords import DeckForm
from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.writer import deck_text

__all__ = ["Deck", "DeckForm", "deck_text"]
