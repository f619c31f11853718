"""Three-point bending: a piece of stem on two rollers, with a third roller pressing between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, pi
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from stemcal.arrays import Array
from stemcal.laboratory import Kind
from stemcal.study.model.laboratory_kind import LaboratoryKind, PieceSection
from stemcal.study.types.field_types import Length, Size, StemLength

if TYPE_CHECKING:
    from stemcal.cutting.parts import Discretisation, Loading, Stem
    from stemcal.fem.material import Material
    from stemcal.fem.mesh import Mesh
    from stemcal.fem.tools import Tool


class BendingSection(PieceSection):
    """Section of a bending test: a nose presses the middle of a piece that lies on two rollers."""

    kind: Literal["three-point-bending"] = "three-point-bending"
    span: StemLength
    """Distance between the axes of the supports."""
    radius: Size = 5.0
    """Radius of the nose and of the supports."""

    across_axis = False
    usual_size = Length(divisor=12.0)
    plausible: ClassVar[Mapping[str, tuple[float, float]]] = {
        **PieceSection.plausible,
        "radius": (0.1, 100.0),
        "span": (1.0, 2000.0),
    }

    def long(self, diameter: float) -> float:
        return 1.2 * self.span.at(diameter) if self.length is None else self.length.at(diameter)

    def misfits(self, diameter: float, ratio: float) -> Iterator[tuple[str, str, str]]:
        length, span = self.long(diameter), self.span.at(diameter)
        if length <= span:
            message = f"the specimen is {length:g} mm long, but the span is {span:g} mm"
            yield "length", message, "use a longer specimen"
        yield from super().misfits(diameter, ratio)

    def shear_over_bending(self, diameter: float, ratio: float, softness: float) -> float:
        """Return deflection by shear over that by bending, 12 EI/(κGA L²): span L, `ratio` bore/d, `softness` E/G."""
        squared = (0.25 * diameter * hypot(1.0, ratio) / self.span.at(diameter)) ** 2
        return 12.0 * softness * squared / shear_coefficient(ratio)


class Bending(LaboratoryKind):
    """Three-point bending of a piece of stem: its responses are slope, maximum force, travel and work."""

    name, options = "three-point-bending", BendingSection

    def make(self, section: BendingSection, diameter: float) -> Kind:
        return ThreePointBending(section.span.at(diameter), section.radius, section.radius)


def shear_coefficient(ratio: float) -> float:
    """Return the shear coefficient κ of a ring for ν = 0 (Cowper, J. Appl. Mech. 33, 335, 1966); `ratio` = bore/d."""
    squared = ratio**2
    whole = (1.0 + squared) ** 2
    return 6.0 * whole / (7.0 * whole + 20.0 * squared)


@dataclass(frozen=True)
class ThreePointBending(Kind):
    """Bending on two supports: distance between their axes, radius of the nose, and radius of the supports, mm."""

    span: float
    nose_radius: float = 5.0
    support_radius: float = 5.0
    PERIODS: ClassVar[float] = 16.0
    MOMENT: ClassVar[int | None] = 2
    LONGER: ClassVar[float] = 3.0  # in a uniform mesh more nodes rest on the supports: a short piece was 4 % stiffer

    def slowest_period(self, stem: Stem, wave_speed: float) -> float:
        """Return the period of the first bending mode between the supports, 2 L²/π √(ρA/EI)."""
        gyration = 0.25 * stem.outer_diameter * hypot(1.0, stem.diameter_ratio)  # √(I/A) of a ring
        return 2.0 / pi * self.span**2 / (wave_speed * gyration)

    def modulus(self, stem: Stem, material: Material) -> float:
        """Return E; for a transversely isotropic material E/(1 + π² EI/(κGA L²)), as shear slows the first mode."""
        if material.transverse is None:
            return material.elastic_modulus
        softer = material.elastic_modulus / (shear_coefficient(stem.diameter_ratio) * material.transverse.shear_modulus)
        gyration = 0.25 * stem.outer_diameter * hypot(1.0, stem.diameter_ratio)
        return material.elastic_modulus / (1.0 + softer * (pi * gyration / self.span) ** 2)

    def mesh(self, stem: Stem, how: Discretisation) -> Mesh:
        from stemcal.cutting.build import stem_mesh

        return stem_mesh(stem, how, rests_at=0.5 * self.span)

    def tools(self, stem: Stem, loading: Loading, both_sides: bool) -> tuple[Tool, ...]:
        from stemcal.laboratory.build import roller

        outer, half = 0.5 * stem.outer_diameter, 0.5 * self.span
        nose = roller(0.0, self.nose_radius, -loading.speed, outer + self.nose_radius + loading.gap)
        sides = (half, -half) if both_sides else (half,)
        return (nose, *(roller(x, self.support_radius, 0.0, -outer - self.support_radius) for x in sides))

    def motion(self, mesh: Mesh, stem: Stem, loading: Loading, laws: Sequence[Material]) -> Array:
        """Return the velocities of a beam whose middle is moved by a load at speed v, with ξ = 2|x|/L.

        Bending: w = v (1 − (3ξ² − ξ³)/2) downwards, linear beyond the supports (ξ > 1), and ẋ = z dw/dx (plane
        sections). In a stem with fibres, shear adds s v (1 − ξ) with s = 12 EI/(κGA L²), without rotating sections.
        """
        x, z, half = mesh.nodes[:, 0], mesh.nodes[:, 2], 0.5 * self.span
        moments = np.diff(np.array(stem.radii) ** 4)
        slow = moments @ [self.modulus(stem, law) for law in laws]  # Σ EI / (1 + π² EI/(κGA L²))
        sheared = 12.0 / pi**2 * (moments @ [law.elastic_modulus for law in laws] / slow - 1.0)
        xi = np.abs(x) / half
        inside = np.minimum(xi, 1.0)
        down = 1.0 - 0.5 * (3.0 * inside**2 - inside**3) - 1.5 * (xi - inside)
        slope = np.sign(x) * (-0.5 * (6.0 * inside - 3.0 * inside**2)) / half
        speed = loading.speed / (1.0 + sheared)
        return np.asarray(speed * np.stack([z * slope, np.zeros_like(x), -down - sheared * (1.0 - inside)], axis=1))
