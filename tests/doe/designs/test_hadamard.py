from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stemcal.doe.designs.aliases import FullyAliased, alias_matrix, aliases_note
from stemcal.doe.designs.catalogue import plackett_burman, screening_runs
from stemcal.doe.designs.definitive_screening import definitive_screening
from stemcal.doe.designs.galois import jacobsthal, prime_power
from stemcal.doe.designs.hadamard import conference, hadamard
from stemcal.errors import UsageError

# Largest share of a two-factor interaction in a main effect of the saturated design.
WORST_ALIAS = {12: 1 / 3, 16: 1.0, 20: 0.6, 24: 1 / 3, 28: 3 / 7, 32: 0.25, 36: 7 / 9, 40: 0.6, 44: 3 / 11, 48: 1 / 3}


@pytest.mark.parametrize("q", [3, 5, 7, 9, 13, 25, 27, 49])
def test_jacobsthal_matrices_are_those_of_paley(q):
    matrix = jacobsthal(q)
    assert np.array_equal(matrix @ matrix.T, q * np.eye(q) - 1.0)
    assert np.array_equal(matrix.T, matrix if q % 4 == 1 else -matrix)
    assert not matrix.sum(axis=0).any()


def test_prime_powers():
    assert prime_power(27) == (3, 3) and prime_power(25) == (5, 2) and prime_power(47) == (47, 1)
    assert prime_power(15) is None and prime_power(45) is None
    with pytest.raises(ValueError, match="no odd prime power"):
        jacobsthal(15)


@pytest.mark.parametrize("n", range(4, 92, 4))
def test_hadamard_matrices(n):
    h = hadamard(n)
    assert np.array_equal(h @ h.T, n * np.eye(n))
    assert np.array_equal(np.abs(h), np.ones((n, n)))
    assert np.all(h[:, 0] == 1.0)


def test_orders_out_of_reach():
    assert hadamard(92) is None and hadamard(6) is None
    assert conference(22) is None and conference(34) is None and conference(7) is None


@pytest.mark.parametrize("m", [2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 24, 26, 28, 30, 32])
def test_conference_matrices(m):
    c = conference(m)
    assert np.array_equal(c @ c.T, (m - 1) * np.eye(m))
    assert not np.diag(c).any()


@pytest.mark.parametrize(("n", "worst"), WORST_ALIAS.items())
def test_every_size_from_12_to_48_is_orthogonal_and_says_what_it_aliases(n, worst):
    design = plackett_burman(n - 1, runs=n)
    assert design.shape == (n, n - 1)
    assert np.array_equal(design.T @ design, n * np.eye(n - 1))
    assert not design.sum(axis=0).any()
    assert np.all(design[-1] == -1.0)
    assert np.abs(alias_matrix(design)).max() == pytest.approx(worst, abs=1e-12)
    note = aliases_note(design, [f"X{i}" for i in range(1, n)])
    assert isinstance(note, FullyAliased) == (worst == 1.0)


@given(st.integers(8, 47))
def test_the_usual_size_is_the_smallest_sound_one(k):
    n = len(plackett_burman(k))
    smallest = 4 * (k // 4 + 1)
    assert n == (20 if smallest == 16 else smallest)


def test_sizes_that_do_not_exist_are_refused():
    for runs in (10, 8, 92):
        with pytest.raises(UsageError, match="multiple of 4 above 9, such as 12"):
            plackett_burman(9, runs=runs)
    with pytest.raises(UsageError, match="has 12 runs for 9 factors, not 20"):
        plackett_burman(9, "plackett-burman-pydoe", runs=20)
    with pytest.raises(UsageError, match="has 8 runs for 3 factors, not 12"):
        screening_runs("full-factorial", 3, 12)


@pytest.mark.parametrize(("k", "runs"), [(3, 9), (4, 9), (5, 13), (6, 13), (9, 21), (10, 21), (15, 33), (22, 49)])
def test_definitive_screening_keeps_main_effects_clear(k, runs):
    """Jones and Nachtsheim's promises: 2m + 1 runs, main effects clear of all terms of second order."""
    design = definitive_screening(k)
    m = k + k % 2
    assert len(design) == runs == 2 * (4 if k < 4 else 24 if m == 22 else m) + 1
    gram = design.T @ design
    assert np.array_equal(gram, np.diag(np.diag(gram)))
    second = [design[:, i] * design[:, j] for i, j in combinations(range(k), 2)] + [design[:, i] ** 2 for i in range(k)]
    assert not (design.T @ np.column_stack(second)).any()
    pairs = np.corrcoef(np.array(second[: k * (k - 1) // 2]))
    assert np.abs(pairs[np.triu_indices_from(pairs, 1)]).max(initial=0.0) < 1.0 - 1e-9
