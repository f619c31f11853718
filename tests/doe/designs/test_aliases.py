from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from stemcal.doe.designs.aliases import (
    ClearOfInteractions,
    FullyAliased,
    NoInteractions,
    PartlyAliased,
    UniformlyAliased,
    alias_matrix,
    aliases_note,
)
from stemcal.doe.designs.catalogue import plackett_burman
from stemcal.notes import Note


def noted(n: int, k: int) -> Note:
    return aliases_note(plackett_burman(k, n), [f"X{i + 1}" for i in range(k)])


def test_twelve_runs_alias_each_effect_by_a_third_with_each_interaction_without_it():
    weights = alias_matrix(plackett_burman(9))
    for column, pair in enumerate(combinations(range(9), 2)):
        for effect in range(9):
            size = 0.0 if effect in pair else 1.0 / 3.0
            assert abs(weights[effect, column]) == pytest.approx(size, abs=1e-12)
    assert noted(12, 9) == UniformlyAliased(12, pytest.approx(1.0 / 3.0, abs=1e-12))


def test_an_interaction_shows_in_the_effects_with_its_alias_weight():
    design = plackett_burman(9)
    response = 7.0 * design[:, 3] * design[:, 8]
    effects = design.T @ response / 12
    pair = list(combinations(range(9), 2)).index((3, 8))
    assert effects == pytest.approx(7.0 * alias_matrix(design)[:, pair], abs=1e-12)


def test_eight_runs_alias_fully_and_the_note_says_with_what():
    note = noted(8, 7)
    assert isinstance(note, FullyAliased) and note.hidden["X1"] == ("X2:X6", "X3:X4", "X5:X7")
    design = plackett_burman(7, runs=8)
    assert abs(float(design[:, 0] @ (design[:, 1] * design[:, 5]))) == 8.0


@pytest.mark.parametrize(("k", "largest"), [(15, 0.6), (23, 1.0 / 3.0)])
def test_larger_cyclic_designs_alias_partly(k, largest):
    n = len(plackett_burman(k))
    assert noted(n, k) == PartlyAliased(n, pytest.approx(largest))


def test_clear_designs_and_single_factors():
    full = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    assert aliases_note(full, ["a", "b"]) == ClearOfInteractions(4)
    assert aliases_note(np.array([[-1.0], [1.0]]), ["a"]) == NoInteractions()
