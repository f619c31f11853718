"""A laboratory test from another package: four-point bending, two noses between two supports.

Between the noses the moment is the same everywhere, and there is no shear. The test has a response of its own, the
proportional limit. In a spec::

    tests:
      - {name: four, kind: four-point-bending, span: 96 mm, inner: 32 mm, stroke: 4 mm}
    targets:
      - {test: four, diameter: 8 mm, proportional_limit: 40 N, sd: 3 N, n: 10}
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, hypot, pi
from typing import ClassVar, Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.build import stem_mesh
from stemcal.cutting.parts import Discretisation, Loading, Stem
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh
from stemcal.fem.tools import Tool
from stemcal.laboratory import Kind
from stemcal.laboratory.build import roller
from stemcal.responses import ForceTravel, Response, secant
from stemcal.study.model.laboratory_kind import LaboratoryKind, PieceSection
from stemcal.study.types.field_types import Length, Size, StemLength


class FourPointSection(PieceSection):
    """Bending by two noses between two supports."""

    kind: Literal["four-point-bending"] = "four-point-bending"
    span: StemLength
    """Distance between the axes of the supports."""
    inner: StemLength
    """Distance between the axes of the noses."""
    radius: Size = 5.0
    """Radius of noses and supports."""

    usual_size = Length(divisor=12.0)

    def long(self, diameter: float) -> float:
        return 1.2 * self.span.at(diameter) if self.length is None else self.length.at(diameter)

    def misfits(self, diameter: float, ratio: float) -> Iterator[tuple[str, str, str]]:
        if self.inner.at(diameter) >= self.span.at(diameter):
            yield "inner", "the noses are not between the supports", "move them closer"
        if self.long(diameter) <= self.span.at(diameter):
            yield "length", "the piece does not reach over the supports", "take a longer piece"
        yield from super().misfits(diameter, ratio)


class FourPoint(LaboratoryKind):
    """The entry point."""

    name, options = "four-point-bending", FourPointSection

    def make(self, section: FourPointSection, diameter: float) -> Kind:
        return FourPointBending(section.span.at(diameter), section.inner.at(diameter), section.radius)


def proportional_limit(test: ForceTravel) -> float | None:
    """Return the force at which the curve is first 10 % below its secant from 20 to 50 % of the maximum, N."""
    if (slope := secant(test.travel, test.force)) is None:
        return None
    rise = slice(int(np.argmax(test.force >= 0.2 * test.peak_force)), None)
    travel, force = test.travel[rise], test.force[rise]
    below = force < 0.9 * (force[0] + slope * (travel - travel[0]))
    return float(force[int(np.argmax(below))]) if below.any() else None


PROPORTIONAL_LIMIT = Response(
    *("proportional_limit", "Proportional limit", "F_p", "N"),
    of=proportional_limit,
    meaning="Mean force at which the curve leaves its secant by 10 %.",
    tests=frozenset({"four-point-bending"}),
)


@dataclass(frozen=True)
class FourPointBending(Kind):
    """Distances between the supports and between the noses, radius of all, mm."""

    span: float
    inner: float
    radius: float
    PERIODS: ClassVar[float] = 16.0
    MOMENT: ClassVar[int | None] = 2

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the period of the first bending mode between the supports, 2 L²/π √(ρA/EI)."""
        gyration = 0.25 * stem.outer_diameter * hypot(1.0, stem.diameter_ratio)  # √(I/A) of a ring
        return 2.0 / pi * self.span**2 / (wave_speed * gyration)

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        """Return a mesh with a layer of nodes under each nose and over each support."""
        at = (0.0, 0.5 * self.inner, 0.5 * self.span, 0.5 * stem.length)
        parts = [np.linspace(a, b, ceil((b - a) / how.element_size) + 1) for a, b in pairwise(at)]
        return stem_mesh(stem, how, layers=np.concatenate([parts[0], parts[1][1:], parts[2][1:]]))

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        """Return a nose and a support: the quarter of the piece that is simulated has one of each."""
        height = 0.5 * stem.outer_diameter + self.radius
        nose = roller(0.5 * self.inner, self.radius, -loading.speed, height + loading.gap)
        return nose, roller(0.5 * self.span, self.radius, 0.0, -height)

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, laws: Sequence[Material]) -> Array:
        """Return the velocities of a slender beam; with s from the support, c from there to the nose, and span L:

        w ∝ s (3c(L − c) − s²) up to the nose, c (3s(L − s) − c²) between the noses, straight beyond the supports.
        """
        x, z, span = mesh.nodes[:, 0], mesh.nodes[:, 2], self.span
        s, c = 0.5 * span - x, 0.5 * (span - self.inner)
        end, outside, between = 3.0 * c * (span - c), s < 0.0, s > c
        down = np.where(outside, end * s, np.where(between, c * (3.0 * s * (span - s) - c**2), s * (end - s**2)))
        slope = np.where(outside, end, np.where(between, 3.0 * c * (span - 2.0 * s), end - 3.0 * s**2))
        scale = loading.speed / (c**2 * (3.0 * span - 4.0 * c))  # the noses move as fast as the machine
        return scale * np.stack([-z * slope, np.zeros_like(x), -down], axis=1)
