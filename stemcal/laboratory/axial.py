"""Axial compression and tension of a piece of stem, with held or lubricated ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from stemcal.arrays import Array, Mask
from stemcal.laboratory import Kind
from stemcal.study.model.laboratory_kind import LaboratoryKind, PieceSection

if TYPE_CHECKING:
    from stemcal.cutting.parts import Discretisation, Loading, Stem
    from stemcal.fem.material import Material
    from stemcal.fem.mesh import Mesh

# Reduction of the radius in the middle of a pulled piece, as a share. With half or twice this, the work changes by 1 %.
_WAIST = 0.001


class AxialSection(PieceSection):
    """Compression or tension of a piece between two ends that move along its axis."""

    ends: Literal["held", "lubricated"] = "held"
    """Ends of the specimen: a `held` end cannot expand; a `lubricated` end can expand around its fixed centre."""

    across_axis = False


class CompressionSection(AxialSection):
    """Compression of a piece of stem along its axis."""

    kind: Literal["axial-compression"] = "axial-compression"


class TensionSection(AxialSection):
    """Tension of a piece of stem along its axis."""

    kind: Literal["axial-tension"] = "axial-tension"


class Compression(LaboratoryKind):
    """Axial compression of a piece of stem: its responses are slope, maximum force, travel and work."""

    name, options = "axial-compression", CompressionSection

    def make(self, section: AxialSection, diameter: float) -> Kind:
        return Axial("compression", section.ends)


class Tension(LaboratoryKind):
    """Axial tension of a piece of stem: its responses are slope, maximum force, travel and work."""

    name, options = "axial-tension", TensionSection

    def make(self, section: AxialSection, diameter: float) -> Kind:
        return Axial("tension", section.ends)


@dataclass(frozen=True)
class Axial(Kind):
    """A piece of stem between two ends that move along its axis, each at half the speed.

    `held` ends keep the size of their section, as glued or clamped ends do; at `lubricated` ends the section expands
    or contracts about its fixed centre. A pulled piece is modelled slightly thinner in the middle: a stem that hardens
    little develops a neck, and round-off would determine its position, which changed the work until the break by 3 %.
    """

    sense: Literal["compression", "tension"]
    ends: Literal["held", "lubricated"] = "held"
    PERIODS: ClassVar[float] = 120.0

    @property
    def widens_evenly(self) -> bool:
        return self.sense == "compression" and self.ends == "lubricated"

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the travel time of a wave along the piece and back, s."""
        return 2.0 * stem.length / wave_speed

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return the mesh of the piece; in tension, its radii r are reduced to r (1 − w cos² πx/L), w = `_WAIST`."""
        from stemcal.cutting.build import stem_mesh
        from stemcal.laboratory.build import layered

        if self.sense == "compression":
            return stem_mesh(stem, layered(stem, how))
        mesh = stem_mesh(stem, how)
        thinner = 1.0 - _WAIST * np.cos(np.pi * mesh.nodes[:, :1] / stem.length) ** 2
        return replace(mesh, nodes=np.hstack([mesh.nodes[:, :1], thinner * mesh.nodes[:, 1:]]))

    def driven(self, mesh: Mesh, stem: Stem) -> Mask:
        """Return the components at the nodes of both ends: along the axis, and across it if the ends are held.

        At lubricated ends, the nodes next to the planes y = 0 and z = 0 do not move across these planes, so that an end
        widens about its centre. Without this condition, the ends slid sideways once the piece yielded (Engesser's
        buckling stress π² Eₜ I/(A L²)), which reduced the work by 8 %.
        """
        ends = np.abs(np.abs(mesh.nodes[:, 0]) - 0.5 * stem.length) < 1e-9 * stem.length
        off = np.abs(mesh.nodes[:, 1:])
        across = (self.ends == "held") | (off < off[ends].min(axis=0) + 1e-6 * stem.outer_diameter)
        return np.column_stack([ends, ends[:, None] & across])

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, laws: Sequence[Material]) -> Array:
        """Return the velocities of a uniform axial strain, with the lateral strain of lubricated ends."""
        rate = loading.speed / stem.length * (1.0 if self.sense == "tension" else -1.0)
        across = -laws[0].poisson_ratio if self.ends == "lubricated" else 0.0
        return np.asarray(rate * mesh.nodes * [1.0, across, across])
