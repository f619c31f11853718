from itertools import combinations, product

import numpy as np
import pytest

from stemcal.doe.designs import plackett_burman
from stemcal.doe.effects import alias_matrix, aliases_note
from stemcal.notes import Note


def noted(n: int, k: int) -> Note:
    return aliases_note(plackett_burman(k, n), [f"X{i + 1}" for i in range(k)])


def test_twelve_runs_alias_each_effect_by_a_third_with_each_interaction_without_it():
    weights = alias_matrix(plackett_burman(9))
    for column, pair in enumerate(combinations(range(9), 2)):
        for effect in range(9):
            size = 0.0 if effect in pair else 1.0 / 3.0
            assert abs(weights[effect, column]) == pytest.approx(size, abs=1e-12)
    note = noted(12, 9)
    assert note.kind == "partly_aliased" and "up to 0.33" in note.text


def test_an_interaction_shows_in_the_effects_with_its_alias_weight():
    design = plackett_burman(9)
    response = 7.0 * design[:, 3] * design[:, 8]
    effects = design.T @ response / 12
    pair = list(combinations(range(9), 2)).index((3, 8))
    assert effects == pytest.approx(7.0 * alias_matrix(design)[:, pair], abs=1e-12)


def test_eight_runs_alias_fully_and_the_note_says_with_what():
    note = noted(8, 7)
    assert note.kind == "fully_aliased" and "X1 with X2:X6, X3:X4, X5:X7;" in note.text
    design = plackett_burman(7, runs=8)
    assert abs(float(design[:, 0] @ (design[:, 1] * design[:, 5]))) == 8.0


@pytest.mark.parametrize(("k", "largest"), [(15, 0.6), (23, 1.0 / 3.0)])
def test_larger_cyclic_designs_alias_partly(k, largest):
    note = noted(len(plackett_burman(k)), k)
    assert note.kind == "partly_aliased" and f"up to {largest:.2g}" in note.text


def test_clear_designs_and_single_factors():
    full = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    assert aliases_note(full, ["a", "b"]).kind == "clear_of_interactions"
    assert aliases_note(np.array([[-1.0], [1.0]]), ["a"]).kind == "no_interactions"


def test_long_lists_of_aliases_are_cut():
    """Each of the fifteen columns of 2⁴ is the product of seven pairs of others; six columns are listed."""
    corners = np.array(list(product((-1.0, 1.0), repeat=4)))
    columns = [corners[:, list(some)].prod(axis=1) for n in range(1, 5) for some in combinations(range(4), n)]
    text = aliases_note(np.column_stack(columns), [f"X{i + 1}" for i in range(15)]).text
    assert text.count(" and 4 more") == text.count(" with X") == 6 and text.endswith("; 9 more.")
