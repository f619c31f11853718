"""Worked examples of handbooks, textbooks and manuals, cell by cell at the precision they print."""

import numpy as np
import pytest
from printed import agrees

from stemcal.doe.coding import Coding
from stemcal.doe.designs import box_behnken
from stemcal.doe.factorial import full_factorial
from stemcal.doe.regression.canonical import canonical_analysis
from stemcal.doe.regression.surface import fit_surface


def cells_agree(surface, printed):
    """Compare rows of printed cells (SS, df, mean square, F, p); returns how many there are."""
    rows, count = {row.source: row for row in surface.anova}, 0
    for source, cells in printed.items():
        row = rows[source]
        values = (row.sum_of_squares, row.df, row.mean_square, row.f, row.p)
        for cell, value in zip(cells.split(), values, strict=False):
            if cell != ".":
                assert agrees(cell, value), (source, cell, value)
                count += 1
    return count


def test_box_behnken_of_myers_and_montgomery():
    """Myers and Montgomery, Response Surface Methodology, 2nd ed. (2002), example 7.5, p. 347: viscosity of a resin.

    Reprinted among ReliaWiki's reference examples, "Box Behnken RSM".
    Their sum of squares of BC has F 1.22 beside 12.25/10.25 = 1.195, and p 0.3241: F is misprinted.
    """
    viscosity = [53, 58, 59, 56, 64, 45, 35, 60, 59, 64, 53, 65, 65, 59, 62]
    order = [0, 2, 1, 3]  # theirs changes the first factor fastest
    design = box_behnken(3, 3)
    design[:12] = np.vstack([design[4 * i : 4 * i + 4][order] for i in range(3)])
    surface = fit_surface(design, viscosity, list("ABC"))
    printed = {
        "Model": "882.48 9 98.05 9.57 0.0114",
        "A": "8.00 1 8.00 0.78 0.4174",
        "B": ". 1 . 5.38 0.0681",
        "C": ". 1 . 4.40 0.09",
        "A^2": "200.83 1 200.83 19.59 0.0069",
        "B^2": "12.98 1 12.98 1.27 0.3115",
        "C^2": "48.52 1 48.52 4.73 0.0816",
        "A:B": "16.00 1 16.00 1.56 0.2668",
        "A:C": "484.00 1 484.00 47.22 0.001",
        "B:C": "12.25 1 12.25 . 0.3241",
        "Residual": "51.25 5 10.25",
        "Lack of fit": "33.25 3 11.08 1.23 0.4774",
        "Pure error": "18 2 9.00",
        "Cor total": "933.73 14",
    }
    rows = {row.source: row for row in surface.anova}
    assert rows["B"].sum_of_squares == pytest.approx(55.125)  # printed 55.12 and, for C, 45.13
    assert rows["C"].sum_of_squares == pytest.approx(45.125)
    assert cells_agree(surface, printed) == 58


@pytest.fixture(scope="module")
def mercaptobenzothiazole():
    """SAS/STAT User's Guide, PROC RSREG, example 1: Frankel (1961) in Myers (1976), an unbalanced composite.

    One axial run was made twice, the rounded levels leave nothing orthogonal.
    """
    time = [4, 20, 12, 12, 12, 12, 12, 6.3, 6.3, 17.7, 17.7, 4]
    temp = [250, 250, 250, 250, 220, 280, 250, 229, 271, 229, 271, 250]
    found = [83.8, 81.7, 82.4, 82.9, 84.7, 57.9, 81.2, 81.3, 83.1, 85.3, 72.7, 82.0]
    coding = Coding(("Time", "Temp"), (12.0, 250.0), (8.0, 30.0))
    return fit_surface(coding.to_coded(np.transpose([time, temp])), found, coding.names), coding


def test_unbalanced_composite_of_the_sas_manual(mercaptobenzothiazole):
    surface, _ = mercaptobenzothiazole
    printed = {
        "Model": "512.193947 5 . 4.81 0.0410",
        "Time:Temp": "51.840000 1 51.840000 2.43 0.1698",
        "Residual": "127.842720 6 21.307120",
        "Lack of fit": "124.696053 3 41.565351 39.63 0.0065",
        "Pure error": "3.146667 3 1.048889",
    }
    assert cells_agree(surface, printed) == 20
    assert agrees("4.615964", surface.mean_square**0.5)
    assert agrees("0.8003", surface.r2) and agrees("5.7760", surface.cv_percent)
    coded = ["82.173110", "-1.014287", "-8.676768", "-7.218045", "1.384394", "-8.852519"]
    assert all(agrees(cell, c.value) for cell, c in zip(coded, surface.coefficients, strict=True))


def test_saddle_of_the_sas_manual(mercaptobenzothiazole):
    shape = canonical_analysis(*mercaptobenzothiazole)
    assert shape.kind == "saddle"
    assert agrees("-0.441758", shape.coded["Time"]) and agrees("-0.309976", shape.coded["Temp"])
    assert agrees("2.528816", shape.eigenvalues[0]) and agrees("-9.996940", shape.eigenvalues[1])


FILTRATION = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]


def test_reduced_factorial_with_centre_points():
    """Montgomery, table 6.24: the filtration rate with four centre points, model A, C, D, AC, AD.

    The printed residual with 13 df leaves out a curvature of 1.51, which is in the residual here.
    """
    design = np.vstack([full_factorial(4), np.zeros((4, 4))])
    rate = [*FILTRATION, 73, 75, 66, 69]
    surface = fit_surface(design, rate, list("ABCD"), terms=["A", "C", "D", "A:C", "A:D"])
    printed = {
        "Model": "5535.81 5 1107.16",
        "A": "1870.56 1",
        "C": "390.06 1",
        "D": "855.56 1",
        "A:C": "1314.06 1",
        "A:D": "1105.56 1",
        "Pure error": "48.75 3 16.25",
        "Cor total": "5781.20 19",
    }
    assert cells_agree(surface, printed) == 18
    rows = {row.source: row for row in surface.anova}
    assert rows["Residual"].df == 14
    assert agrees("243.87", rows["Residual"].sum_of_squares - 1.5125)
