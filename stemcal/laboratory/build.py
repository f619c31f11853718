"""The input of a laboratory test of a piece of stem, and its finite element model."""

from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import pi, sqrt

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.build import crowns, materials, through_layers, through_wall
from stemcal.cutting.constraints import mirrors
from stemcal.cutting.parts import SHARES, Discretisation, Loading, Stem
from stemcal.fem.material import Layers, Material
from stemcal.fem.mesh import Mesh
from stemcal.fem.model import Integration, Model
from stemcal.fem.tools import Contact, Tool
from stemcal.laboratory import Kind

# Minimum number of elements through the wall. One layer, with integration points in its middle, has no bending
# stiffness; two layers must be a tenth thicker for it (`thickened`), which increases the plastic moment by a fifth.
_FEWEST_LAYERS = 3


@dataclass(frozen=True)
class LaboratoryTest:
    """Input of one virtual test of a piece of stem other than cutting; `material` and `outer` as in `ShearTest`."""

    kind: Kind
    material: Material
    stem: Stem
    loading: Loading
    contact: Contact = field(default_factory=lambda: Contact(0.15, 0.10))
    outer: tuple[Material, ...] = field(default=(), kw_only=True)
    discretisation: Discretisation = field(default_factory=Discretisation)

    @property
    def laws(self) -> tuple[Material, ...]:
        """Materials of the layers from the inside."""
        return (self.material, *reversed(self.outer))


def layered(stem: Stem, how: Discretisation) -> Discretisation:
    """Return the mesh settings with at least three elements through the wall: thin walls of one element wrinkled."""
    if how.through_wall or not stem.diameter_ratio:
        return how
    return replace(how, through_wall=max(_FEWEST_LAYERS, through_wall(stem, how)))


def roller(x: float, radius: float, speed: float, height: float) -> Tool:
    """Return a cylinder along y with its axis at (x, height), mm, and a speed along z, mm/s."""
    tip = 1.0e-3 * radius
    return Tool(((x - tip, 0.0), (x + tip, 0.0), (x, tip)), radius, height, speed, faces=True)


def plate(face: float, half_length: float, upwards: bool, speed: float) -> Tool:
    """Return a plate with its flat face at z = `face`, facing up or down, from x = −half_length to half_length, mm."""
    edge, thickness = 1.0, 5.0
    low, high = (-edge - thickness, -edge) if upwards else (edge, edge + thickness)
    left, right = -half_length, half_length
    return Tool(((left, low), (right, low), (right, high), (left, high)), edge, face, speed, faces=True)


# Damping rate of deviations from the initial velocities (`Model.settling`), per duration of the loading: 0.4 of
# critical damping for a mode with 16 periods. It also resists the changed motion after yield: with 8 periods of
# bending, the force of a plastic hinge was 1.6 % too low.
_SETTLING = 80.0

# Minimum contact stiffness as a multiple of m/Δt², because a roller touches only a small part of a face. With 0.25, the
# deflection of the contact was a twentieth of a short stroke.
_PENALTY = 0.5


def build_piece(test: LaboratoryTest) -> Model:
    """Return the finite element model of a test."""
    how, stem = test.discretisation, test.stem
    mesh = test.kind.mesh(stem, how)
    mirrored = mirrors(mesh, how.symmetry)
    held = mirrored | test.kind.driven(mesh, stem)
    velocity = test.kind.motion(mesh, stem, test.loading, test.laws)
    return Model(
        mesh=mesh,
        material=materials(mesh, stem, test.material, test.outer),
        tools=test.kind.tools(stem, test.loading, both_sides=how.symmetry != "quarter"),
        contact=replace(test.contact, penalty=max(_PENALTY, test.contact.penalty)),
        hourglass=how.hourglass,
        integration=integration(test),
        held=held,
        velocity=np.where(mirrored, 0.0, velocity),
        crowns=crowns(mesh),
        settling=min(1.0, _SETTLING / how.integration.outputs),
    )


def rounded(test: LaboratoryTest) -> LaboratoryTest:
    """Return the test with a wider stem, whose mesh has the moment `Kind.MOMENT` of the round cross-section.

    A polygon inscribed in the circle is smaller, and a single integration point does not include the variation of zᵐ
    over the element: with elements of d/12, the area is 0.5 % and the second moment 1.4 % too small.
    """
    moment, how, stem = test.kind.MOMENT, test.discretisation, test.stem
    if moment is None:
        return thickened(test)
    mesh = test.kind.mesh(stem, how)
    layers = materials(mesh, stem, test.material, test.outer)
    moduli = [law.elastic_modulus / test.material.elastic_modulus for law in test.laws]
    weights = layers.each(moduli) if isinstance(layers, Layers) else 1.0
    meshed = float((weights * mesh.volumes()) @ _centres(mesh) ** moment) / (SHARES[how.symmetry] * stem.length)
    # ∫ E zᵐ dA of the round section from Σ E (R^power − r^power) of its layers, with E relative to the innermost layer
    power = moment + 2
    rings = zip(moduli, pairwise(stem.radii), strict=True)
    whole = pi * sum(E * (high**power - low**power) for E, (low, high) in rings) / (1.0 if moment == 0 else 4.0)
    factor = (whole / meshed) ** (1.0 / power)
    wider = tuple(factor * thickness for thickness in stem.layers)
    return replace(test, stem=replace(stem, outer_diameter=factor * stem.outer_diameter, layers=wider))


