"""NumPy twins of the compiled kernels, in the textbook's form and without any of their code.

Elements are written with shape functions, Jacobians and B matrices (Hughes, *The Finite Element Method*, 1987, ch. 3
and 4.5), hourglass control with Flanagan and Belytschko's γ vectors (Int. J. Numer. Meth. Eng. 17, 679-706, 1981),
plasticity with the norm ‖ξ‖ and the direction n = ξ/‖ξ‖ (Simo and Hughes, *Computational Inelasticity*, 1998, box
3.2). Tensors are 3×3 matrices, one element at a time. Slow, and meant to be read beside the books.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Reference coordinates of the corners: 1-4 around ζ = −1, 5-8 around ζ = +1.
CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float
)
GAUSS = CORNERS / np.sqrt(3.0)
# Γ: the four hourglass base vectors ηζ, ξζ, ξη, ξηζ at the corners.
GAMMA = np.array([CORNERS[:, 1] * CORNERS[:, 2], CORNERS[:, 0] * CORNERS[:, 2],
                  CORNERS[:, 0] * CORNERS[:, 1], CORNERS.prod(axis=1)])  # fmt: skip
IDENTITY = np.eye(3)


def shape_gradients(point: Array) -> Array:
    """Return ∂N_I/∂(ξ, η, ζ) of the trilinear hexahedron, (8, 3)."""
    terms = 1.0 + CORNERS * point
    return np.stack([CORNERS[:, i] * terms[:, (i + 1) % 3] * terms[:, (i + 2) % 3] / 8.0 for i in range(3)], axis=1)


def b_matrix(x: Array, point: Array) -> tuple[Array, float]:
    """Return ∂N_I/∂x (8, 3) and det J of an element with corners x (8, 3)."""
    reference = shape_gradients(point)
    jacobian = x.T @ reference
    return reference @ np.linalg.inv(jacobian), float(np.linalg.det(jacobian))


def mean_b_matrix(x: Array) -> tuple[Array, float]:
    """Return the volume mean of ∂N_I/∂x and the volume, by 2×2×2 Gauss points (exact: cofactors are quadratic)."""
    parts = [b_matrix(x, point) for point in GAUSS]
    volume = sum(det for _, det in parts)
    return sum(b * det for b, det in parts) / volume, volume


def symmetric(six: Array) -> Array:
    """Return the 3×3 matrix of (xx, yy, zz, xy, yz, zx)."""
    xx, yy, zz, xy, yz, zx = six
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])


def six(tensor: Array) -> Array:
    """Return (xx, yy, zz, xy, yz, zx) of a 3×3 matrix."""
    return np.array([tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[1, 2], tensor[2, 0]])


def deviator(tensor: Array) -> Array:
    """Return the part without trace."""
    return tensor - np.trace(tensor) / 3.0 * IDENTITY


def step_kinematics(gradient: Array, dt: float) -> tuple[Array, Array]:
    """Return Δε and Hughes and Winget's R = (I − ½Ω)⁻¹(I + ½Ω) of a gradient carried to the middle of the step."""
    middle = gradient + 0.5 * dt * gradient @ gradient
    strain = 0.5 * dt * (middle + middle.T)
    spin = 0.5 * dt * (middle - middle.T)
    return strain, np.linalg.solve(IDENTITY - 0.5 * spin, IDENTITY + 0.5 * spin)


@dataclass
class Point:
    """State of one integration point."""

    stress: Array = field(default_factory=lambda: np.zeros((3, 3)))
    back: Array = field(default_factory=lambda: np.zeros((3, 3)))
    plastic_strain: float = 0.0
    rate_factor: float = 1.0
    work: float = 0.0  # per volume, of the last step


def update_point(point: Point, gradient: Array, dt: float, m: Any) -> None:
    """Advance a point by one step: rotate, elastic trial, radial return, the rate factor of the next step."""
    strain, R = step_kinematics(gradient, dt)
    old, back = R @ point.stress @ R.T, R @ point.back @ R.T
    lame = m.bulk - 2.0 * m.shear / 3.0
    trial = old + lame * np.trace(strain) * IDENTITY + 2.0 * m.shear * strain
    xi = deviator(trial) - back
    norm = np.linalg.norm(xi)
    static = m.yield_stress + m.beta * m.plastic_modulus * point.plastic_strain
    radius = np.sqrt(2.0 / 3.0) * point.rate_factor * static
    slip = 0.0
    if norm > radius:
        hardening = (1.0 - m.beta) * m.plastic_modulus + point.rate_factor * m.beta * m.plastic_modulus
        slip = (norm - radius) / (2.0 * m.shear + 2.0 / 3.0 * hardening)
        n = xi / norm
        trial = trial - 2.0 * m.shear * slip * n
        back = back + 2.0 / 3.0 * (1.0 - m.beta) * m.plastic_modulus * slip * n
    yields = norm > np.sqrt(2.0 / 3.0) * static
    rate = np.linalg.norm(strain) / dt if dt > 0.0 else 0.0
    point.rate_factor = 1.0 + (rate / m.rate_c) ** m.rate_exponent if yields and m.rate_c > 0.0 and rate > 0.0 else 1.0
    point.work = 0.5 * float(np.sum((old + trial) * strain))
    point.stress, point.back = trial, back
    point.plastic_strain += np.sqrt(2.0 / 3.0) * slip


