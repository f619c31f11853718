"""Convert settings of the embedded solver to equivalent values for LS-DYNA and OpenRadioss.

Contact stiffness, mass scaling, rate law and nonlocal length are defined differently in these programs. The hourglass
coefficient has the same definition (`fem.material.HOURGLASS_SHARE`).
"""

from math import sqrt

import numpy as np

from stemcal.arrays import Array, Ints
from stemcal.fem.kernels.search import FACES
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh
from stemcal.solvers.options import DeckSolver, EmbeddedSolver

# Ratio (2L + h)/ℓ: L nonlocal length of OpenRadioss, h element length, ℓ length in the weight exp(−r²/ℓ²) of the
# embedded solver. If one row of elements elongates by u, the averaged strain is u/(ℓ √π) in the embedded solver, and
# u/(2L + h) in OpenRadioss, which solves ε̄ − L² ∇²ε̄ = ε and averages the nodes of an element. In simulations,
# necking bars need a ratio of 1.7 (tests/verification/necking_bar.py), stems of 8 mm below a rounded edge one of 2.
_RADIOSS_LENGTH = 2.0
# L/ℓ for LS-DYNA. Both averages have the same mean r²: 3/5 L² for the weight (1 + (r/L)⁸)⁻² of LS-DYNA, which is almost
# a ball of radius L, and 3/2 ℓ² for exp(−r²/ℓ²).
_DYNA_LENGTH = sqrt(2.5)
# Ratio r/s: a rounded edge of radius r cuts at the same force as a sharp edge whose force is spread over the length s.
_NOSE = 1.4
# A rate law is written only if it increases the yield stress by this share or more at the highest strain rate.
_NO_EFFECT = 1e-3


def wanted_step(solver: EmbeddedSolver | DeckSolver, mesh: Mesh, material: Material) -> float:
    """Return |DT2MS| of LS-DYNA, s: elements with a smaller stable time step get additional mass; 0 for no added mass.

    The cards contain the real density. A mass scaling n corresponds to √n times the stable step of the smallest
    element, a minimum time step Δt to Δt/TSSFAC. The larger of both is returned.
    """
    scaled = sqrt(solver.mass_scaling) * shortest(mesh) / _sound(material) if solver.mass_scaling > 1.0 else 0.0
    return max(scaled, (_time_step(solver) or 0.0) / solver.time_step_safety)


def density_factor(solver: EmbeddedSolver | DeckSolver, mesh: Mesh, material: Material) -> float:
    """Return the factor (≥ 1) for the density of the stem that makes `wanted_step` stable without added mass."""
    return max(1.0, (wanted_step(solver, mesh, material) * _sound(material) / shortest(mesh)) ** 2)


def nose_radius(spread: float) -> float:
    """Return the radius (mm) of the rounded edge with the cutting force of a sharp edge with this edge spread (mm)."""
    return _NOSE * spread


def nonlocal_length(length: float, program: str, size: float) -> float:
    """Return the nonlocal length (mm) of LS-DYNA or OpenRadioss that is equivalent to `length` ℓ (mm).

    OpenRadioss also averages over each element, so the length decreases with the element size `size` of the spec (mm);
    it is 0 if this average is wider than ℓ. The elements under an edge are 0.9 to 0.95 times as long as `size`.
    """
    return max(0.5 * (_RADIOSS_LENGTH * length - size), 0.0) if program == "openradioss" else length * _DYNA_LENGTH


def shortest(mesh: Mesh) -> float:
    """Return the smallest V/A of an element, mm: volume over largest face, as for the time step of LS-DYNA."""
    return float((mesh.volumes() / _areas(mesh, mesh.hexes[:, FACES]).max(axis=1)).min())


