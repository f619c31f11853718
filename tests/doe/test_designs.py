import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stemcal.doe.designs import axial_distance, central_composite, plackett_burman, screening_runs
from stemcal.errors import UsageError


def signs(text: str) -> list[float]:
    return [1.0 if sign == "+" else -1.0 for sign in text]


# The generators printed by Plackett and Burman (Biometrika 33, 1946, p. 323).
GENERATORS = {7: "+++-+--", 11: "++-+++---+-", 19: "++--++++-+-+----++-", 23: "+++++-+-++--++--+-+----"}


@pytest.mark.parametrize(("k", "generator"), GENERATORS.items())
def test_first_row_is_the_printed_generator(k, generator):
    design = plackett_burman(k, runs=k + 1)
    assert design.shape == (k + 1, k)
    assert design[0].tolist() == signs(generator)
    assert design[1].tolist() == signs(generator[-1] + generator[:-1])
    assert np.all(design[-1] == -1.0)


@given(st.integers(1, 60))
def test_cyclic_designs_are_balanced_and_orthogonal(k):
    design = plackett_burman(k)
    n = len(design)
    assert n > k
    assert np.array_equal(design.sum(axis=0), np.zeros(k))
    assert np.array_equal(design.T @ design, n * np.eye(k))


@given(st.integers(5, 47))
def test_the_usual_size_is_the_smallest_with_a_prime(k):
    sizes = (12, 20, 24, 32, 44, 48)
    assert len(plackett_burman(k)) == next(n for n in sizes if n > k)


def test_sizes_that_do_not_exist_are_refused():
    for runs in (10, 8, 16, 28):
        with pytest.raises(UsageError, match=f"has {runs} runs for 9 factors; use .* for example 12"):
            plackett_burman(9, runs)
    with pytest.raises(UsageError, match="unknown design 'taguchi'; choose one of plackett-burman, "):
        screening_runs("taguchi", 3)
    with pytest.raises(UsageError, match="at least one"):
        plackett_burman(0)


def test_three_factors_give_the_design_of_table_9(ccd_runs):
    design = central_composite(3, 6)
    assert design.shape == (20, 3)
    order = np.lexsort(np.round(design, 2).T)
    paper = ccd_runs.coded[np.lexsort(np.round(ccd_runs.coded, 2).T)]
    assert np.abs(design[order] - paper).max() < 1e-3


@given(st.integers(2, 5), st.integers(0, 8))
def test_rotatable_composites_are_second_order_rotatable(k, centre_points):
    design = central_composite(k, centre_points)
    assert len(design) == 2 ** min(k, 4) + 2 * k + centre_points
    fourth = np.sum(design**4, axis=0)
    mixed = np.sum(design[:, 0] ** 2 * design[:, 1] ** 2)
    assert fourth == pytest.approx(np.full(k, 3.0 * mixed))  # Σx⁴ = 3·Σx²y²
    assert np.abs(design.sum(axis=0)).max() < 1e-12


@pytest.mark.parametrize(("alpha", "distance"), [("rotatable", 8**0.25), ("face", 1.0), (1.5, 1.5)])
def test_axial_points_lie_at_alpha(alpha, distance):
    design = central_composite(3, 1, alpha)
    assert np.linalg.norm(design[8:14], axis=1) == pytest.approx(np.full(6, distance), abs=1e-12)
    assert np.linalg.norm(design[:8], axis=1) == pytest.approx(np.full(8, 3**0.5), abs=1e-12)
    assert np.all(design[14:] == 0.0)


def test_one_factor_has_a_composite_too():
    assert central_composite(1, 2, 2.0).ravel().tolist() == [-1.0, 1.0, -2.0, 2.0, 0.0, 0.0]


@pytest.mark.parametrize("alpha", ["nearest", 0.0, -1.0, float("nan")])
def test_senseless_alpha_is_refused(alpha):
    with pytest.raises(UsageError, match=r"rsm\.alpha"):
        axial_distance(3, alpha)


def test_senseless_composites_are_refused():
    with pytest.raises(UsageError, match="centre_points"):
        central_composite(3, -1)
    with pytest.raises(UsageError, match="at least one"):
        central_composite(0)
