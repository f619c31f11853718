"""The internal length of failure: how much strain each element of a mesh exchanges with its neighbours."""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.erosion import Exchange
from stemcal.fem.kernels.search import FACES
from stemcal.fem.mesh import Mesh

Array = NDArray[np.float64]


def exchange(
    mesh: Mesh, neighbours: NDArray[np.int32], shares: Array, failure_strain: float, length: float, strains: Array
) -> Exchange:
    """Return the exchange that averages over an internal length; length 0 makes failure local.

    Parameters
    ----------
    neighbours : array of int (E, 6)
        The element behind each face, −1 where there is none.
    shares : array (E,)
        ½ for elements that a mirror plane cuts in two, 1 for all others.
    length : float
        ℓ of the weight exp(−r²/ℓ²), mm.
    strains : array (blocks, lanes)
        The plastic strains as the blocks of elements hold them.
    """
    elements = len(mesh.hexes)
    if length == 0.0:
        return Exchange(np.zeros((0, 6)), _around(neighbours[:0]), 0, failure_strain, *_means(0, strains[:0]))
    between, volumes = _conductances(mesh, neighbours), mesh.volumes()
    # a face between two elements that are cut in two is itself cut
    rate = np.where(neighbours < 0, 0.0, between * np.maximum(shares[:, None], shares[neighbours]))
    rate /= (shares * volumes)[:, None]
    # images count behind free faces: with other passes, so other means, on a mirror plane than without one the first
    # element would fail in another step; behind elements that are cut in two the other half counts already
    imagined = np.where((neighbours < 0) & (shares[:, None] == 1.0), between / volumes[:, None], 0.0)
    # a pass hands over at most half of what an element has: with all of it, neighbours would only change places
    time = 0.25 * length**2
    passes = max(1, ceil(2.0 * time * float((rate + imagined).sum(axis=1).max()) - 1e-9))
    return Exchange(rate * time / passes, _around(neighbours), passes, failure_strain, *_means(elements, strains))


def _around(neighbours: NDArray[np.int32]) -> NDArray[np.uint32]:
    """Return the neighbours, an element itself where it has none: no case apart then, and no index that counts back."""
    own = np.arange(len(neighbours))[:, None]
    return np.where(neighbours < 0, own, neighbours).astype(np.uint32)


def _means(elements: int, strains: Array) -> tuple[Array, Array, Array, Array]:
    """Return mean, scratch and known strain of the elements, and the largest mean, all before any strain."""
    return np.zeros(elements), np.zeros(elements), np.zeros_like(strains), np.zeros(1)


def _conductances(mesh: Mesh, neighbours: NDArray[np.int32]) -> Array:
    """Return T = A·d/|d|² of each face (E, 6), A its area vector and d the way to the neighbour's centre; mm.

    Behind a face without a neighbour is the element's own image.
    """
    corners = mesh.nodes[mesh.hexes]
    centres = corners.mean(axis=1)
    faces = corners[:, FACES]
    areas = 0.5 * np.cross(faces[:, :, 2] - faces[:, :, 0], faces[:, :, 3] - faces[:, :, 1])
    behind = np.where((neighbours < 0)[..., None], 2.0 * faces.mean(axis=2) - centres[:, None], centres[neighbours])
    way = behind - centres[:, None]
    return np.asarray(np.abs(np.sum(areas * way, axis=2)) / np.sum(way * way, axis=2))
