"""The input of a virtual shear test: stem, blade, supports, loading, contact, mesh and integration."""

from dataclasses import dataclass, field
from itertools import accumulate
from math import radians, tan
from typing import Literal

from stemcal.fem.material import Material
from stemcal.fem.model import Integration
from stemcal.fem.tools import Contact


@dataclass(frozen=True)
class Blade:
    """A wedge: thickness and width (height) of its body in mm, included edge angle in degrees, edge radius in mm.

    `edge_spread` is the distance from the blade's profile within which the edge acts on the surface of the stem, mm;
    with 0 the edge acts along a line. With the `bevel` ``both`` the flanks are symmetric, with ``one`` one is vertical.
    """

    thickness: float = 2.3
    width: float = 28.0
    edge_angle: float = 37.5
    edge_radius: float = 0.1
    bevel: Literal["both", "one"] = "both"
    edge_spread: float = 0.0

    def outline(self) -> tuple[tuple[float, float], ...]:
        """Return the corners (x, z) of the polygon whose offset by the edge radius is the blade; edge at z = 0."""
        r, t = self.edge_radius, self.thickness - 2.0 * self.edge_radius
        if self.bevel == "one":
            return ((0.0, r), (t, r + t / tan(radians(self.edge_angle))), (t, self.width), (0.0, self.width))
        shoulder = r + 0.5 * t / tan(radians(0.5 * self.edge_angle))
        return ((0.0, r), (0.5 * t, shoulder), (0.5 * t, self.width), (-0.5 * t, self.width), (-0.5 * t, shoulder))


Symmetry = Literal["none", "half", "quarter"]
SupportKind = Literal["span", "clamped", "counter_edge"]
Until = Literal["first_fracture", "severed"]

# Share of the real stem in each model: half has y ≥ 0, quarter also x ≥ 0.
SHARES: dict[str, float] = {"none": 1.0, "half": 0.5, "quarter": 0.25}


def rate_filter(diameter: float, speed: float) -> float:
    """Return the time over which strain rates are smoothed, s: the blade (mm/s) travels 1 % of the diameter (mm)."""
    return 0.01 * diameter / speed


@dataclass(frozen=True)
class Stem:
    """A hollow cylinder (mm; ratio inner/outer); `layers`: thicknesses of all but the innermost, from outside."""

    outer_diameter: float = 8.0
    diameter_ratio: float = 0.41
    length: float = 50.0
    layers: tuple[float, ...] = ()

    @property
    def radii(self) -> tuple[float, ...]:
        """Radii from the inside, mm: of the bore (0 for a solid stem), of the interfaces, and of the outer surface."""
        outer = 0.5 * self.outer_diameter
        inwards = accumulate(self.layers, lambda radius, thickness: radius - thickness, initial=outer)
        return (outer * self.diameter_ratio, *reversed(tuple(inwards)))


@dataclass(frozen=True)
class Supports:
    """The supports: two fixed blocks (``span``), or a clamp at the left end (``clamped``, ``counter_edge``).

    With ``counter_edge`` there is also one block under the clamped side, next to the blade.

    clearance: Distance between the two blocks, or between the counter-edge and the blade, mm.
    fillet_radius: Radius of the edges of the blocks next to the blade, mm.
    height: Distance of the blade from the clamp, mm.
    """

    clearance: float = 20.0
    fillet_radius: float = 1.0
    kind: SupportKind = "span"
    height: float = 60.0

    @property
    def rests_at(self) -> float:
        """Distance from the blade at which a stem rests on the two blocks, mm."""
        return 0.5 * self.clearance + self.fillet_radius


@dataclass(frozen=True)
class Loading:
    """Blade speed (mm/s), duration (s) and initial gap between edge and stem (mm).

    `until`: with ``first_fracture`` failed elements are deleted, and the test ends when the force has dropped; with
    ``severed`` the stem parts on the plane under the edge, and the test ends when the stem is in two parts. With a
    `sliding_angle` θ (degrees), the edge approaches the stem at cos θ of the speed and slides along itself at sin θ.
    """

    speed: float = 100.0 / 60.0
    duration: float = 0.5
    gap: float = 0.001
    until: Until = "first_fracture"
    sliding_angle: float = 0.0


@dataclass(frozen=True)
class Discretisation:
    """Settings of the mesh, the integration and the evaluation of the force.

    element_size: Length of an element along and around the stem, mm.
    through_wall: Number of elements through the wall; with None they are at most `element_size` long.
    symmetry: Part of the stem that is modelled, with mirror planes for the rest (`SHARES`).
    edge_over: Position of the mesh along the stem: the edge is over the middle of a row of ``elements`` or over a row
        of ``nodes``.
    turn, shift: Fractions of an element by which the mesh is rotated about the axis (full model) and shifted along it
        (full and half model).
    coarsening: Length along the stem of the outermost elements, relative to the elements under the blade.
    even: Minimum distance from the blade up to which the elements are as long as those under it, mm.
    coarsening_around: Width around the stem of the elements at its bottom, relative to the elements under the edge.
    hourglass, integration: Settings of the solver, see `fem.model.Model`.
    filter_window: Width of the moving mean of the force, s.
    break_drop: The stem counts as fractured when elements have failed and the force has dropped by this share of its
        peak, as in the break detection of testing machines. With 1, no break is detected, and the peak is that of the
        whole stroke.
    stop_after_peak: End the simulation at the first fracture.
    """

    element_size: float = 1.0
    through_wall: int | None = None
    symmetry: Symmetry = "quarter"
    edge_over: Literal["elements", "nodes"] = "nodes"
    turn: float = 0.0
    shift: float = 0.0
    coarsening: float = 1.0
    even: float = 0.0
    coarsening_around: float = 1.0
    hourglass: float = 0.01
    integration: Integration = field(default_factory=lambda: Integration(mass_scaling=1.0e4, outputs=500))
    filter_window: float = 0.01
    break_drop: float = 0.5
    stop_after_peak: bool = True

    def __post_init__(self) -> None:
        """Raise `ValueError` for a mirror plane through elements."""
        if self.symmetry == "quarter" and self.edge_over == "elements":
            raise ValueError('a quarter model requires edge_over="nodes"; use symmetry="half"')


@dataclass(frozen=True)
class ShearTest:
    """Input of one virtual shear test; `outer` are the materials of all layers but the innermost, from outside."""

    material: Material
    outer: tuple[Material, ...] = field(default=(), kw_only=True)
    stem: Stem = field(default_factory=Stem)
    blade: Blade = field(default_factory=Blade)
    supports: Supports = field(default_factory=Supports)
    loading: Loading = field(default_factory=Loading)
    contact: Contact = field(default_factory=lambda: Contact(0.15, 0.10))
    discretisation: Discretisation = field(default_factory=Discretisation)

    @property
    def parts(self) -> bool:
        """Whether the stem parts on the plane under the edge."""
        return self.loading.until == "severed"
