"""More worked examples, cell by cell: a composite, factorials whole and halved, a Box–Behnken with lack of fit."""

import numpy as np
import pytest
from printed import agrees
from statsmodels.regression.linear_model import OLS
from test_worked_examples import cells_agree

from stemcal.doe.coding import Coding, term_columns, term_names
from stemcal.doe.effects import lenth
from stemcal.doe.factorial import full_factorial
from stemcal.doe.regression.canonical import canonical_analysis
from stemcal.doe.regression.surface import fit_surface

AXIAL = 2.0**0.5  # printed as 1.414; the book's sums of squares are those of √2


def as_statsmodels_fits(surface):
    """Compare sum of squares, F and p of every term, and F and p of the lack of fit, to 1e-8."""
    every, rows = term_names(surface.names), {row.source: row for row in surface.anova}
    fit = OLS(surface.response, term_columns(surface.design)[:, [every.index(term) for term in surface.terms]]).fit()
    for term, f, p in zip(surface.terms[1:], fit.tvalues[1:] ** 2, fit.pvalues[1:], strict=True):
        row = rows[term]
        assert (row.sum_of_squares, row.f, row.p) == pytest.approx((f * fit.mse_resid, f, p), rel=1e-8)
    _, point = np.unique(surface.design, axis=0, return_inverse=True)
    by_points = OLS(surface.response, np.eye(point.max() + 1)[point.reshape(-1)]).fit()
    if by_points.df_resid > 0:
        f, p, _ = by_points.compare_f_test(fit)
        assert (rows["Lack of fit"].f, rows["Lack of fit"].p) == pytest.approx((f, p), rel=1e-8)


def test_central_composite_of_the_chemical_yield():
    """Montgomery, Design and Analysis of Experiments, 5th ed. (2001), example 11-1, p. 431.

    The cells were read from the reprint among ReliaWiki's reference examples, "Central Composite Response Surface
    Method".
    """
    axial = [[AXIAL, 0.0], [-AXIAL, 0.0], [0.0, AXIAL], [0.0, -AXIAL]]
    design = np.vstack([full_factorial(2), np.zeros((5, 2)), axial])
    by_run = {(-1, -1): 76.5, (-1, 1): 77.0, (1, -1): 78.0, (1, 1): 79.5}
    yields = [by_run[int(a), int(b)] for a, b in design[:4]]
    yields += [79.9, 80.3, 80.0, 79.7, 79.8, 78.4, 75.6, 78.5, 77.0]
    surface = fit_surface(design, yields, ["A", "B"])
    printed = {
        "Model": "28.25 5 5.65 79.85",
        "A": "7.92 1 7.92 111.93",
        "B": "2.12 1 2.12 30.01 0.0009",
        "A^2": "13.18 1 13.18 186.22",
        "B^2": "6.97 1 6.97 98.56",
        "A:B": "0.25 1 0.25 3.53 0.1022",
        "Residual": "0.50 7 0.071",
        "Lack of fit": "0.28 3 0.094 1.78 0.2897",
        "Pure error": "0.21 4 0.053",
        "Cor total": "28.74 12",
    }
    assert cells_agree(surface, printed) == 39
    shape = canonical_analysis(surface, Coding(surface.names, (85.0, 175.0), (5.0, 5.0)))
    time, temperature = shape.natural.values()
    assert agrees("87", time) and agrees("176.5", temperature)  # "87 minutes", "176.5 F"
    assert agrees("80.21", shape.predicted) and shape.kind == "maximum"


def test_half_fraction_of_the_chemical_process():
    """Montgomery, 8th ed. (2012), problem 8.1, 2^(4−1) with I = ABCD; Design-Expert's output read from a page with the
    solutions to chapter 8 (pdfcoffee.com/ch-08-11-pdf-free.html), data, effects, ANOVA and Lenth's margins.
    """
    yields = {"": 90, "ad": 72, "bd": 87, "ab": 83, "cd": 99, "ac": 81, "bc": 88, "abcd": 80}
    design = np.array([[1.0 if letter in run else -1.0 for letter in "abcd"] for run in yields])
    surface = fit_surface(design, list(yields.values()), list("ABCD"), terms=["A", "B", "D", "A:B", "A:D"])
    as_statsmodels_fits(surface)
    printed = {
        "Model": "414.00 5 82.80 4.87 0.1791",
        "A": "288.00 1 288.00 16.94 0.0543",
        "B": "2.00 1 2.00 0.12 0.7643",
        "D": "2.00 1 2.00 0.12 0.7643",
        "A:B": "72.00 1 72.00 4.24 0.1758",
        "A:D": "50.00 1 50.00 2.94 0.2285",
        "Residual": "34.00 2 17.00",
        "Cor total": "448.00 7",
    }
    assert cells_agree(surface, printed) == 35
    margins = lenth(np.array([-12.0, -1.0, 4.0, -1.0, 6.0, -1.0, -5.0]))
    assert margins.pse == 6.0 and (margins.me, margins.sme) == pytest.approx((22.5856, 54.0516), rel=1e-4)


def test_box_behnken_of_the_sas_manual():
    """Odour of a chemical: data of SAS/STAT User's Guide, PROC RSREG, "A Response Surface with a Simple Optimum".

    Schneider and Stockett (1963) in John (1971), 15 runs in three factors. The guide says that the lack of fit is
    significant and the products are not; the numbers are those of statsmodels, here to 1e-8.
    """
    odour = [66, 39, 43, 49, 58, 17, -5, -40, 65, 7, 43, -22, -31, -35, -26]
    levels = [[40, 0.3, 4], [120, 0.3, 4], [40, 0.7, 4], [120, 0.7, 4], [40, 0.5, 2], [120, 0.5, 2], [40, 0.5, 6]]
    levels += [[120, 0.5, 6], [80, 0.3, 2], [80, 0.7, 2], [80, 0.3, 6], [80, 0.7, 6], *([[80, 0.5, 4]] * 3)]
    coding = Coding(("T", "R", "H"), (80.0, 0.5, 4.0), (40.0, 0.2, 2.0))
    surface = fit_surface(np.round(coding.to_coded(levels), 12), odour, coding.names)
    as_statsmodels_fits(surface)
    rows = {row.source: row for row in surface.anova}
    assert agrees("22.478508", surface.mean_square**0.5) and agrees("0.8820", surface.r2)
    assert agrees("147.8849", surface.cv_percent)
    assert agrees("18882", rows["Model"].sum_of_squares)
    assert agrees("4.15", rows["Model"].f) and agrees("0.0657", rows["Model"].p)
    linear = sum(rows[name].sum_of_squares for name in "TRH")
    products = sum(rows[name].sum_of_squares for name in ("T:R", "T:H", "R:H"))
    assert agrees("7143.250000", linear) and agrees("293.500000", products)
    assert agrees("11445", rows["Model"].sum_of_squares - linear - products)
    assert agrees("2485.750000", rows["Lack of fit"].sum_of_squares)
    assert agrees("828.583333", rows["Lack of fit"].mean_square)
    assert agrees("40.75", rows["Lack of fit"].f) and agrees("0.0240", rows["Lack of fit"].p)
