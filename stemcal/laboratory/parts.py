"""What determines a laboratory test of a piece of stem: what is done to it, material, piece, loading, mesh."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import through_wall
from stemcal.cutting.parts import Discretisation, Loading, Stem
from stemcal.fem.contact import Contact, Tool
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh

Array = NDArray[np.float64]

# One layer of elements, with their points in its middle, does not resist bending.
_FEWEST_LAYERS = 3


class Kind(Protocol):
    """What is done to the piece, which is along x about the axis; a room of this package for each.

    `PERIODS` is over how many of the piece's slowest natural periods the loading is spread at least: mass is scaled so
    far and no farther. `MOMENT` m is that of the section which the response goes by, ∫zᵐ dA: 0 its area, 2 its second
    moment, None that of the wall about its mid-line (`build.rounded`).
    """

    PERIODS: ClassVar[float]
    MOMENT: ClassVar[int | None]

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the slowest natural period that the test excites, s; of a bar's wave speed √(E/ρ) in mm/s."""

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return the mesh of the piece, or of the part of it that the symmetry leaves."""

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        """Return the rigid tools, the moving one first; on one side of the middle only if a mirror makes the rest."""

    def driven(self, mesh: Mesh, stem: Stem) -> NDArray[np.bool_]:
        """Return (N, 3) which components are moved as `motion` prescribes at all times."""

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, poisson_ratio: float) -> Array:
        """Return the velocities of the nodes at the start (N, 3), mm/s.

        They are those of the slow motion to come, so that nothing swings.
        """


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


def whole(mesh: Mesh) -> NDArray[np.bool_]:
    """Return (N, 3) zeros: nothing is driven."""
    return np.zeros(mesh.nodes.shape, dtype=bool)


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
