"""The contact cards of a deck: blade and stem, supports and stem."""

from collections.abc import Iterator

from stemcal.solvers.deck.equivalents import contact_scale
from stemcal.solvers.deck.keywords import keyword
from stemcal.solvers.deck.model import BLADE, STEM, SUPPORTS, Deck
from stemcal.study.model.shear_test import DAMPING

BLADE_CONTACT, SUPPORTS_CONTACT = 1, 2
_BY_PART_SET, _BY_PART = 2, 3


def contact_cards(deck: Deck) -> Iterator[str]:
    """Yield the lines of the two contacts: blade and stem, then supports and stem."""
    study, c = deck.study, deck.study.contact
    friction = {"fs": c.static_friction, "fd": c.dynamic_friction, "dc": c.decay, "vc": 0.0}
    friction |= {"vdc": float(f"{100 * DAMPING:.12g}"), "penchk": 0, "bt": 0.0, "dt": 1e20}
    erosion = {"isym": 0, "erosop": 1, "iadj": 1}
    near, radius = 0.5 * study.supports.clearance + study.supports.fillet_radius, 0.5 * deck.diameter
    blade = friction, _scales(deck, c.penalty * deck.edge_share, (0.0, 0.0, radius)), erosion
    supports = friction, _scales(deck, c.penalty, (near, 0.0, -radius))
    if layered := len(deck.layers) > 1:
        parts = {f"pid{i}": part for i, part in enumerate(sorted(deck.layers), 1)}
        yield from keyword("SET_PART_LIST", {"sid": STEM}, parts)
    kinds = {"sstyp": _BY_PART_SET if layered else _BY_PART, "mstyp": _BY_PART}
    kinds |= {"sboxid": 0, "mboxid": 0, "spr": 1, "mpr": 1}
    for number, name, tool, title, cards in (
        (BLADE_CONTACT, "ERODING", BLADE, "blade and stem", blade),
        (SUPPORTS_CONTACT, "AUTOMATIC", SUPPORTS, "supports and stem", supports),
    ):
        heading, sides = f"{number:10d}{title}", {"ssid": STEM, "msid": tool, **kinds}
        yield from keyword(f"CONTACT_{name}_SURFACE_TO_SURFACE_ID", sides, *cards, title=heading)


def _scales(deck: Deck, share: float, place: tuple[float, float, float]) -> dict[str, float]:
    factor = float(f"{contact_scale(deck.solver, deck.parts.stem, deck.law, share, place):.4g}")
    unused = {"sst": 0.0, "mst": 0.0, "sfst": 1.0, "sfmt": 1.0, "fsf": 1.0, "vsf": 1.0}
    return {"sfs": factor, "sfm": factor, **unused}
