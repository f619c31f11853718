"""Virtual laboratory tests of a piece of stem besides cutting: each kind has a module, `perform` simulates them.

`Kind` is what each declares about the piece and the tools. It imports nothing that simulates.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from stemcal.cutting.parts import Discretisation, Loading, Stem
    from stemcal.fem.contact import Tool
    from stemcal.fem.material import Material
    from stemcal.fem.mesh import Mesh

Array = NDArray[np.float64]


class Kind:
    """What is done to the piece, which is along x about the axis. A subclass is a frozen dataclass of its sizes, mm.

    PERIODS: The loading takes at least this number of the slowest natural periods: mass is scaled up to that.
    MOMENT: The moment m of the section that determines the response, ∫zᵐ dA: 0 its area, 2 its second moment; None for
        that of the wall about its mid-line (`build.rounded`).
    LAYERS: The number of elements through the wall; None as the size of the elements gives it.
    LONGER, WIDER: How much longer the elements are at the ends of the piece, and how much wider around it, than at the
        tool.
    """

    PERIODS: ClassVar[float] = 60.0
    MOMENT: ClassVar[int | None] = 0
    LAYERS: ClassVar[int | None] = None
    LONGER: ClassVar[float] = 1.0
    WIDER: ClassVar[float] = 1.0

    @property
    def widens_evenly(self) -> bool:
        """Whether the piece widens evenly as long as it does not buckle."""
        return False

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the slowest natural period that the test excites, s; of a bar's wave speed √(E/ρ) in mm/s."""
        raise NotImplementedError

    def modulus(self, stem: Stem, material: Material) -> float:
        """Return the E of that wave speed, MPa: of a material with an axis, the one that the slowest motion has."""
        return material.elastic_modulus

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return the mesh of the piece, or of the part of it that the symmetry leaves."""
        raise NotImplementedError

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        """Return the rigid tools, the moving one first; on one side of the middle only if a mirror makes the rest."""
        return ()

    def driven(self, mesh: Mesh, stem: Stem) -> NDArray[np.bool_]:
        """Return (N, 3) which components move at all times as `motion` gives them; by default all forces are tools'."""
        return np.zeros(mesh.nodes.shape, dtype=bool)

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, poisson_ratio: float) -> Array:
        """Return the velocities of the nodes at the start (N, 3), mm/s: of the slow motion to come; nothing swings."""
        raise NotImplementedError
