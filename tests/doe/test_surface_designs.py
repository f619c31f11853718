import numpy as np
import pytest

from stemcal.doe.coding import term_columns
from stemcal.doe.designs import (
    SurfaceOptions,
    axial_distance,
    box_behnken,
    central_composite,
    extra_runs,
    fold_over,
    latin_hypercube,
    plackett_burman,
    surface_runs,
)
from stemcal.doe.effects import aliases_note
from stemcal.doe.factorial import fraction
from stemcal.errors import UsageError


@pytest.mark.parametrize(("k", "runs"), [(3, 12), (4, 24), (5, 40), (6, 48), (7, 56)])
def test_box_behnken_has_the_published_size_and_is_balanced(k, runs):
    """Box and Behnken 1960, table 1: linear and mixed columns orthogonal, every level as often."""
    design = box_behnken(k, 3)
    assert design.shape == (runs + 3, k)
    matrix = term_columns(design)
    linear = matrix[:, 1 : 1 + k + k * (k - 1) // 2]
    gram = linear.T @ linear
    assert np.array_equal(gram, np.diag(np.diag(gram)))
    assert len(set(np.diag(gram)[:k])) == 1
    assert np.linalg.matrix_rank(matrix) == matrix.shape[1]


def test_box_behnken_exists_for_three_to_seven_factors():
    for k in (2, 8):
        with pytest.raises(UsageError, match="3 to 7"):
            box_behnken(k)


@pytest.mark.parametrize(
    ("rule", "k", "distance"),
    [("rotatable", 2, 1.41421), ("rotatable", 3, 1.68179), ("rotatable", 4, 2.0)],
)
def test_printed_axial_distances(rule, k, distance):
    assert axial_distance(k, rule) == pytest.approx(distance, abs=5e-6)


@pytest.mark.parametrize("k", [5, 6, 7, 8])
def test_fractional_cores_still_estimate_the_quadratic(k):
    design = central_composite(k, 4)
    corners = fraction(k, resolution=5).runs
    assert len(design) == corners + 2 * k + 4 < 2**k + 2 * k + 4 + 1
    assert np.abs(design).max() == pytest.approx(corners**0.25)
    matrix = term_columns(design)
    assert np.linalg.matrix_rank(matrix) == matrix.shape[1]


def test_latin_hypercubes_are_seeded_and_have_a_point_in_each_slice():
    points = latin_hypercube(4, 25, seed=7)
    slices = np.sort(np.floor((points + 1.0) / 2.0 * 25).astype(int), axis=0)
    assert np.array_equal(slices, np.tile(np.arange(25)[:, None], 4))
    assert np.array_equal(points, latin_hypercube(4, 25, seed=7))
    assert not np.array_equal(points, latin_hypercube(4, 25, seed=8))


def test_extra_runs_come_last_and_more_of_them_keep_the_first():
    plain, more = surface_runs(3, SurfaceOptions()), surface_runs(3, SurfaceOptions(extra_runs=3))
    assert np.array_equal(more[:20], plain) and more.shape == (23, 3)
    assert np.array_equal(surface_runs(3, SurfaceOptions(extra_runs=7))[:23], more)
    assert len(np.unique(np.round(more, 6), axis=0)) == 15 + 3
    with pytest.raises(UsageError, match=r"rsm\.design: unknown design 'd-optimal'"):
        surface_runs(3, SurfaceOptions("d-optimal"))


def test_fold_over_frees_main_effects():
    design = plackett_burman(9)
    folded = fold_over(design)
    assert folded.shape == (24, 9) and np.array_equal(folded[:12], design)
    assert aliases_note(folded, [f"X{i}" for i in range(9)]).kind == "clear_of_interactions"


def test_extra_runs_make_a_poor_design_estimate_the_quadratic():
    """A 2² factorial with a centre lacks squares; four further runs of the grid are the axial ones or as good."""
    start = np.vstack([fraction(2, 4).design(), [[0.0, 0.0]]])
    grid = np.array([[a, b] for a in (-1.0, 0.0, 1.0) for b in (-1.0, 0.0, 1.0)])
    added = extra_runs(start, 4, grid)

    def det(points):
        matrix = term_columns(np.vstack([start, points]))
        return float(np.linalg.det(matrix.T @ matrix))

    faces = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    assert det(added) == pytest.approx(det(faces), rel=1e-9)
    with pytest.raises(UsageError, match="only 4 candidate points are available for 5 runs"):
        extra_runs(start, 5, grid)


def test_a_latin_hypercube_is_optimised_once(monkeypatch: pytest.MonkeyPatch) -> None:
    first = latin_hypercube(3, 17)
    monkeypatch.setattr("scipy.stats.qmc.LatinHypercube", None)
    assert latin_hypercube(3, 17) is first and not first.flags.writeable
