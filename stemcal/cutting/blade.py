"""The blade and its profile."""

from dataclasses import dataclass
from math import radians, tan
from typing import Literal


@dataclass(frozen=True)
class Blade:
    """A wedge: body thickness and width (height) in mm, included edge angle in degrees, radius of its edge in mm.

    `edge_spread` is the distance from its profile within which it acts on the surface next to its edge, mm; with 0 the
    edge is a line.

    `bevel` both: the flanks lean equally to both sides. one: one flank is vertical.
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
