"""Scatter within the runs as pure error, and fits from which runs are missing."""

from __future__ import annotations

import numpy as np
import pytest

from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.reduction import reduce_surface
from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.regression.surface_notes import (
    CopiesOnly,
    ScatterOverMeshes,
    SurfaceRunsFailed,
)
from stemcal.doe.regression.terms import term_columns
from stemcal.doe.regression.within import Within
from stemcal.errors import RunsFailed, UsageError

DESIGN = central_composite(2, 1, "rotatable")
AXIAL = np.abs(DESIGN).max(axis=1) > 1.1


def phases(noise: float, seed: int = 3, curve: float = 0.0) -> np.ndarray:
    """Four values per run about 100 + 10a + 4b + a·b, with a cubic the quadratic cannot follow."""
    a, b = DESIGN.T
    mean = 100.0 + 10.0 * a + 4.0 * b + a * b + curve * (a**3 - b**3)
    return mean[:, None] + np.random.default_rng(seed).normal(0.0, noise, (len(a), 4))


def fitted(values, **options):
    within = Within(values.std(axis=1, ddof=1), np.full(len(values), 4))
    return fit_surface(DESIGN, values.mean(axis=1), ["a", "b"], within=within, **options)


@pytest.mark.parametrize("curve", [0.0, 3.0])
def test_lack_of_fit_is_that_of_the_single_values(curve: float) -> None:
    """Fitted to all 36 values, replicates and all, the F of lack of fit is the same, and so is its p."""
    values = phases(2.0, curve=curve)
    single = fit_surface(np.repeat(DESIGN, 4, axis=0), values.ravel(), ["a", "b"])
    by_means = fitted(values)
    rows, single_rows = ({row.source: row for row in s.anova} for s in (by_means, single))
    assert rows["Lack of fit"].f == pytest.approx(single_rows["Lack of fit"].f, rel=1e-9)
    assert rows["Lack of fit"].p == pytest.approx(single_rows["Lack of fit"].p, rel=1e-9)
    assert rows["Pure error"].df == 27 == single_rows["Pure error"].df
    assert 4.0 * rows["Pure error"].sum_of_squares == pytest.approx(single_rows["Pure error"].sum_of_squares)
    assert by_means.lack_of_fit_testable and (rows["Lack of fit"].p < 0.05) == (curve > 0.0)
    assert any(isinstance(note, ScatterOverMeshes) and note.df == 27 for note in by_means.notes)


@pytest.mark.parametrize("curve", [0.0, 3.0])
def test_what_the_places_share_is_taken_out(curve: float) -> None:
    """Places that shift all runs by −6, −2, 2, 6: the F is that of (place + quadratic) against (place + run)."""
    import pandas as pd
    from statsmodels.formula.api import ols
    from statsmodels.stats.anova import anova_lm

    values = phases(1.0, curve=curve) + np.array([-6.0, -2.0, 2.0, 6.0])
    within = Within(values.std(axis=1, ddof=1), np.full(9, 4), values)
    surface = fit_surface(DESIGN, values.mean(axis=1), ["a", "b"], within=within)
    frame = pd.DataFrame(np.repeat(DESIGN, 4, axis=0), columns=["a", "b"])
    frame = frame.assign(y=values.ravel(), place=np.tile(range(4), 9), run=np.repeat(range(9), 4))
    small = ols("y ~ C(place) + a + b + a:b + I(a**2) + I(b**2)", frame).fit()
    theirs = anova_lm(small, ols("y ~ C(place) + C(run)", frame).fit())
    row = {r.source: r for r in surface.anova}["Lack of fit"]
    assert (row.f, row.p) == pytest.approx((theirs.loc[1, "F"], theirs.loc[1, "Pr(>F)"]), rel=1e-8)
    assert {r.source: r for r in surface.anova}["Pure error"].df == 24
    (said,) = (note for note in surface.notes if isinstance(note, ScatterOverMeshes))
    assert said.common is not None and 3.0 < said.common < 9.0  # of −6, −2, 2, 6: 5.2


