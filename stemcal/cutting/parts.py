"""What determines a virtual shear test: stem, blade, supports, loading, contact, and how it is computed."""

from dataclasses import dataclass, field, replace
from itertools import accumulate
from math import radians, tan
from typing import Literal

from stemcal.fem.contact import Contact
from stemcal.fem.material import Material
from stemcal.fem.model import Integration


@dataclass(frozen=True)
class Blade:
    """A wedge: body thickness and width (height) in mm, included edge angle in degrees, radius of its edge in mm.

    `edge_spread` is the distance from its profile within which it acts on the surface next to its edge, mm; with 0 the
    edge is a line. `bevel` both: the flanks lean equally to both sides. one: one flank is vertical.
    """

    thickness: float = 2.3
    width: float = 28.0
    edge_angle: float = 37.5
    edge_radius: float = 0.1
    bevel: Literal["both", "one"] = "both"
    edge_spread: float = 0.0

    def outline(self) -> tuple[tuple[float, float], ...]:
        """Return the polygon that, swollen by the edge radius, is the blade; its lowest line is z = 0."""
        r, t = self.edge_radius, self.thickness - 2.0 * self.edge_radius
        if self.bevel == "one":
            return ((0.0, r), (t, r + t / tan(radians(self.edge_angle))), (t, self.width), (0.0, self.width))
        shoulder = r + 0.5 * t / tan(radians(0.5 * self.edge_angle))
        return ((0.0, r), (0.5 * t, shoulder), (0.5 * t, self.width), (-0.5 * t, self.width), (-0.5 * t, shoulder))


Symmetry = Literal["none", "half", "quarter"]
SupportKind = Literal["span", "clamped", "counter_edge"]
Until = Literal["first_fracture", "severed"]

# The share of the real thing that each model holds: half is cut lengthwise (y ≥ 0), quarter also across (x ≥ 0).
SHARES: dict[str, float] = {"none": 1.0, "half": 0.5, "quarter": 0.25}


def rate_filter(diameter: float, speed: float) -> float:
    """Return the time over which the strain rate is smoothed, s: the blade (mm/s) travels 1 % of the diameter (mm)."""
    return 0.01 * diameter / speed


@dataclass(frozen=True)
class Stem:
    """A hollow cylinder, mm, its diameter ratio; `layers`: thicknesses around the innermost one, from the outside."""

    outer_diameter: float = 8.0
    diameter_ratio: float = 0.41
    length: float = 50.0
    layers: tuple[float, ...] = ()

    @property
    def radii(self) -> tuple[float, ...]:
        """The radii of its surfaces from the inside, mm: the bore (0 for a solid stem), the interfaces, the outside."""
        outer = 0.5 * self.outer_diameter
        inwards = accumulate(self.layers, lambda radius, thickness: radius - thickness, initial=outer)
        return (outer * self.diameter_ratio, *reversed(tuple(inwards)))

    def wider(self, factor: float) -> "Stem":
        """Return the stem with its section enlarged by a factor."""
        layers = tuple(factor * thickness for thickness in self.layers)
        return replace(self, outer_diameter=factor * self.outer_diameter, layers=layers)


@dataclass(frozen=True)
class Supports:
    """What carries the stem: two fixed blocks (``span``), or a clamp at its left end (``clamped``).

    With a ``counter_edge`` one block is below the clamped side, next to the blade.

    clearance: Distance between the two blocks, or between the counter-edge and the blade, mm.
    fillet_radius: Radius of the edges of the blocks next to the blade, mm.
    height: Distance of the blade from the clamp, mm.
    """

    clearance: float = 20.0
    fillet_radius: float = 1.0
    kind: SupportKind = "span"
    height: float = 60.0


@dataclass(frozen=True)
class Loading:
    """Blade speed (mm/s), duration (s) and the gap at the start between edge and stem (mm).

    `until` first_fracture: elements that fail are deleted, and the test ends when the force has dropped. severed: the
    stem parts on the plane under the edge, and the test ends when it is in two parts. At a
    `sliding_angle` θ (degrees) the edge closes in at cos θ of the speed and slides along itself at sin θ.
    """

    speed: float = 100.0 / 60.0
    duration: float = 0.5
    gap: float = 0.001
    until: Until = "first_fracture"
    sliding_angle: float = 0.0


@dataclass(frozen=True)
class Discretisation:
    """How the stem is meshed and integrated.

    element_size: Length of an element along and around the stem, mm.
    through_wall: Elements through the wall; with None they are at most `element_size` long.
    symmetry: ``quarter`` and ``half`` mirror the rest of the stem.
    edge_over: Mesh phase along the stem: the edge comes down over the middle of a row of ``elements``, which no mirror
        plane may cut in two, or on a row of ``nodes``.
    turn, shift: Fractions of an element by which the mesh is turned about the axis (full model) and shifted along it
        (full and half model).
    coarsening: Length along the stem of the outermost elements over that of those under the blade; 1 is an even mesh.
    coarsening_around: Width around the stem of the elements at its bottom over that of those under the edge.
    hourglass, integration: Of the solver, see `fem.model.Model`.
    filter_window: Width of the moving mean over the force, s.
    break_drop: The stem counts as fractured once elements have failed and the force has dropped by this share of its
        peak, as a testing machine's break detection has it; 1 never finds a break, so that the peak is that of the
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
    coarsening_around: float = 1.0
    hourglass: float = 0.01
    integration: Integration = field(default_factory=lambda: Integration(mass_scaling=1.0e4, outputs=500))
    filter_window: float = 0.01
    break_drop: float = 0.5
    stop_after_peak: bool = True

    def __post_init__(self) -> None:
        """Refuse a mirror plane through elements."""
        if self.symmetry == "quarter" and self.edge_over == "elements":
            raise ValueError('a quarter model requires edge_over="nodes"; use symmetry="half"')


@dataclass(frozen=True)
class ShearTest:
    """Everything that determines one virtual shear test; `outer`: materials around the innermost, from the outside."""

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
        """Whether the stem parts under the edge."""
        return self.loading.until == "severed"
