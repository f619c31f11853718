"""Unused columns as contrasts, and what a fold-over would find."""

from __future__ import annotations

import numpy as np
import pytest

from stemcal.doe.designs.catalogue import plackett_burman
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.lenth import fold_over_gain, unused_columns, unused_contrasts
from stemcal.doe.screening.notes import UnusedContrasts


@pytest.mark.parametrize("k", [5, 9])
def test_unused_columns_complete_an_orthogonal_design(k: int) -> None:
    random = np.random.default_rng(2)
    design = plackett_burman(k, runs=12)[random.permutation(12)]
    columns = unused_columns(design)
    assert columns is not None and columns.shape == (12, 11 - k)
    whole = np.column_stack([np.ones(12), design, columns])
    assert whole.T @ whole == pytest.approx(12.0 * np.eye(12))


def test_their_sum_of_squares_is_the_residual() -> None:
    random = np.random.default_rng(4)
    design, y = plackett_burman(8, runs=12), random.standard_normal(12)
    left = unused_contrasts(design, y)
    found = analyse_screening(design, y, [f"x{i}" for i in range(8)])
    assert 3.0 * float(np.sum(left**2)) == pytest.approx(found.residual_sum_of_squares)
    (said,) = (note for note in found.notes if isinstance(note, UnusedContrasts))
    assert said.contrasts == pytest.approx(left.tolist())


def test_other_designs_have_none() -> None:
    design = plackett_burman(9)
    assert unused_columns(design[:-1]) is None  # a failed run
    assert unused_columns(np.vstack([design, design])) is None
    assert unused_columns(plackett_burman(11)) is None  # every column carries a factor


def test_a_fold_over_finds_what_interactions_hide() -> None:
    """An effect of 17 N beside 80 and 60 N, as in the published screening."""
    gain = fold_over_gain(plackett_burman(9), [(3, 80.0), (8, 60.0)], 17.0, 0.05)
    assert gain is not None and gain.runs == 12
    assert 0.5 < gain.missed < 0.8 and gain.missed_folded < 0.2


def test_no_advice_where_main_effects_are_clear() -> None:
    from stemcal.doe.designs.catalogue import fold_over

    assert fold_over_gain(fold_over(plackett_burman(9)), [(3, 80.0), (8, 60.0)], 17.0, 0.05) is None
    assert fold_over_gain(plackett_burman(9), [(3, 80.0)], 17.0, 0.05) is None


def test_no_runs_are_advised_that_would_find_no_more() -> None:
    """Of four factors Lenth's margin is that of 1.3 degrees of freedom: an effect beside two found is missed anyway."""
    assert fold_over_gain(plackett_burman(4, runs=8), [(1, 90.0), (3, 26.0)], 20.0, 0.05) is None


def test_the_margin_of_all_contrasts_finds_more_than_two_unused_columns() -> None:
    """Nine factors in twelve runs, three of them four standard errors large: F(1, 2) finds 55 %, the margin 72 %."""
    design, names, random = plackett_burman(9), list("abcdefghi"), np.random.default_rng(8)
    standard_error = 2.0 / np.sqrt(12.0)
    found = by_f = false = 0
    for _ in range(80):
        y = 50.0 + design[:, :3] @ np.full(3, 2.0 * standard_error) + random.standard_normal(12)
        screening = analyse_screening(design, y, names)
        found += len(set("abc") & set(screening.significant))
        false += len(set("defghi") & set(screening.significant))
        by_f += sum(effect.p < 0.05 for effect in screening.effects[:3])
    assert found / 240 > 0.63 and by_f / 240 < 0.63
    assert false / 480 < 0.05


def test_more_unused_columns_leave_the_choice_to_f() -> None:
    """Five factors in twelve runs: six degrees of freedom are enough, and F finds more than any margin."""
    design, random = plackett_burman(5, runs=12), np.random.default_rng(1)
    found = analyse_screening(design, 10.0 + design[:, 0] + random.standard_normal(12), list("abcde"))
    (said,) = (note for note in found.notes if isinstance(note, UnusedContrasts))
    assert not said.decides and found.lenth.m == 11
    assert found.significant == tuple(e.factor for e in found.effects if e.p < 0.05)
