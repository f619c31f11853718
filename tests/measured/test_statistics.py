"""Known answers: printed tables, other programs, closed forms."""

import numpy as np
import pytest

from stemcal.measured.statistics import outlier_of, shapiro_wilk, summarise

# Michelson's speed of light of 1879, first 20 experiments of run 1 (km/s − 299 000), as in R's `morley`.
MORLEY = [850, 740, 900, 1070, 930, 850, 950, 980, 980, 880, 1000, 980, 930, 650, 760, 810, 1000, 1000, 960, 960]


def test_summary_of_a_sample() -> None:
    found = summarise(MORLEY)
    assert (found.n, found.mean) == (20, 909.0)
    assert found.sd == pytest.approx(104.9260, abs=1e-4)
    assert found.mean_interval == pytest.approx((859.8931, 958.1069), abs=1e-4)
    assert found.cv_percent == pytest.approx(11.5430, abs=1e-4)
    # s·√(19/χ²) with χ² = 32.8523 and 8.9065 of printed tables
    assert found.sd_interval == pytest.approx((79.795, 153.250), abs=0.01)


def test_one_value_has_no_scatter() -> None:
    found = summarise([120.0])
    assert (found.mean, found.sd, found.mean_interval) == (120.0, None, None)


def test_normality_agrees_with_another_program() -> None:
    """R prints W = 0.91993 for the first run."""
    assert shapiro_wilk(MORLEY).statistic == pytest.approx(0.91993, abs=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_a_normal_sample_passes_and_an_exponential_one_fails(seed: int) -> None:
    random = np.random.default_rng(seed)
    assert shapiro_wilk(random.normal(9, 1, 200).tolist()).p > 0.01
    assert shapiro_wilk(random.exponential(1.0, 200).tolist()).p < 1e-6


def test_grubbs_rejects_beyond_the_published_limit() -> None:
    """Grubbs and Beck 1972: the two-sided limit of six values at 5 % is 1.887; the last value moves G across it."""
    five = [-1.0, -0.5, 0.0, 0.5, 1.0]

    def g(last: float) -> float:
        values = np.array([*five, last])
        return float((last - values.mean()) / values.std(ddof=1))

    assert g(4.0) < 1.887 < g(5.0)
    assert (outlier_of([*five, 4.0]), outlier_of([*five, 5.0])) == (None, 5)
    assert outlier_of([1.0, 2.0]) is None and outlier_of([3.0, 3.0, 3.0]) is None


def test_grubbs_keeps_its_level() -> None:
    random = np.random.default_rng(3)
    hits = [outlier_of(random.normal(size=6).tolist()) is not None for _ in range(2000)]
    assert np.mean(hits) == pytest.approx(0.05, abs=0.012)
