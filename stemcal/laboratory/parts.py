"""What determines a laboratory test of a piece of stem: what is done to it, material, piece, loading, mesh."""

from dataclasses import dataclass, field, replace

from stemcal.cutting.build import through_wall
from stemcal.cutting.parts import Discretisation, Loading, Stem
from stemcal.fem.contact import Contact, Tool
from stemcal.fem.material import Material
from stemcal.laboratory.kind import Kind

# One layer of elements, with their points in its middle, does not resist bending.
_FEWEST_LAYERS = 3


@dataclass(frozen=True)
class LaboratoryTest:
    """Everything that determines one virtual test of a piece of stem other than cutting.

    Parameters
    ----------
    kind : Kind
        What is done to the piece.
    """

    kind: Kind
    material: Material
    stem: Stem
    loading: Loading
    contact: Contact = field(default_factory=lambda: Contact(0.15, 0.10))
    discretisation: Discretisation = field(default_factory=lambda: Discretisation(edge_over="nodes"))


def layered(stem: Stem, how: Discretisation) -> Discretisation:
    """Return the discretisation with at least three elements through a wall, unless it has their number.

    With one, thin walls wrinkled at three quarters of the travel.
    """
    if how.through_wall or not stem.diameter_ratio:
        return how
    return replace(how, through_wall=max(_FEWEST_LAYERS, through_wall(stem, how)))


def roller(x: float, radius: float, speed: float, height: float) -> Tool:
    """Return a cylinder across the stem, its axis at (x, height)."""
    tip = 1.0e-3 * radius
    return Tool(((x - tip, 0.0), (x + tip, 0.0), (x, tip)), radius, height, speed, faces=True)


def plate(face: float, half_length: float, upwards: bool, speed: float) -> Tool:
    """Return a plate from −half_length to half_length whose flat face is at z = `face`."""
    edge, thickness = 1.0, 5.0
    low, high = (-edge - thickness, -edge) if upwards else (edge, edge + thickness)
    left, right = -half_length, half_length
    return Tool(((left, low), (right, low), (right, high), (left, high)), edge, face, speed, faces=True)