def test_repeated_runs_of_a_deterministic_solver_count_once() -> None:
    """Five centre runs with the same phases: 9 distinct points, 27 df; four of seven residual df tell nothing.

    On a face-centred design the centre is not fitted exactly, so that counting it five times would change the F.
    """
    design = np.vstack([DESIGN, np.zeros((4, 2))])
    values = phases(2.0)
    values = np.vstack([values, np.repeat(values[-1:], 4, axis=0)])
    within = Within(values.std(axis=1, ddof=1), np.full(len(values), 4))
    surface = fit_surface(design, values.mean(axis=1), ["a", "b"], within=within)
    rows = {row.source: row for row in surface.anova}
    assert rows["Pure error"].df == 27 and rows["Lack of fit"].df == 3 and rows["Residual"].df == 3
    assert CopiesOnly(4, 3) in surface.notes
    design = np.clip(design, -1.0, 1.0)
    surface = fit_surface(design, values.mean(axis=1), ["a", "b"], within=within)
    once = fit_surface(design[:9], values[:9].mean(axis=1), ["a", "b"], within=within.at(np.arange(9)))
    rows, alone = ({row.source: row for row in s.anova}["Lack of fit"] for s in (surface, once))
    assert (rows.f, rows.p, rows.df) == pytest.approx((alone.f, alone.p, alone.df))


def test_intervals_take_the_larger_error() -> None:
    """Where the residual is smaller by luck, s² is Σ(m − 1)s²/m over Σ(m − 1), and its df go with it."""
    values = phases(2.0)
    surface = fitted(values)
    plain = fit_surface(DESIGN, values.mean(axis=1), ["a", "b"])
    within = float(np.mean(values.var(axis=1, ddof=1)) / 4.0)
    assert surface.mean_square == pytest.approx(max(within, plain.mean_square))
    exact = phases(2.0)
    exact += (term_columns(DESIGN) @ np.array([100, 10, 4, 1, 0, 0]) - exact.mean(axis=1))[:, None]
    surface = fitted(exact)
    assert surface.error_source == "within" and surface.df == 27 and surface.mean_square > 0.1
    low, high = surface.mean_interval([0.0, 0.0])[0]
    assert high - low == pytest.approx(2 * 2.0518 * np.sqrt(surface.mean_square), rel=1e-4)  # t(27), leverage 1
    assert surface.error_source == "within"


def test_a_saturated_fit_has_intervals_all_the_same() -> None:
    values = phases(2.0)[[0, 1, 2, 4, 6, 8]]
    design = DESIGN[[0, 1, 2, 4, 6, 8]]
    within = Within(values.std(axis=1, ddof=1), np.full(6, 4))
    surface = fit_surface(design, values.mean(axis=1), ["a", "b"], within=within)
    assert surface.df == 18 and surface.coefficients[0].low is not None


# ---- runs that are missing


def test_terms_that_failed_runs_made_inestimable_are_named() -> None:
    """Without axial runs a² and b² are one column; with a = 0 alone nothing separates a from the mean."""
    y = np.where(AXIAL, np.nan, phases(1.0).mean(axis=1))
    with pytest.raises(RunsFailed, match=r"4 of 9 runs failed; the 5 left cannot estimate a\^2, b\^2; repair those"):
        fit_surface(DESIGN, y, ["a", "b"])
    with pytest.raises(UsageError, match=r"rsm.reduce: the runs cannot estimate the full quadratic"):
        reduce_surface(DESIGN, y, ["a", "b"])
    with pytest.raises(RunsFailed, match="9 of 9 runs failed; the 0 left cannot estimate the mean"):
        fit_surface(DESIGN, np.full(9, np.nan), ["a", "b"])
    with pytest.raises(UsageError, match="take a design with more runs"):
        fit_surface(DESIGN[~AXIAL], phases(1.0).mean(axis=1)[~AXIAL], ["a", "b"])


def test_lost_orthogonality_is_stated() -> None:
    """a² and b² correlate through the mean; one corner fewer makes it worse."""
    y = phases(1.0).mean(axis=1)
    planned = max(c.vif for c in fit_surface(DESIGN, y, ["a", "b"]).coefficients[1:])
    y[0] = np.nan
    surface = fit_surface(DESIGN, y, ["a", "b"])
    now = max(c.vif for c in surface.coefficients[1:])
    assert now > planned + 0.04
    (said,) = (note for note in surface.notes if isinstance(note, SurfaceRunsFailed))
    assert (said.failed, said.inflation) == (1, now)
