"""Virtual laboratory tests of a piece of stem other than cutting: one module per kind; `perform` simulates them.

Each kind is a subclass of `Kind`. This module imports no solver, because specs are read without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from stemcal.arrays import Array, Mask

if TYPE_CHECKING:
    from stemcal.cutting.parts import Discretisation, Loading, Stem
    from stemcal.fem.material import Material
    from stemcal.fem.mesh import Mesh
    from stemcal.fem.tools import Tool


class Kind:
    """Mesh, tools and motion of one kind of test; the piece is along x. Subclasses are frozen dataclasses, in mm.

    PERIODS: Minimum duration of the loading in periods of the slowest vibration; mass is scaled up to this limit.
    MOMENT: Moment m of the section, ∫zᵐ dA, that determines the response: 0 its area, 2 its second moment; None for the
        bending stiffness of the wall about its mid-line (`build.rounded`).
    LAYERS: Number of elements through the wall; None for the number by the element size.
    LONGER: Length of the elements at the ends of the piece, relative to the elements at the tool.
    WIDER: Largest width of the elements around the piece, relative to the elements at the tool.
    """

    PERIODS: ClassVar[float] = 60.0
    MOMENT: ClassVar[int | None] = 0
    LAYERS: ClassVar[int | None] = None
    LONGER: ClassVar[float] = 1.0
    WIDER: ClassVar[float] = 1.0

    @property
    def widens_evenly(self) -> bool:
        """Whether the section of the piece widens uniformly unless it buckles."""
        return False

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the slowest natural period that the test excites, s, from the wave speed √(E/ρ) of a bar, mm/s."""
        raise NotImplementedError

    def modulus(self, stem: Stem, material: Material) -> float:
        """Return the E that determines the slowest natural period, MPa; by default, E along the stem."""
        return material.elastic_modulus

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return the mesh of the piece, or of the half or quarter that is modelled."""
        raise NotImplementedError

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        """Return the rigid tools, the moving tool first; with a mirror plane x = 0, only the tools at x ≥ 0."""
        return ()

    def driven(self, mesh: Mesh, stem: Stem) -> Mask:
        """Return a mask (N, 3) of the velocity components that `motion` prescribes at all times; none by default."""
        return np.zeros(mesh.nodes.shape, dtype=bool)

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, laws: Sequence[Material]) -> Array:
        """Return the initial velocities (N, 3) that excite no vibration, mm/s; `laws`: materials from the inside."""
        raise NotImplementedError
