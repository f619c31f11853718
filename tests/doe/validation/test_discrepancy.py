"""One scale for what the model misses: its intervals hold 95 % of measured forces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from stemcal.doe.validation.discrepancy import corrected, discrepancy


def test_a_further_ratio_is_predicted_as_a_further_value() -> None:
    ratios = [1.02, 0.97, 1.08, 1.05]
    found = corrected(200.0, ratios)
    assert found is not None
    logs = np.log(ratios)
    reach = stats.t.ppf(0.975, 3) * logs.std(ddof=1) * (1 + 1 / 4) ** 0.5
    assert found.force == pytest.approx(200.0 * stats.gmean(ratios))
    assert np.log(found.interval) == pytest.approx(np.log(found.force) + np.array([-reach, reach]))


def test_too_few_diameters_tell_nothing() -> None:
    assert discrepancy([1.0, 1.1]) is None and corrected(100.0, [1.1]) is None


@pytest.mark.parametrize("m", [3, 5])
def test_coverage(m: int) -> None:
    """A model 12 % low with scatter of 6 %: 4000 laboratories."""
    random = np.random.default_rng(m)
    ratios = 1.12 * np.exp(0.06 * random.standard_normal((4000, m + 1)))
    held = 0
    for row in ratios:
        found = corrected(100.0, row[1:].tolist())
        assert found is not None
        held += found.interval[0] <= 100.0 * row[0] <= found.interval[1]
    assert 0.94 < held / 4000 < 0.96
