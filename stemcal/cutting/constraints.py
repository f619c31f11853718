"""Constraints of the stem: the mirror planes of a half or quarter model and the clamp of a held end."""

import numpy as np

from stemcal.arrays import Mask
from stemcal.cutting.parts import ShearTest, Symmetry
from stemcal.fem.mesh import Mesh


def mirrors(mesh: Mesh, symmetry: Symmetry) -> Mask:
    """Return the velocity components (N, 3) that mirror planes fix: x on x = 0 (quarter), y on y = 0 (also half)."""
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    if symmetry == "quarter":
        held[:, 0] = np.abs(mesh.nodes[:, 0]) < 1e-9
    if symmetry != "none":
        held[:, 1] = np.abs(mesh.nodes[:, 1]) < 1e-9
    return held


def held_components(mesh: Mesh, test: ShearTest) -> Mask:
    """Return the velocity components (N, 3) that the mirror planes and the clamp fix."""
    held, x = mirrors(mesh, test.discretisation.symmetry), mesh.nodes[:, 0]
    if test.supports.kind != "span":
        held[x < x.min() + 1e-9] = True
    return held
