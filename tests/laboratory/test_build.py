"""The section of a meshed piece against that of the round stem."""

from math import pi
from typing import Any, Literal

import numpy as np
import pytest
from pieces import RATIO, material, piece

from stemcal.fem.mesh import Mesh
from stemcal.laboratory import Kind
from stemcal.laboratory.axial import Axial
from stemcal.laboratory.build import rounded
from stemcal.laboratory.radial_compression import RadialCompression
from stemcal.laboratory.three_point_bending import ThreePointBending

AREA, SECOND_MOMENT = pi * 4.0**2 * (1.0 - RATIO**2), 0.25 * pi * 4.0**4 * (1.0 - RATIO**4)


@pytest.mark.parametrize("symmetry", ["quarter", "half", "none"])
@pytest.mark.parametrize(
    ("kind", "moment", "exact", "least", "most"),
    [(Axial("tension"), 0, AREA, 0.001, 0.005), (ThreePointBending(40.0), 2, SECOND_MOMENT, 0.003, 0.01)],
    ids=["axial", "bending"],
)
def test_a_mesh_has_the_moment_of_the_ring(
    kind: Kind, moment: int, exact: float, least: float, most: float, symmetry: Literal["none", "half", "quarter"]
) -> None:
    """∫zᵐ dA by a point in each element; the radius grows by half a per cent at most with elements of d/12."""
    test = rounded(piece(kind, material(), 48.0, 1.0, 8.0 / 12.0, symmetry=symmetry))
    mesh = kind.mesh(test.stem, test.discretisation)
    z = _centre_heights(mesh)
    share = {"none": 1.0, "half": 0.5, "quarter": 0.25}[symmetry]
    assert float(mesh.volumes() @ z**moment) / (48.0 * share) == pytest.approx(exact, rel=1e-9)
    assert least < test.stem.outer_diameter / 8.0 - 1.0 < most


def _centre_heights(mesh: Mesh) -> np.ndarray:
    """Return ∫z dA / ∫dA of each section, by Green's theorem over its sides, y and z of corners 1 to 4."""
    y, z = np.moveaxis(mesh.nodes[mesh.hexes[:, :4], 1:], 2, 0)
    y2, z2 = np.roll(y, -1, axis=1), np.roll(z, -1, axis=1)
    cross = y * z2 - y2 * z
    return np.asarray((cross * (z + z2)).sum(axis=1) / (3.0 * cross.sum(axis=1)))


@pytest.mark.parametrize(("ratio", "layers"), [(0.9, 8), (0.9, 3), (0.41, 6)])
def test_the_wall_of_a_ring_bends_as_the_stems(ratio: float, layers: int) -> None:
    """∫z² dA of its points about the mid-line, which stays, is w³/12."""
    stem = rounded(piece(RadialCompression(), material(), 4.0, 0.1, 0.5, ratio, through_wall=layers)).stem
    outer, inner = 0.5 * stem.outer_diameter, 0.5 * stem.outer_diameter * stem.diameter_ratio
    assert 0.5 * (outer + inner) == pytest.approx(2.0 * (1.0 + ratio), rel=1e-12)
    thick = (outer - inner) / layers
    points = thick * (np.arange(layers) - 0.5 * (layers - 1))
    assert thick * float(points @ points) == pytest.approx((4.0 * (1.0 - ratio)) ** 3 / 12.0, rel=1e-12)


@pytest.mark.parametrize(
    ("ratio", "how"),
    [(0.6, {"through_wall": 2}), (0.0, {}), (0.01, {"through_wall": 3})],
    ids=["two layers", "solid", "hardly a bore"],
)
def test_other_pieces_between_plates_keep_their_size(ratio: float, how: dict[str, Any]) -> None:
    test = piece(RadialCompression(), material(), 4.0, 0.1, 0.5, ratio, **how)
    assert rounded(test) is test


def test_the_waist_is_in_the_middle() -> None:
    mesh = Axial("tension").mesh(
        piece(Axial("tension"), material(), 16.0, 1.0, 1.0).stem,
        piece(Axial("tension"), material(), 16.0, 1.0, 1.0).discretisation,
    )
    radius = np.linalg.norm(mesh.nodes[:, 1:], axis=1)
    middle, end = (radius[np.isclose(mesh.nodes[:, 0], x)].max() for x in (0.0, 8.0))
    assert middle == pytest.approx(0.999 * end, rel=1e-9)
