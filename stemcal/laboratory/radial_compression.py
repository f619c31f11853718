"""Radial compression: a piece of stem is compressed across its axis between two flat plates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, pi, sqrt
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.laboratory import Kind
from stemcal.study.model.laboratory_kind import LaboratoryKind, PieceSection
from stemcal.study.types.field_types import Length

if TYPE_CHECKING:
    from stemcal.cutting.parts import Discretisation, Loading, Stem
    from stemcal.fem.material import Material
    from stemcal.fem.mesh import Mesh
    from stemcal.fem.tools import Tool


class RadialSection(PieceSection):
    """Compression across the stem between two plates. `element_size` is the width of the elements at the plates; the
    elements elsewhere are four times as wide.
    """

    kind: Literal["radial-compression"] = "radial-compression"

    across_axis = True
    usual_size = Length(divisor=64.0)

    def room(self, diameter: float, ratio: float) -> float:
        return diameter * min(1.0, 2.0 * ratio or 1.0)  # beyond this stroke, the walls would meet inside the bore


class Radial(LaboratoryKind):
    """Radial compression of a ring: its responses are slope, maximum force, travel and work."""

    name, options = "radial-compression", RadialSection

    def make(self, section: RadialSection, diameter: float) -> Kind:
        return RadialCompression()


@dataclass(frozen=True)
class RadialCompression(Kind):
    """Compression between plates that extend beyond the piece on all sides."""

    MOMENT: ClassVar[int | None] = None
    LAYERS: ClassVar[int | None] = 8
    WIDER: ClassVar[float] = 4.0

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the period of the ring's oval mode, ω = 6/√5 √(EI/ρA)/R², or of a wave across the ring if longer."""
        wall = 0.5 * stem.outer_diameter * (1.0 - stem.diameter_ratio)
        radius = 0.5 * (stem.outer_diameter - wall)
        oval = 2.0 * pi * radius**2 * sqrt(5.0 * 12.0) / (6.0 * wall * wave_speed)
        return max(oval, 2.0 * stem.outer_diameter / wave_speed)

    def modulus(self, stem: Stem, material: Material) -> float:
        return material.transverse.elastic_modulus if material.transverse else material.elastic_modulus

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return a mesh that is fine at both plates and coarse at the sides and along the piece.

        If the elements at the plates were wider than the contact zone, a single line of nodes would carry the force.
        """
        from stemcal.cutting.build import around_half, stem_mesh

        coarse = how.coarsening_around
        around = np.linspace(-1.0, 1.0, around_half(0.5 * stem.outer_diameter, how))
        widths = 1.0 + (coarse - 1.0) * (1.0 - np.abs(around))
        pairs = max(2, ceil(0.5 * stem.length / (coarse * how.element_size)))
        layers = 0.5 * stem.length * np.arange(0 if how.symmetry == "quarter" else -pairs, pairs + 1) / pairs
        return stem_mesh(stem, how, widths=widths, layers=layers)

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        from stemcal.laboratory.build import plate

        outer, half = 0.5 * stem.outer_diameter, stem.length
        return (
            plate(outer + loading.gap, half, upwards=False, speed=-loading.speed),
            plate(-outer, half, upwards=True, speed=0.0),
        )

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, laws: Sequence[Material]) -> Array:
        """Return the velocities of a uniform compression with the lower plate at rest: ż = −v (z + R)/2R."""
        down = 0.5 + mesh.nodes[:, 2] / stem.outer_diameter
        return np.asarray(-loading.speed * down[:, None] * [0.0, 0.0, 1.0])
