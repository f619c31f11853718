"""The solvers that come with stemcal, as a spec describes them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from stemcal.study.model.frozen import Frozen, Time
from stemcal.study.types.field_types import Number, Quantity, Whole
from stemcal.study.types.lengths import Length, StemLength

# The stem counts as broken once elements have failed and the force has dropped by this share of it.
BREAK_DROP = 0.5
# Up to this speed of the blade, 100 mm/min, added mass and time step are those of the spec, mm/s.
_SLOW = 100.0 / 60.0
# Keys that the embedded solver and the decks of other programs have in common.
HourglassCoefficient = Annotated[
    Number,
    Field(
        ge=0,
        le=1,
        description="Stiffness of the elements against hourglass modes, defined as LS-DYNA's QH of type 4. Too small: "
        "elements fold; too large: the stem is too stiff.",
    ),
]
ThroughWall = Annotated[
    Annotated[Whole, Field(ge=1, le=50)] | None,
    Field(description="Elements through the wall; as many as make them no longer than `element_size` by default."),
]
MassScaling = Annotated[
    Number,
    Field(
        ge=1,
        description="Factor on all mass. Larger time steps, more kinetic energy: watch its share in the checks of the "
        "runs.",
    ),
]
Outputs = Annotated[Whole, Field(ge=10, le=100_000, description="Points of the force history.")]
FilterWindow = Annotated[
    float,
    Quantity("time", at_least=0),
    Field(description="Window of the low-pass filter of the force; 0 s for none."),
]
EdgeOver = Annotated[
    Literal["elements", "nodes"],
    Field(description="Whether the edge comes down on a row of nodes or over the middle of a row of elements."),
]
Coarsening = Annotated[
    Number,
    Field(ge=1, le=10, description="Length of the elements at the ends of the stem over those under the edge."),
]
CoarseningAround = Annotated[
    Number,
    Field(ge=1, le=10, description="Width of the elements at the bottom of the section over those under the edge."),
]


class EmbeddedSolver(Frozen):
    """The explicit finite element solver that comes with stemcal."""

    kind: Literal["embedded"] = "embedded"
    """The solver that comes with stemcal."""
    rate_law: Literal["paper", "cowper_symonds", "none"] = "paper"
    """How speed raises the yield stress: `paper` 1 + (rate/C)^P as printed in the wild chrysanthemum study,
    `cowper_symonds` 1 + (rate/C)^(1/P), `none` not at all."""
    element_size: StemLength = Length(divisor=16.0)
    """Length of the elements under the edge: a length, or a share of the diameter such as d/16. At most 0.6 of
    `edge_spread` and `internal_length`."""
    elements_through_wall: ThroughWall = None
    edge_over: EdgeOver = "nodes"
    hourglass: HourglassCoefficient = 0.01
    mass_scaling: MassScaling = 1e4
    time_step: Time | None = 4e-5
    """Elements too small for this step are given mass until they can take it; without it none is given."""
    time_step_safety: Annotated[Number, Field(ge=0.001, le=1)] = 0.9
    """Share of the stable time step that is taken."""
    outputs: Outputs = 500
    filter_window: FilterWindow = 0.010
    coarsening: Coarsening = 6.0
    coarsening_around: CoarseningAround = 2.0
    replicates: Annotated[Whole, Field(ge=2, le=100)] | None = None
    """Simulations of each point, with the mesh at different positions along the stem. Their scatter enters every
    interval; without the key the mesh stays in one position."""
    time_limit: Time | None = None
    """How long one run may take, counted from its start; as long as it needs by default."""
    threads: Annotated[Whole, Field(ge=1, le=256)] = 1
    """Threads of one simulation, for a single large model; runs beside each other are `--workers`."""

    def at_speed(self, speed: float) -> EmbeddedSolver:
        """Return the options for a blade of this speed (mm/s): as they stand up to 100 mm/min, above in proportion.

        Inertia grows as ρV²: added mass that is harmless there must go as V⁻², time step and filter as V⁻¹, so that
        they keep their share of the travel. From 0.17 m/s on nothing is left of a mass scaling of 1e4: the mass is the
        true one.
        """
        slower = min(1.0, _SLOW / speed)
        return self.model_copy(
            update={
                "mass_scaling": max(1.0, self.mass_scaling * slower**2),
                "time_step": None if self.time_step is None else self.time_step * slower,
                "filter_window": self.filter_window * slower,
            }
        )
