"""Radial compression: a piece of stem that is between two flat plates, pressed across its axis."""

from dataclasses import dataclass
from math import ceil, pi, sqrt
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import around_half, stem_mesh
from stemcal.cutting.parts import Discretisation, Loading, Stem
from stemcal.fem.contact import Tool
from stemcal.fem.mesh import Mesh
from stemcal.laboratory.parts import Array, plate, whole


@dataclass(frozen=True)
class RadialCompression:
    """Plates that reach beyond the piece on all sides."""

    PERIODS: ClassVar[float] = 60.0
    MOMENT: ClassVar[int | None] = None

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the period of the ring's oval mode, ω = 6/√5 √(EI/ρA)/R²; no less than that of a wave across."""
        wall = 0.5 * stem.outer_diameter * (1.0 - stem.diameter_ratio)
        radius = 0.5 * (stem.outer_diameter - wall)
        oval = 2.0 * pi * radius**2 * sqrt(5.0 * 12.0) / (6.0 * wall * wave_speed)
        return max(oval, 2.0 * stem.outer_diameter / wave_speed)

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return a mesh that is fine at both plates and coarse at the sides and along the piece.

        The plates meet nodes: where these are farther apart than the contact is wide, a single line of them carries it.
        """
        coarse = how.coarsening_around
        around = np.linspace(-1.0, 1.0, around_half(0.5 * stem.outer_diameter, how))
        widths = 1.0 + (coarse - 1.0) * (1.0 - np.abs(around))
        pairs = max(2, ceil(0.5 * stem.length / (coarse * how.element_size)))
        first = 0 if how.symmetry == "quarter" else -pairs
        layers = 0.5 * stem.length * np.arange(first, pairs + 1) / pairs
        return stem_mesh(stem, how, widths=widths, layers=layers)

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        """Return the upper plate and the lower one."""
        outer, half = 0.5 * stem.outer_diameter, stem.length
        return (
            plate(outer + loading.gap, half, upwards=False, speed=-loading.speed),
            plate(-outer, half, upwards=True, speed=0.0),
        )

    def driven(self, mesh: Mesh, stem: Stem) -> NDArray[np.bool_]:
        """Return nothing: all forces come from the tools."""
        return whole(mesh)

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, poisson_ratio: float) -> Array:
        """Return the velocities of an even squeeze, the lower plate at rest: ż = −v (z + R)/2R."""
        down = 0.5 + mesh.nodes[:, 2] / stem.outer_diameter
        return np.asarray(-loading.speed * down[:, None] * [0.0, 0.0, 1.0])
