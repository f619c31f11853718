from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from stemcal.doe.designs.aliases import alias_matrix, describe_aliases
from stemcal.doe.designs.catalogue import plackett_burman


def said_of(n: int, k: int, kind: str = "plackett-burman") -> str:
    return describe_aliases(plackett_burman(k, kind, n), [f"X{i + 1}" for i in range(k)])


def test_twelve_runs_alias_each_effect_by_a_third_with_each_interaction_without_it():
    weights = alias_matrix(plackett_burman(9))
    for column, pair in enumerate(combinations(range(9), 2)):
        for effect in range(9):
            size = 0.0 if effect in pair else 1.0 / 3.0
            assert abs(weights[effect, column]) == pytest.approx(size, abs=1e-12)
    assert "±1/3" in said_of(12, 9)


def test_an_interaction_shows_in_the_effects_with_its_alias_weight():
    design = plackett_burman(9)
    response = 7.0 * design[:, 3] * design[:, 8]
    effects = design.T @ response / 12
    pair = list(combinations(range(9), 2)).index((3, 8))
    assert effects == pytest.approx(7.0 * alias_matrix(design)[:, pair], abs=1e-12)


def test_eight_runs_alias_fully_and_the_note_says_with_what():
    note = said_of(8, 7)
    assert "cannot be told from" in note
    assert "X1 with X2:X6, X3:X4, X5:X7" in note
    design = plackett_burman(7, runs=8)
    assert abs(float(design[:, 0] @ (design[:, 1] * design[:, 5]))) == 8.0


@pytest.mark.parametrize(("k", "largest"), [(15, "0.6"), (23, "0.33")])
def test_larger_cyclic_designs_alias_partly(k, largest):
    assert f"up to {largest}" in said_of(len(plackett_burman(k)), k)


@pytest.mark.parametrize("k", [15, 28, 36])
def test_doubled_designs_of_pydoe_alias_fully(k):
    n = len(plackett_burman(k, "plackett-burman-pydoe"))
    assert n in (16, 32, 40)
    assert "cannot be told from" in said_of(n, k, "plackett-burman-pydoe")


def test_clear_designs_and_single_factors():
    full = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    assert "clear" in describe_aliases(full, ["a", "b"])
    assert "One factor" in describe_aliases(np.array([[-1.0], [1.0]]), ["a"])
