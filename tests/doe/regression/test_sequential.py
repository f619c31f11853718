"""Sequential (type I) sums of squares: as the R package rsm prints them, and as statsmodels computes them."""

import numpy as np
import pandas as pd
import pytest
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from stemcal.doe.regression.anova import in_sequence
from stemcal.doe.regression.surface import fit_surface


def test_as_statsmodels_computes_them_on_scattered_points_with_blocks() -> None:
    random = np.random.default_rng(1)
    x, block = random.uniform(-1.5, 1.0, (17, 2)), ["early", "late"] * 8 + ["late"]
    y = 5.0 + x @ [2.0, 1.0] + x[:, 0] * x[:, 1] + random.standard_normal(17) + [float(b == "late") for b in block]
    surface = fit_surface(x, y, ["a", "b"], blocks=block)
    table = pd.DataFrame({"a": x[:, 0], "b": x[:, 1], "y": y, "block": block})
    oracle = anova_lm(ols("y ~ C(block) + a + b + a:b + I(a**2) + I(b**2)", table).fit(), typ=1)
    rows = {row.source: row for row in in_sequence(surface.anova, surface.sequential_ss)}
    for ours, theirs in (("a", "a"), ("b", "b"), ("a:b", "a:b"), ("a^2", "I(a ** 2)"), ("b^2", "I(b ** 2)")):
        expected = oracle.loc[theirs, ["sum_sq", "F", "PR(>F)"]]
        assert (rows[ours].sum_of_squares, rows[ours].f, rows[ours].p) == pytest.approx(tuple(expected), rel=1e-9)
    explained = sum(rows[term].sum_of_squares for term in surface.sequential_ss)
    assert explained == pytest.approx(rows["Model"].sum_of_squares, rel=1e-12)


def test_as_partial_ones_where_the_design_is_orthogonal() -> None:
    corners = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)
    surface = fit_surface(corners, np.arange(8.0) ** 2, ["a", "b", "c"], ["a", "b", "c", "a:b"])
    rows = in_sequence(surface.anova, surface.sequential_ss)
    assert [r.sum_of_squares for r in rows] == pytest.approx([r.sum_of_squares for r in surface.anova], rel=1e-12)
