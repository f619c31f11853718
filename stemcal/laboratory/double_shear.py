"""Double shear: a piece of stem in the holes of three plates, the middle one of which is pushed across."""

from dataclasses import dataclass
from math import ceil
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import stem_mesh
from stemcal.cutting.parts import Discretisation, Loading, Stem
from stemcal.fem.contact import Tool
from stemcal.fem.mesh import Mesh
from stemcal.laboratory.parts import Array, layered

# Layers of elements between two plates at least, where all of the shearing is.
_FEWEST_BETWEEN = 3


@dataclass(frozen=True)
class DoubleShear:
    """Thickness of the middle plate and the gap between plates, mm.

    The holes fit: the skin of the piece moves as the plates do. F/2A is its shear strength.
    """

    plate: float
    gap: float
    PERIODS: ClassVar[float] = 60.0
    MOMENT: ClassVar[int | None] = 0

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the period of a wave across the stem and back."""
        return 2.0 * stem.outer_diameter / wave_speed

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return a mesh with layers of nodes at the edges of the holes."""
        edges = np.array([0.0, 0.5 * self.plate, 0.5 * self.plate + self.gap, 0.5 * stem.length])
        counts = [max(1, ceil(width / how.element_size)) for width in np.diff(edges)]
        counts[1] = max(counts[1], _FEWEST_BETWEEN)
        spans = zip(edges[:-1], edges[1:], counts, strict=True)
        parts = [np.linspace(first, last, n, endpoint=False) for first, last, n in spans]
        half = np.append(np.concatenate(parts), edges[-1])
        along = half if how.symmetry == "quarter" else np.concatenate([-half[:0:-1], half])
        return stem_mesh(stem, layered(stem, how), layers=along)

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        """Return none: the holes move the skin."""
        return ()

    def driven(self, mesh: Mesh, stem: Stem) -> NDArray[np.bool_]:
        """Return the nodes of the skin in the holes, in all directions."""
        x, radius = np.abs(mesh.nodes[:, 0]), np.hypot(mesh.nodes[:, 1], mesh.nodes[:, 2])
        small = 1e-6 * stem.outer_diameter
        between = (x > 0.5 * self.plate + small) & (x < 0.5 * self.plate + self.gap - small)
        skin = (radius > 0.5 * stem.outer_diameter - small) & ~between
        return np.repeat(skin[:, None], 3, axis=1)

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, poisson_ratio: float) -> Array:
        """Return the velocities of an even shear between the plates."""
        into = (np.abs(mesh.nodes[:, 0]) - 0.5 * self.plate) / self.gap
        down = loading.speed * np.clip(1.0 - into, 0.0, 1.0)
        return np.asarray(-down[:, None] * [0.0, 0.0, 1.0])

    def deflection_layers(self, stem: Stem) -> None:
        """Return None: there is no axis that bends."""