def viscous_pressure(trace: float, dt: float, length: float, m: Any) -> float:
    """Return q = ρ l (c₂ l ε̇ᵥ² + c₁ c |ε̇ᵥ|) in compression, 0 in expansion."""
    rate = trace / dt if dt > 0.0 else 0.0
    if rate >= 0.0:
        return 0.0
    return m.density * length * (m.viscosity_quadratic * length * rate**2 + m.viscosity_linear * m.sound_speed * -rate)


@dataclass
class OnePoint:
    """State of a one-point element; `hourglass` holds Q per mode (4, 3) for amplitudes Γ·u/8."""

    point: Point
    hourglass: Array
    stiffness: float
    length: float
    failure_strain: float = np.inf
    alive: bool = True
    internal_energy: float = 0.0
    hourglass_energy: float = 0.0
    viscous_pressure: float = 0.0  # of the last step


def one_point_forces(element: OnePoint, x: Array, v: Array, dt: float, m: Any) -> Array:
    """Advance a one-point element by one step and return its corner forces (8, 3).

    f_I = V σ B̄_I + Σ γ_I Q with γ_I = Γ_I − Σⱼ (Γ·xⱼ) B̄_Ij; amplitudes are γ·v/8 as in the kernels.
    """
    b, volume = mean_b_matrix(x)
    gradient = v.T @ b
    strain, R = step_kinematics(gradient, dt)
    update_point(element.point, gradient, dt, m)
    if element.point.plastic_strain >= element.failure_strain:
        element.alive = False
    if not element.alive:
        element.point.stress, element.point.back = np.zeros((3, 3)), np.zeros((3, 3))
        element.hourglass = np.zeros((4, 3))
        return np.zeros((8, 3))
    q = viscous_pressure(np.trace(strain), dt, element.length, m)
    forces = volume * b @ (element.point.stress - q * IDENTITY)
    mean_q, element.viscous_pressure = 0.5 * (element.viscous_pressure + q), q
    element.internal_energy += volume * (element.point.work - mean_q * np.trace(strain))
    # at least three times what a pressure takes from a cube's patterns, 48 a = p l, for amplitudes γ·v/8
    least = 64.0 * 3.0 / 48.0 * element.length * np.linalg.norm(element.point.stress) / np.sqrt(3.0)
    stiffness = max(element.stiffness, least)
    for mode in range(4):
        gamma = GAMMA[mode] - b @ (x.T @ GAMMA[mode])
        rate = gamma @ v / 8.0
        turned = R @ element.hourglass[mode]
        force = turned + stiffness * dt * rate
        damping = 0.25 * stiffness * dt * rate  # a quarter of a step ahead
        element.hourglass_energy += dt * float((0.5 * (turned + force) + damping) @ rate)
        element.hourglass[mode] = force
        forces += np.outer(gamma, force + damping) / 8.0
    return forces


def polygon_distance(point: Array, polygon: Array) -> tuple[float, Array]:
    """Return the signed distance of a point from a polygon and the point of its outline that is nearest.

    Inside or outside by the winding angle, the distance by the nearest point of every side.
    """
    nearest, best = polygon[0], np.inf
    angle = 0.0
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        side = b - a
        if not side.any():
            continue
        foot = a + np.clip((point - a) @ side / (side @ side), 0.0, 1.0) * side
        if np.linalg.norm(point - foot) < best:
            nearest, best = foot, float(np.linalg.norm(point - foot))
        p, q = a - point, b - point
        angle += np.arctan2(p[0] * q[1] - p[1] * q[0], p @ q)
    return (-best if abs(angle) > np.pi else best), nearest


def contact_force(
    depth: float, normal: Array, velocity: Array, spring: Array, mass: float, dt0: float, dt: float, law: Any
) -> tuple[Array, Array]:
    """Return the penalty force on a point and its new friction spring: Coulomb's return mapping in vector form."""
    k = law.penalty * mass / dt0**2
    c = law.damping * 2.0 * np.sqrt(k * mass)
    pressure = max(0.0, k * depth - c * float(velocity @ normal))
    tangent = IDENTITY - np.outer(normal, normal)
    slip = tangent @ velocity
    trial = tangent @ spring - k * dt * slip
    mu = law.dynamic + (law.static - law.dynamic) * np.exp(-law.decay * np.linalg.norm(slip))
    if np.linalg.norm(trial) > mu * pressure:
        trial = trial * (mu * pressure / np.linalg.norm(trial))
    return pressure * normal + trial, trial


def bilinear(xi: float, eta: float) -> Array:
    """Return the shape functions of a four-node face."""
    return np.array([(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)]) / 4.0
