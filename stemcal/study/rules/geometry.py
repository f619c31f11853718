"""Rules on what the virtual test is made of: stem, blade, supports, contact and the mesh."""

from collections.abc import Iterator

from stemcal.study.rules.draft import Draft, Finding

# More elements across a stem would be thousands of millions in it.
_MOST_ACROSS = 1000.0


def stem_reaches_over_supports(draft: Draft) -> Iterator[Finding]:
    """The specimen lies on both supports."""
    if draft.supports and draft.specimen and draft.supports.clearance >= draft.specimen.length:
        message = (
            f"the supports are {draft.supports.clearance:g} mm apart, the specimen is only "
            f"{draft.specimen.length:g} mm long"
        )
        yield Finding(("supports", "clearance"), message, "move them closer or take a longer specimen")


def edge_fits_blade(draft: Draft) -> Iterator[Finding]:
    """The rounding of the edge is smaller than half the thickness."""
    if draft.blade and draft.blade.edge_radius > draft.blade.thickness / 2:
        message = f"{draft.blade.edge_radius:g} mm is more than half the blade's thickness"
        yield Finding(("blade", "edge_radius"), message, f"stay below {draft.blade.thickness / 2:g} mm")


def elements_fit_stem(draft: Draft) -> Iterator[Finding]:
    """An element is smaller than the radius of the thinnest stem, and no mesh has more elements than can be counted."""
    if draft.embedded is None or not draft.diameters:
        return
    thinnest = min(draft.diameters.values())
    if draft.embedded.element_size.at(thinnest) > thinnest / 2:
        message = f"elements of {draft.embedded.element_size} are too large for a {thinnest:g} mm stem"
        yield Finding(("solver", "element_size"), message, f"take about {thinnest / 8:.2g} mm")
    thickest = max(draft.diameters.values())
    if (across := thickest / draft.embedded.element_size.at(thickest)) > _MOST_ACROSS:
        message = f"elements of {draft.embedded.element_size} are too small: {across:.3g} across a {thickest:g} mm stem"
        yield Finding(("solver", "element_size"), message, "write d/16, or check the unit")


def friction_falls(draft: Draft) -> Iterator[Finding]:
    """Sliding does not rub more than sticking."""
    contact = draft.contact
    if contact and contact.dynamic_friction > contact.static_friction:
        message = f"{contact.dynamic_friction:g} is above static_friction {contact.static_friction:g}"
        yield Finding(("contact", "dynamic_friction"), message, "swap them")
