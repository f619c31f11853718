"""The embedded solver's numbers in the words of LS-DYNA's cards.

Contact stiffness, mass scaling and rate law are each defined in another way there. Every conversion is here once,
with what it rests on; the hourglass coefficient means the same (`fem.material.HOURGLASS_SHARE`).
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.search import FACES
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh
from stemcal.solvers.options import DeckSolver, EmbeddedSolver

Array = NDArray[np.float64]

# OpenRadioss's 2L + h over ℓ on elements of length h. Of a zone of one row of them its mean is 1/(2L + h) of what the
# zone elongates (ε̄ − L² ∇²ε̄ = ε, ε̄ the mean of an element's nodes), the mean by exp(−r²/ℓ²) 1/(ℓ √π). Bars that neck
# part alike with 1.7 (tests/verification/necking_bar.py), stems of 8 mm under a nose with 2.
_RADIOSS_LENGTH = 2.0
# LS-DYNA's L over ℓ: ⟨r²⟩ is 3/5 L² for its weight (1 + (r/L)⁸)⁻², as of a ball, and 3/2 ℓ² for exp(−r²/ℓ²).
_DYNA_LENGTH = sqrt(2.5)
# The radius of a nose over the distance within which a sharp edge acts: with it both have the same force.
_NOSE = 1.4
# A rate law that raises the yield stress by less than this at the highest rate has no effect.
_NO_EFFECT = 1e-3


def wanted_step(solver: EmbeddedSolver | DeckSolver, mesh: Mesh, material: Material) -> float:
    """Return dt2ms less its sign, s: small elements are given mass until they can take it; 0 for no scaling.

    The density of the cards is the real one. With a mass scaling n, the smallest element takes √n times its own step,
    with a time step Δt all take Δt/TSSFAC, whichever is more.
    """
    scaled = sqrt(solver.mass_scaling) * shortest(mesh) / _sound(material) if solver.mass_scaling > 1.0 else 0.0
    return max(scaled, (_time_step(solver) or 0.0) / solver.time_step_safety)


def density_factor(solver: EmbeddedSolver | DeckSolver, mesh: Mesh, material: Material) -> float:
    """Return the factor on the density with which the smallest element takes the wanted step by itself, at least 1.

    For a program whose nonlocal field cannot bear mass that is added to nodes.
    """
    return max(1.0, (wanted_step(solver, mesh, material) * _sound(material) / shortest(mesh)) ** 2)


def nose_radius(spread: float) -> float:
    """Return the radius of the nose (mm) that parts a stem at the force of a sharp edge spread so far (mm)."""
    return _NOSE * spread


def nonlocal_length(length: float, program: str, size: float) -> float:
    """Return the length (mm) of LS-DYNA or OpenRadioss whose average is that of ℓ (mm) here.

    OpenRadioss's is shorter on elements (mm) that are longer, since they average too; 0 where they alone do. `size` is
    that of the spec, of which rows under an edge have some 0.9 to 0.95.
    """
    return max(0.5 * (_RADIOSS_LENGTH * length - size), 0.0) if program == "openradioss" else length * _DYNA_LENGTH


def shortest(mesh: Mesh) -> float:
    """Return V/A of the smallest element, mm: its volume over its largest face, as LS-DYNA's time step has it."""
    return float((mesh.volumes() / _areas(mesh, mesh.hexes[:, FACES]).max(axis=1)).min())


