"""What the model misses over the diameters: one scale or a smooth process, and intervals that hold 95 %."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from stemcal.doe.validation.discrepancy import corrected, discrepancy, needed

SIX = (7.0, 8.0, 9.0, 10.0, 11.0, 12.0)


def test_a_further_ratio_is_predicted_as_a_further_value() -> None:
    ratios = [1.02, 0.97, 1.08, 1.05]
    found = corrected(200.0, 11.0, dict(zip(SIX, ratios, strict=False)))
    assert found is not None
    logs = np.log(ratios)
    reach = stats.t.ppf(0.975, 3) * logs.std(ddof=1) * (1 + 1 / 4) ** 0.5
    assert found.response == pytest.approx(200.0 * stats.gmean(ratios))
    assert np.log(found.interval) == pytest.approx(np.log(found.response) + np.array([-reach, reach]))


def test_fitted_level_and_growth_take_their_degrees_of_freedom() -> None:
    """As a regression on 1 and ln d predicts one more value, by statsmodels."""
    import statsmodels.api as sm

    logs = np.array([0.02, -0.03, 0.01, 0.03, -0.03])
    x = sm.add_constant(np.log(SIX[:5]))
    logs = sm.OLS(logs, x).fit().resid  # what a fit of both leaves
    found = corrected(100.0, 12.0, dict(zip(SIX, np.exp(logs), strict=False)), seen=2)
    assert found is not None
    ends = sm.OLS(logs, x).fit().get_prediction([[1.0, np.log(12.0)]]).conf_int(obs=True)[0]
    assert np.log(np.array(found.interval) / 100.0) == pytest.approx(ends)


def test_too_few_diameters_tell_nothing() -> None:
    assert discrepancy({7.0: 1.0, 8.0: 1.1}) is None and corrected(100.0, 9.0, {7.0: 1.1}) is None
    assert needed(3) == 5 and discrepancy(dict.fromkeys(SIX[:4], 1.1), 3) is None


def test_without_neighbours_the_process_is_the_scale(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of the variance told by no neighbour: the mixture is one Student's t, that of the scale."""
    monkeypatch.setattr("stemcal.doe.validation.discrepancy._SHARES", (1.0,))
    ratios = dict(zip(SIX[:4], [1.02, 0.97, 1.08, 1.05], strict=True))
    scale, process = (corrected(200.0, 11.0, ratios, smooth=smooth) for smooth in (False, True))
    assert scale is not None and process is not None
    assert process.response == pytest.approx(scale.response) and process.interval == pytest.approx(
        scale.interval, rel=1e-6
    )


def test_a_process_of_known_length_is_ordinary_kriging(monkeypatch: pytest.MonkeyPatch) -> None:
    """Prediction and error by Lagrange's equations, the variance by generalised least squares."""
    monkeypatch.setattr("stemcal.doe.validation.discrepancy._SHARES", (0.1,))
    monkeypatch.setattr("stemcal.doe.validation.discrepancy._LENGTHS", (2.0,))
    logs = np.array([0.10, 0.08, 0.05, 0.00, -0.06])
    found = corrected(100.0, 12.0, dict(zip(SIX, np.exp(logs), strict=False)), smooth=True)
    every = np.array(SIX)
    k = 0.9 * np.exp(-0.5 * ((every[:, None] - every) / 2.0) ** 2) + 0.1 * np.eye(6)
    system = np.block([[k[:5, :5], np.ones((5, 1))], [np.ones((1, 5)), np.zeros((1, 1))]])
    solved = np.linalg.solve(system, np.append(k[5, :5], 1.0))  # Lagrange's equations of ordinary kriging
    inverse = np.linalg.inv(k[:5, :5])
    mean = inverse.sum(axis=0) @ logs / inverse.sum()
    s2 = (logs - mean) @ inverse @ (logs - mean) / 4
    reach = stats.t.ppf(0.975, 4) * np.sqrt(s2 * (1.0 - solved @ np.append(k[5, :5], 1.0)))
    middle = solved[:5] @ logs
    assert found is not None and np.log(found.response / 100.0) == pytest.approx(middle)
    assert np.log(np.array(found.interval) / 100.0) == pytest.approx([middle - reach, middle + reach], rel=1e-6)


@pytest.mark.parametrize("m", [3, 5])
def test_coverage(m: int) -> None:
    """A model 12 % low with scatter of 6 %: 4000 laboratories."""
    random = np.random.default_rng(m)
    ratios = 1.12 * np.exp(0.06 * random.standard_normal((4000, m + 1)))
    held = 0
    for row in ratios:
        found = corrected(100.0, 12.0, dict(zip(SIX, row[1:].tolist(), strict=False)))
        assert found is not None
        held += found.interval[0] <= 100.0 * row[0] <= found.interval[1]
    assert 0.94 < held / 4000 < 0.96
