"""A finite element model: body, material, tools and the settings of its integration in time."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stemcal.arrays import Array, Mask
from stemcal.fem.material import BulkViscosity, Layers, Material
from stemcal.fem.mesh import Mesh
from stemcal.fem.tools import Contact, Tool

Precision = Literal["mixed", "double"]


@dataclass(frozen=True)
class Integration:
    """Settings of the integration of the equations of motion by central differences.

    mass_scaling: Factor on the density. The loading speed remains real; wave speeds are divided by the factor's root.
    safety: Share of the stable time step that is used.
    outputs: Number of output intervals of the history.
    threads: Number of cores for this model, useful above some ten thousand elements; the result does not depend on it.
    time_step: Elements whose stable step is shorter than this, s, get additional mass. With None, the element with the
        shortest stable step determines the step.
    precision: ``mixed`` computes strains, stresses and hourglass forces of elements in single precision, relative to
        each element's first corner; positions, velocities, forces and sums of energy stay in double precision.
        ``double`` is for comparison with known solutions; studies are always computed with ``mixed``.
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
    tools, contact: Rigid tools and the contact law between tools and body.
    hourglass: Coefficient of the stiffness against the hourglass modes (`material.HOURGLASS_SHARE`).
    held: Prescribed velocity components (N, 3): these move with `velocity`, or are fixed without it.
    velocity: Initial velocities (N, 3), mm/s; on held components they apply at all times.
    loads: Constant nodal forces (N, 3), N.
    crowns: Height of the true curved surface over the middle of each flat element face (E, 6), mm.
    settling: Share of the deviation from the initial velocities that is removed at every output, to damp vibrations
        under slow loading; the energy removed is added to that of eroded nodes.
    """

    mesh: Mesh
    material: Material | Layers
    tools: tuple[Tool, ...] = ()
    contact: Contact = field(default_factory=Contact)
    hourglass: float = 0.01
    viscosity: BulkViscosity = field(default_factory=BulkViscosity)
    integration: Integration = field(default_factory=Integration)
    held: Mask | None = None
    velocity: Array | None = None
    loads: Array | None = None
    crowns: Array | None = None
    settling: float = 0.0

    @property
    def layers(self) -> Layers:
        """Materials of the elements; a single material applies to all elements."""
        if isinstance(self.material, Layers):
            return self.material
        return Layers((self.material,), np.zeros(len(self.mesh.hexes), dtype=int))