def contact_scale(
    solver: EmbeddedSolver | DeckSolver, mesh: Mesh, material: Material, share: float, place: tuple[float, float, float]
) -> float:
    """Return the factor on K A²/V that makes a penalty as stiff as share · m/Δt² at a place of the stem's surface.

    A segment of LS-DYNA's has the stiffness SLSFAC · SFS · K A²/V (K bulk modulus, A area, V volume of its element);
    OpenRadioss takes SFS alone for SLSFAC · SFS. Both then combine those of stem and tool, one by the smaller, the
    other by the mean: tools of the stem's moduli and SLSFAC = 1 make them agree.
    """
    # the scaled mass of each element (t) and the time step (s) that the embedded solver begins with
    mass = solver.mass_scaling * material.density * mesh.volumes()
    # 2/ω of each element, s: fem.kernels.timestep without compiling it
    b, volumes = np.array(mesh.modal_gradients()), mesh.volumes()
    products = np.einsum("ime,jme->ije", b, b) / (8.0 * volumes**2)
    trace, norm = np.trace(products), np.abs(products).sum(axis=1).max(axis=0)
    bound = material.lame_modulus * trace + 2.0 * material.shear_modulus * norm
    steps = solver.time_step_safety * np.asarray(2.0 / np.sqrt(8.0 * volumes * bound / mass))
    wanted = _time_step(solver) or 0.0
    masses, step = mass * np.maximum(1.0, wanted / steps) ** 2, max(wanted, float(steps.min()))
    nodal = np.bincount(mesh.hexes.ravel(), np.repeat(masses / 8.0, 8), minlength=len(mesh.nodes))
    face, squared_area_per_volume = _segment(mesh, place)
    per_factor = material.bulk_modulus * squared_area_per_volume
    return float(share * nodal[face].mean() / step**2 / per_factor)


def share_in_openradioss(mesh: Mesh, tool: Mesh, place: tuple[float, float, float]) -> float:
    """Return K A²/V of OpenRadioss for a node of a tool's edge that acts on a mesh near a place.

    It takes the mean of that and the node's own stiffness K (2 Vₙ)^⅓, Vₙ the volume that its elements give a node
    (asstifi.F, i25cor3.F), and half of it (i25for3.F), since surfaces meet from both sides. A sharp edge does not.
    """
    _, segment = _segment(mesh, place)
    nearest = int(np.argmin(np.linalg.norm(tool.nodes - place, axis=1)))
    volume = float(np.sum((tool.hexes == nearest).any(axis=1) * tool.volumes())) / 8.0
    return 0.25 * (1.0 + float(np.cbrt(2.0 * volume)) / segment)


def _segment(mesh: Mesh, place: tuple[float, float, float]) -> tuple[NDArray[np.int32], float]:
    """Return the corners of the outer face that is nearest to a place, and A²/V (mm) of it."""
    elements, sides = np.nonzero(mesh.neighbours() < 0)
    corners = mesh.hexes[elements[:, None], np.asarray(FACES)[sides]]
    nearest = int(np.argmin(np.linalg.norm(mesh.nodes[corners].mean(axis=1) - place, axis=1)))
    face = corners[nearest]
    area, volume = float(_areas(mesh, face[None, None])[0, 0]), float(mesh.volumes()[elements[nearest]])
    return face, area**2 / volume


def rate_constants(law: str, c: float, p: float, rate: float) -> tuple[float, float]:
    """Return C and P with which 1 + (ε̇/C)^(1/P) is equivalent to a law; zeros where it has no effect up to `rate`.

    >>> rate_constants("cowper_symonds", 90.0, 8.0, 10.0), rate_constants("paper", 90.0, 8.0, 10.0)
    ((90.0, 8.0), (0.0, 0.0))
    >>> rate_constants("paper", 90.0, 0.5, 10.0)
    (90.0, 2.0)
    """
    if law == "cowper_symonds":
        return c, p
    return (0.0, 0.0) if law == "none" or (rate / c) ** p < _NO_EFFECT else (c, 1.0 / p)


def _areas(mesh: Mesh, faces: NDArray[np.int32]) -> Array:
    """Return the areas (…,) of faces (…, 4), mm²."""
    corners = mesh.nodes[faces]
    diagonals = corners[..., 2, :] - corners[..., 0, :], corners[..., 3, :] - corners[..., 1, :]
    return np.asarray(0.5 * np.linalg.norm(np.cross(*diagonals), axis=-1))


def _time_step(solver: EmbeddedSolver | DeckSolver) -> float | None:
    return solver.time_step if isinstance(solver, EmbeddedSolver) else None


def _sound(material: Material) -> float:
    return sqrt(material.p_wave_modulus / material.density)
