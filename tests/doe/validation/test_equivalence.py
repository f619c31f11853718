"""Welch and equivalence tests against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from stemcal.doe.validation.comparison import compare_conditions
from stemcal.doe.validation.equivalence import Sample, compare_means, mean_interval


def test_welch_is_scipys() -> None:
    found = compare_means(Sample(159.2, 12.0, 6), Sample(150.0, 5.0, 4), margin=16.0)
    t, p = stats.ttest_ind_from_stats(159.2, 12.0, 6, 150.0, 5.0, 4, equal_var=False)
    assert (found.t, found.p) == pytest.approx((t, p), rel=1e-12)


def test_equivalence_is_two_one_sided_tests() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(100.0, 4.0, 12)
    found = compare_means(Sample(float(values.mean()), float(values.std(ddof=1)), 12), Sample(101.0), margin=5.0)
    sides = [
        stats.ttest_1samp(values, 101.0 - 5.0, alternative="greater").pvalue,
        stats.ttest_1samp(values, 101.0 + 5.0, alternative="less").pvalue,
    ]
    assert found.p_equivalent == pytest.approx(max(sides), rel=1e-10)
    assert found.p == pytest.approx(stats.ttest_1samp(values, 101.0).pvalue, rel=1e-10)
    assert (found.low, found.high) == pytest.approx(
        stats.t.interval(0.95, 11, values.mean(), stats.sem(values)), rel=1e-12
    )


def test_without_scatter_nothing_is_tested() -> None:
    assert compare_means(Sample(100.0), Sample(90.0), 5.0).p is None
    assert compare_means(Sample(100.0, 5.0, 1), Sample(90.0), 5.0).p_equivalent is None
    assert mean_interval(Sample(100.0, 5.0, 1)) == (None, None)


def test_rows_say_what_the_scatter_shows() -> None:
    result = compare_conditions(
        [7.0, 8.0, 9.0, 10.0], [100.0] * 4, [101.0, 130.0, 104.0, 90.0], 8.0, [(2, 6), (2, 6), (20, 3), (None, 6)], 10.0
    )
    assert result.rows[0].p_equivalent is not None and result.rows[0].p_equivalent < 0.001
    assert result.rows[1].p_different is not None and result.rows[1].p_different < 0.001
    assert result.rows[3].p_different is None and result.rows[3].simulation_error_percent == pytest.approx(-10.0)
    assert [row.standing for row in result.rows] == ["equal", "different", "open", None]