def _centres(mesh: Mesh) -> Array:
    """Return z (E,) of the centroid of the cross-section of each element, mm, computed from two triangles."""
    triangles = mesh.nodes[mesh.hexes[:, [[0, 1, 2], [0, 2, 3]]], 1:]
    areas = np.abs(np.linalg.det(triangles[:, :, 1:] - triangles[:, :, :1]))
    return np.asarray((areas * triangles[..., 1].mean(axis=2)).sum(axis=1) / areas.sum(axis=1))


def thickened(test: LaboratoryTest) -> LaboratoryTest:
    """Return the test with a wall thickened about its mid-line, so that the mesh has the true wall's bending stiffness.

    With one integration point in the middle of each of n layers, a wall w has the second moment (1 − 1/n²) w³/12, so w
    is multiplied by (1 − 1/n²)^(−1/3). The plastic moment, exact for even n before, increases by the square of this
    factor: 1.1 % with 8 layers. Walls with fewer than three layers are not changed.
    """
    how, stem = test.discretisation, test.stem
    layers = through_wall(stem, how)
    if stem.diameter_ratio == 0.0 or layers < _FEWEST_LAYERS:
        return test
    if test.outer:
        return replace(test, stem=_stiffened(test))
    middle = 0.5 * (1.0 + stem.diameter_ratio)
    half_wall = (1.0 - middle) * (1.0 - layers**-2.0) ** (-1.0 / 3.0)
    outer, inner = middle + half_wall, middle - half_wall
    if inner <= 0.0:
        return test
    thicker = replace(stem, outer_diameter=outer * stem.outer_diameter, diameter_ratio=inner / outer)
    return replace(test, stem=thicker)


def _stiffened(test: LaboratoryTest) -> Stem:
    """Return the layered stem with all layers thicker by a factor f, so that the mesh has its true bending stiffness.

    With E and thickness w of each layer of elements at z and the neutral line z₀, the stiffness of the mesh,
    f³ Σ E w (z − z₀)², must be Σ E (w (z − z₀)² + w³/12).
    """
    stem, laws = test.stem, test.laws
    counts = through_layers(stem, test.discretisation)
    moduli = np.repeat([test.kind.modulus(stem, law) for law in laws], counts)
    ends = zip(pairwise(stem.radii), counts, strict=True)
    lines = np.concatenate([stem.radii[:1], *(np.linspace(*both, n + 1)[1:] for both, n in ends)])
    widths, z = np.diff(lines), 0.5 * (lines[1:] + lines[:-1])
    z = z - np.average(z, weights=moduli * widths)
    points, own = float(moduli * widths @ z**2), float(moduli @ widths**3) / 12.0
    factor = (1.0 + own / points) ** (1.0 / 3.0)
    outer, wall = 0.5 * stem.outer_diameter, stem.radii[-1] - stem.radii[0]
    wider = 1.0 + 0.5 * (factor - 1.0) * wall / outer
    thicker = tuple(factor * thickness for thickness in stem.layers)
    ratio = max(0.0, 1.0 - factor * wall / (wider * outer))
    return replace(stem, outer_diameter=wider * stem.outer_diameter, diameter_ratio=ratio, layers=thicker)


def integration(test: LaboratoryTest) -> Integration:
    """Return the settings of the time integration, with the mass scaled.

    The factor s ≥ 1 on the density makes natural periods √s times as long, so that the loading lasts `PERIODS` of the
    slowest one. Strain rates are not changed.
    """
    period = test.kind.slowest_period(test.stem, _wave_speed(test))
    scaling = (test.loading.duration / (test.kind.PERIODS * period)) ** 2
    return replace(test.discretisation.integration, mass_scaling=max(1.0, scaling), time_step=None)


def _wave_speed(test: LaboratoryTest) -> float:
    """Return √(E/ρ) of the piece, mm/s; E of layers is averaged by section moments (`MOMENT`), ρ by areas."""
    if not test.outer:
        return sqrt(test.kind.modulus(test.stem, test.material) / test.material.density)
    power = 2 + (test.kind.MOMENT or 0)
    ends = np.array(test.stem.radii)
    moments, areas = np.diff(ends**power), np.diff(ends**2)
    E = np.average([test.kind.modulus(test.stem, law) for law in test.laws], weights=moments)
    return sqrt(float(E / np.average([law.density for law in test.laws], weights=areas)))
