"""What is said of decks: the force that one is to give, beside the study's."""

from stemcal.numbers import significant
from stemcal.text.language import say

# So near the study's force needs no remedy, as a share of it.
_NEAR = 0.1


def forces_told(of_deck: float, of_study: float | None) -> list[str]:
    """Say the force of a deck (N) beside that of the study it was written from, and what can be done about it."""
    deck = significant(of_deck)
    computed = "This deck is to give {deck} N: the embedded solver computed what the deck says."
    if of_study is None:
        return [say(computed, deck=deck)]
    beside = (
        "This deck is to give {deck} N, the study {study} N: the embedded solver computed both as they are written."
    )
    told = [say(beside, deck=deck, study=significant(of_study))]
    if abs(of_deck / of_study - 1.0) > _NEAR:
        told.append(
            say(
                "Parameters calibrated in the study do not hold in this deck. Write one with --for lsdyna or --for "
                "openradioss, or calibrate for the mesh of that program."
            )
        )
    return told


def not_foretold(too_much: list[str]) -> str:
    """Say why the force of a deck is not computed."""
    return say("The force that this deck is to give was not computed. {reasons}", reasons=" ".join(too_much))
