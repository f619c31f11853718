"""A material with an axis in engineering constants: turned compliance, and Hill's six constants, as in textbooks.

Lekhnitskii, Theory of Elasticity of an Anisotropic Body (1963); Hill, The Mathematical Theory of Plasticity (1950),
ch. 12. Both are full tensors in the frame of the axis, turned by matrices: nothing of the kernels' invariants.
"""

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick

Array = NDArray[np.float64]

PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


def turn(angle: float) -> Array:
    """Return the rotation Q whose third column, the axis, is at an angle from x in the plane of x and z."""
    return np.array([[sin(angle), 0.0, cos(angle)], [0.0, 1.0, 0.0], [-cos(angle), 0.0, sin(angle)]])


def turned_brick(Q: Array, counts: tuple[int, int, int] = (1, 1, 1)) -> Mesh:
    """Return a brick of unit elements whose edges ζ are along the third column of Q."""
    mesh = brick(tuple(float(n) for n in counts), counts)
    return mesh.moved(mesh.nodes @ Q.T)


def _in_frame(tensor: Array, Q: Array) -> Array:
    return np.asarray(np.einsum("Ii,Jj,Kk,Ll,ijkl->IJKL", Q, Q, Q, Q, tensor))


def compliance(material: Material, Q: Array) -> Array:
    """Return S (3, 3, 3, 3) of a material whose axis is the third column of Q, 1/MPa."""
    across = material.transverse
    assert across is not None
    s = np.zeros((3, 3, 3, 3))
    normal = np.diag([1 / across.elastic_modulus, 1 / across.elastic_modulus, 1 / material.elastic_modulus])
    normal[0, 1] = normal[1, 0] = -across.poisson_ratio / across.elastic_modulus
    normal[2, :2] = normal[:2, 2] = -material.poisson_ratio / material.elastic_modulus
    for i in range(3):
        for j in range(3):
            s[i, i, j, j] = normal[i, j]
    plane = across.elastic_modulus / (2.0 * (1.0 + across.poisson_ratio))
    for i, j, G in ((0, 1, plane), (1, 2, across.shear_modulus), (2, 0, across.shear_modulus)):
        for a, b in ((i, j), (j, i)):
            s[a, b, i, j] = s[a, b, j, i] = 0.25 / G
    return _in_frame(s, Q)


def hill(material: Material, Q: Array) -> Array:
    """Return P (3, 3, 3, 3) of q² = σ:P:σ, from F, G = H, L = 2F + G and M = N times the axial yield stress squared."""
    across, X = material.transverse, material.yield_stress
    assert across is not None
    along = 0.5
    plane = (X / across.yield_stress) ** 2 - along
    shear = 0.5 * (X / across.shear_yield_stress) ** 2
    p = np.zeros((3, 3, 3, 3))
    normal = np.array([
        [plane + along, -plane, -along],
        [-plane, plane + along, -along],
        [-along, -along, 2.0 * along],
    ])  # fmt: skip
    for i in range(3):
        for j in range(3):
            p[i, i, j, j] = normal[i, j]
    for i, j, twice in ((0, 1, 2.0 * plane + along), (1, 2, shear), (2, 0, shear)):
        for a, b in ((i, j), (j, i)):
            p[a, b, i, j] = p[a, b, j, i] = 0.5 * twice
    return _in_frame(p, Q)


def pull() -> Array:
    """Return the unit stress of a pull along x."""
    stress = np.zeros((3, 3))
    stress[0, 0] = 1.0
    return stress


def strained(mesh: Mesh, strain: Array) -> Array:
    """Return the nodes of a mesh under a small symmetric strain, exactly exp(strain) to its third power."""
    F = np.eye(3) + strain + strain @ strain / 2.0 + strain @ strain @ strain / 6.0
    return np.asarray(mesh.nodes @ F.T)
