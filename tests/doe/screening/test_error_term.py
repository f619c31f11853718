from __future__ import annotations

import numpy as np
import pytest

from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.effect_sizes import Conclusion
from stemcal.doe.screening.notes import PooledError, ReplicateError
from stemcal.errors import UsageError

NAMES = [f"X{i}" for i in range(1, 10)]


def test_pooling_takes_what_lies_within_lenths_margin(pb_runs):
    result = analyse_screening(pb_runs.coded, pb_runs.force, NAMES, error="pooled")
    small = [e for e in result.effects if e.factor not in ("X4", "X7", "X9")]
    expected = result.residual_sum_of_squares + sum(e.sum_of_squares for e in small)
    assert result.error.df == 8 and result.error.sum_of_squares == pytest.approx(expected)
    assert result.effects[3].f == pytest.approx(result.effects[3].sum_of_squares / (expected / 8))
    assert result.significant == ("X2", "X4", "X7", "X9")  # X2 by the small error alone, as the note warns
    assert PooledError(("X1", "X2", "X3", "X5", "X6", "X8"), 8) in result.notes


def test_lenths_own_p_values(pb_runs):
    """Of eleven contrasts, the two unused columns among them: X7 lies just beyond what 5 % of chance alone exceed."""
    result = analyse_screening(pb_runs.coded, pb_runs.force, NAMES, error="lenth")
    assert result.effects[3].f is None
    assert 0.0 < result.effects[3].p < 0.001
    assert result.effects[6].p == pytest.approx(0.0468, abs=5e-4)
    assert result.significant == ("X4", "X7", "X9")
    assert (result.error.source, result.error.df, result.error.mean_square) == ("lenth", 0, None)


def test_replicates_are_the_error_where_there_are_some(pb_runs):
    coded, force = np.vstack([pb_runs.coded, pb_runs.coded]), np.concatenate([pb_runs.force, pb_runs.force + 3.0])
    result = analyse_screening(coded, force, NAMES, error="replicates")
    assert result.error.df == 12 and result.error.sum_of_squares == pytest.approx(12 * 4.5)
    single = analyse_screening(pb_runs.coded, pb_runs.force, NAMES, error="replicates")
    assert all(effect.p is None for effect in single.effects)
    assert ReplicateError(None) in single.notes
    with pytest.raises(UsageError, match=r"screen\.error: no error term 'best'"):
        analyse_screening(pb_runs.coded, pb_runs.force, NAMES, error="best")


def test_a_conclusion_per_factor(pb_runs):
    """Published: X4 matters by every test, X7 for itself only (Holm p = 0.32), X5 not at all."""
    result = analyse_screening(pb_runs.coded, pb_runs.force, NAMES, expected={"X4": "+", "X7": "-"})
    found = {effect.factor: effect for effect in result.effects}
    assert found["X4"].conclusion == Conclusion(True, True, True, "+")
    assert found["X7"].conclusion == Conclusion(True, True, False, "-")
    assert found["X5"].conclusion == Conclusion(False, False, False)
    assert [found[name].conclusion.standing for name in ("X4", "X7", "X5")] == ["active", "possible", "none"]
    assert [found[name].against_expectation for name in ("X4", "X7", "X5")] == [False, True, False]


def test_data_for_the_plots(pb_runs):
    found = analyse_screening(pb_runs.coded, pb_runs.force, NAMES)
    points, pareto, aliases = found.half_normal(), found.pareto(), found.aliases()
    assert [p.factor for p in points][-2:] == ["X9", "X4"]
    assert points[0].quantile == pytest.approx(0.0696, abs=1e-4)  # Φ⁻¹(½ + ½·0.5/9)
    assert [p.size for p in points] == sorted(p.size for p in points)
    assert pareto.rows[0].factor == "X4" and pareto.rows[0].t == pytest.approx(444.3**0.5, abs=0.01)
    assert pareto.t_limit == pytest.approx(4.3027, abs=1e-4)
    assert pareto.bonferroni_limit > pareto.t_limit
    assert len(aliases.interactions) == 36
    assert abs(aliases.weights["X1"][-1]) == pytest.approx(1 / 3)