def contact_scale(
    solver: EmbeddedSolver | DeckSolver, mesh: Mesh, material: Material, share: float, place: tuple[float, float, float]
) -> float:
    """Return the factor SFS for which the contact stiffness at a place of the stem's surface is share · m/Δt².

    m is the nodal mass and Δt the time step of the embedded solver. A segment in LS-DYNA has the stiffness
    SLSFAC · SFS · K A²/V (K bulk modulus, A area, V volume of its element); in OpenRadioss, SFS · K A²/V. LS-DYNA uses
    the smaller stiffness of stem and tool, OpenRadioss their mean. With SLSFAC = 1 and the moduli of the stem in the
    tools, both programs have the same stiffness.
    """
    # mass of each element (t), scaled as in the embedded solver
    mass = solver.mass_scaling * material.density * mesh.volumes()
    # stable step 2/ω of each element, s: the formula of fem.kernels.timestep, here without compiling a kernel
    b, volumes = np.array(mesh.modal_gradients()), mesh.volumes()
    products = np.einsum("ime,jme->ije", b, b) / (8.0 * volumes**2)
    trace, norm = np.trace(products), np.abs(products).sum(axis=1).max(axis=0)
    bound = material.lame_modulus * trace + 2.0 * material.shear_modulus * norm
    steps = solver.time_step_safety * np.asarray(2.0 / np.sqrt(8.0 * volumes * bound / mass))
    # the embedded solver adds mass to elements whose stable step is below the minimum time step
    wanted = _time_step(solver) or 0.0
    masses, step = mass * np.maximum(1.0, wanted / steps) ** 2, max(wanted, float(steps.min()))
    nodal = np.bincount(mesh.hexes.ravel(), np.repeat(masses / 8.0, 8), minlength=len(mesh.nodes))
    face, squared_area_per_volume = _segment(mesh, place)
    return float(share * nodal[face].mean() / step**2 / (material.bulk_modulus * squared_area_per_volume))


def share_in_openradioss(mesh: Mesh, tool: Mesh, place: tuple[float, float, float]) -> float:
    """Return the contact stiffness of a node on a tool's sharp edge in OpenRadioss, divided by K A²/V of a segment.

    OpenRadioss uses the mean of K A²/V and the stiffness K (2 Vₙ)^⅓ of the node (asstifi.F, i25cor3.F); Vₙ is ⅛ of the
    volume of the elements at the node. It halves this mean (i25for3.F), because usually the nodes of both surfaces
    have contact forces. With a sharp edge, only the nodes of the edge have them.
    """
    _, segment = _segment(mesh, place)
    nearest = int(np.argmin(np.linalg.norm(tool.nodes - place, axis=1)))
    volume = float(np.sum((tool.hexes == nearest).any(axis=1) * tool.volumes())) / 8.0
    return 0.25 * (1.0 + float(np.cbrt(2.0 * volume)) / segment)


def _segment(mesh: Mesh, place: tuple[float, float, float]) -> tuple[Ints, float]:
    """Return the corners of the surface face nearest to a place, and A²/V (mm) from its area and element volume."""
    elements, sides = np.nonzero(mesh.neighbours() < 0)
    corners = mesh.hexes[elements[:, None], np.asarray(FACES)[sides]]
    nearest = int(np.argmin(np.linalg.norm(mesh.nodes[corners].mean(axis=1) - place, axis=1)))
    face = corners[nearest]
    area, volume = float(_areas(mesh, face[None, None])[0, 0]), float(mesh.volumes()[elements[nearest]])
    return face, area**2 / volume


def rate_constants(law: str, c: float, p: float, rate: float) -> tuple[float, float]:
    """Return C and P of 1 + (ε̇/C)^(1/P) for a rate law; zeros if the law has almost no effect up to `rate` (1/s).

    >>> rate_constants("cowper_symonds", 90.0, 8.0, 10.0), rate_constants("paper", 90.0, 8.0, 10.0)
    ((90.0, 8.0), (0.0, 0.0))
    >>> rate_constants("paper", 90.0, 0.5, 10.0)
    (90.0, 2.0)
    """
    if law == "cowper_symonds":
        return c, p
    return (0.0, 0.0) if law == "none" or (rate / c) ** p < _NO_EFFECT else (c, 1.0 / p)


def _areas(mesh: Mesh, faces: Ints) -> Array:
    corners = mesh.nodes[faces]
    diagonals = corners[..., 2, :] - corners[..., 0, :], corners[..., 3, :] - corners[..., 1, :]
    return np.asarray(0.5 * np.linalg.norm(np.cross(*diagonals), axis=-1))


def _time_step(solver: EmbeddedSolver | DeckSolver) -> float | None:
    return solver.time_step if isinstance(solver, EmbeddedSolver) else None


def _sound(material: Material) -> float:
    return sqrt(material.p_wave_modulus / material.density)
