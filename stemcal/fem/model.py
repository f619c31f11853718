"""A finite element model: body, material, tools and its integration in time."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.contact import Contact, Tool
from stemcal.fem.material import BulkViscosity, Layers, Material
from stemcal.fem.mesh import Mesh

Array = NDArray[np.float64]


Precision = Literal["mixed", "double"]


@dataclass(frozen=True)
class Integration:
    """How the equations of motion are integrated.

    mass_scaling: Factor on the density; loading keeps its real speed, waves become slower by its root.
    time_step: Elements that cannot take this step, s, are given mass until they can; None leaves it to the fastest of
        them.
    safety: Share of the stable time step that is used.
    outputs: Rows of the history.
    threads: Cores for this one model; worth it from some ten thousand elements on. The result does not depend on it.
    precision: ``mixed`` works out strains, stresses and hourglass forces of elements in single precision, relative to
        each element's first corner; positions, velocities, forces and sums of energy stay in double precision.
        ``double`` is for comparison with known answers; studies are always computed with ``mixed``.
    """

    mass_scaling: float = 1.0
    safety: float = 0.9
    outputs: int = 200
    threads: int = 1
    time_step: float | None = None
    precision: Precision = "mixed"


@dataclass(frozen=True)
class Model:
    """Everything that determines a simulation.

    mesh, material: The deformable body.
    tools, contact: Rigid tools around it and the law between them and it.
    hourglass: Coefficient of the stiffness against the hourglass modes (`material.HOURGLASS_SHARE`).
    held: Components that do not follow forces; they move with `velocity`, or are fixed.
    velocity: Velocity at the start, mm/s; on held components at all times.
    loads: Constant nodal forces, N.
    crowns: How far the true surface bulges over the middle of each face along a spread edge, mm.
    settling: Share of what velocities differ by from those at the start that is taken from them at every output, so
        that a slow loading does not swing; its energy counts as lost with eroded nodes.
    """

    mesh: Mesh
    material: Material | Layers
    tools: tuple[Tool, ...] = ()
    contact: Contact = field(default_factory=Contact)
    hourglass: float = 0.01
    viscosity: BulkViscosity = field(default_factory=BulkViscosity)
    integration: Integration = field(default_factory=Integration)
    held: NDArray[np.bool_] | None = None
    velocity: Array | None = None
    loads: Array | None = None
    crowns: Array | None = None
    settling: float = 0.0

    @property
    def layers(self) -> Layers:
        """The materials of the elements; all are of the first one where there is only one."""
        if isinstance(self.material, Layers):
            return self.material
        return Layers((self.material,), np.zeros(len(self.mesh.hexes), dtype=int))
