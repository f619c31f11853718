"""Worked examples of handbooks, textbooks and manuals, cell by cell at the precision they print."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from printed import agrees

from stemcal.doe.designs.box_behnken import box_behnken
from stemcal.doe.designs.factorial import fraction, full_factorial
from stemcal.doe.regression.canonical import analyse_shape, ridge_path
from stemcal.doe.regression.coding import Coding
from stemcal.doe.regression.reduction import reduce_surface
from stemcal.doe.regression.surface import fit_surface
from stemcal.doe.regression.transform import box_cox
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.lenth import lenth


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


@pytest.fixture(scope="module")
def chem_react():
    """R package rsm (R. V. Lenth, J. Stat. Software 32(7), 2009), data ChemReact: a composite in two blocks.

    The numbers are those of its vignette "Response-Surface Methods in R, Using rsm", model CR.rsm2.
    From R. H. Myers, D. C. Montgomery and C. M. Anderson-Cook, Response Surface Methodology, table 7.6.
    """
    time = [80, 80, 90, 90, 85, 85, 85, 85, 85, 85, 92.07, 77.93, 85, 85]
    temp = [170, 180, 170, 180, 175, 175, 175, 175, 175, 175, 175, 175, 182.07, 167.93]
    yields = [80.5, 81.5, 82.0, 83.5, 83.9, 84.3, 84.0, 79.7, 79.8, 79.5, 78.4, 75.6, 78.5, 77.0]
    coding = Coding(("Time", "Temp"), (85.0, 175.0), (5.0, 5.0))
    coded = coding.to_coded(np.column_stack([time, temp]))
    return fit_surface(coded, yields, coding.names, blocks=["B1"] * 7 + ["B2"] * 7), coding


def test_chem_react_coefficients_as_rsm_prints_them(chem_react):
    """summary(rsm(Yield ~ Block + SO(x1, x2))): R codes the first block as the reference, here they add up to 0."""
    surface, _ = chem_react
    printed = {
        "Time": ("0.932541", "0.057699"),
        "Temp": ("0.577712", "0.057699"),
        "Time:Temp": ("0.125000", "0.081592"),
        "Time^2": ("-1.308555", "0.060064"),
        "Temp^2": ("-0.933442", "0.060064"),
    }
    for coefficient in surface.coefficients[1:]:
        value, error = printed[coefficient.term]
        assert agrees(value, coefficient.value) and agrees(error, coefficient.standard_error)
    effects = surface.block_effects
    assert agrees("84.095427", surface.coefficients[0].value + effects["B1"])
    assert agrees("-4.457530", effects["B2"] - effects["B1"])


def test_chem_react_anova_as_rsm_prints_it(chem_react):
    surface, _ = chem_react
    printed = {
        "Block": "69.531 1 69.531",
        "Residual": "0.186 7 0.027",
        "Lack of fit": "0.053 3 0.018 0.5307 0.6851",
        "Pure error": "0.133 4 0.033",
        "Cor total": ". 13",
    }
    assert cells_agree(surface, printed) == 15
    rows = {row.source: row for row in surface.anova}
    assert agrees("9.626", rows["Time"].sum_of_squares + rows["Temp"].sum_of_squares)  # FO
    assert agrees("0.1694", rows["Time:Temp"].p)  # TWI
    assert agrees("17.791", surface.sequential_ss["Time^2"] + surface.sequential_ss["Temp^2"])  # PQ
    squares = rows["Model"].sum_of_squares - sum(rows[t].sum_of_squares for t in ("Time", "Temp", "Time:Temp"))
    assert agrees("17.791", squares)  # PQ


def test_chem_react_canonical_analysis_as_rsm_prints_it(chem_react):
    surface, coding = chem_react
    shape = analyse_shape(surface)
    assert agrees("0.3722954", shape.point[0])
    assert [float(v) for v in shape.eigenvalues] == pytest.approx([-0.9233027, -1.3186949], abs=5e-8)
    assert np.abs(shape.axes) == pytest.approx(np.array([[0.1601375, 0.9870947], [0.9870947, 0.1601375]]), abs=5e-8)
    assert coding.to_natural(shape.point) == pytest.approx([86.86148, 176.67190], abs=5e-6)
    assert shape.kind == "maximum" and shape.inside


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
    data = np.array(
        [
            [4, 250, 83.8],
            [20, 250, 81.7],
            [12, 250, 82.4],
            [12, 250, 82.9],
            [12, 220, 84.7],
            [12, 280, 57.9],
            [12, 250, 81.2],
            [6.3, 229, 81.3],
            [6.3, 271, 83.1],
            [17.7, 229, 85.3],
            [17.7, 271, 72.7],
            [4, 250, 82.0],
        ]
    )
    coding = Coding(("Time", "Temp"), (12.0, 250.0), (8.0, 30.0))
    return fit_surface(coding.to_coded(data[:, :2]), data[:, 2], coding.names), coding


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


def test_saddle_and_ridge_of_the_sas_manual(mercaptobenzothiazole):
    surface, coding = mercaptobenzothiazole
    shape = analyse_shape(surface)
    assert shape.kind == "saddle"
    assert [agrees(*pair) for pair in zip(["-0.441758", "-0.309976"], shape.point, strict=True)] == [True, True]
    assert agrees("2.528816", shape.eigenvalues[0]) and agrees("-9.996940", shape.eigenvalues[1])
    printed = {
        0.0: ("82.173110", "2.665023", "12.000000", "250.000000"),
        0.1: ("82.952909", "2.648671", "11.964493", "247.002956"),
        0.5: ("84.914099", "2.404616", "14.370977", "237.919138"),
        1.0: ("87.732874", "3.648568", "18.450682", "232.256238"),
    }
    for point, cells in zip(ridge_path(surface, list(printed)), printed.values(), strict=True):
        values = (point.predicted, point.standard_error, *coding.to_natural(point.coded))
        assert all(agrees(cell, value) for cell, value in zip(cells, values, strict=True)), point


FILTRATION = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]


def test_half_fraction_of_the_filtration_rate():
    """The 2^(4−1) with I = ABCD out of the filtration rate, as in Montgomery, Design and Analysis, example 8.1.

    The estimates are differences of means, not read from a page: A 19.00, B 1.50, C 14.00, D 16.50, AB −1.00,
    AC −18.50, AD 19.00.
    """
    whole = full_factorial(4)
    half = fraction(4, 8).design()
    rate = [FILTRATION[int(np.flatnonzero((whole == run).all(axis=1))[0])] for run in half]
    result = analyse_screening(half, rate, list("ABCD"))
    assert [effect.effect for effect in result.effects] == pytest.approx([19.0, 1.5, 14.0, 16.5])
    products = [half[:, 0] * half[:, i] for i in (1, 2, 3)]
    assert [float(np.dot(column, rate)) / 4 for column in products] == pytest.approx([-1.0, -18.5, 19.0])
    assert result.aliases().weights["A"] == (0.0,) * 6


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
    linear = reduce_surface(full_factorial(4), FILTRATION, list("ABCD"), "forward", 0.01)
    assert set(linear.surface.terms) == {"1", "A", "C", "D", "A:C", "A:D"}


def test_blocked_replicates_of_the_tool_life():
    """Montgomery, problems 6.1 and 7.1: a 2³ factorial in three blocks, analysed with A, B, C, AC.

    The table is Design-Expert's in the solutions to the 8th edition (2012), section 7.1, every cell of it.
    """
    life = [[22, 32, 35, 55, 44, 40, 60, 39], [31, 43, 34, 47, 45, 37, 50, 41], [25, 29, 50, 46, 38, 36, 54, 47]]
    design = np.vstack([full_factorial(3)] * 3)
    blocks = np.repeat([1, 2, 3], 8).tolist()
    surface = fit_surface(design, np.ravel(life), list("ABC"), terms=["A", "B", "C", "A:C"], blocks=blocks)
    printed = {
        "Block": "0.58 2 0.29",
        "Model": "1519.67 4 379.92 11.23 0.0001",
        "A": "0.67 1 0.67 0.020 0.8900",
        "B": "770.67 1 770.67 22.78 0.0002",
        "C": "280.17 1 280.17 8.28 0.0104",
        "A:C": "468.17 1 468.17 13.84 0.0017",
        "Residual": "575.08 17 33.83",
        "Cor total": "2095.33 23",
    }
    assert cells_agree(surface, printed) == 33


def test_first_order_design_with_centre_points():
    """Montgomery, problem 11.1: purity of oxygen, whose Design-Expert output prints curvature apart."""
    design = np.vstack([[[-1, -1], [-1, 1], [1, -1], [1, 1]], np.zeros((4, 2))])
    purity = [82.8, 83.5, 84.7, 85.0, 84.1, 84.5, 83.9, 84.3]
    surface = fit_surface(design, purity, ["A", "B"], terms=["A", "B"])
    assert cells_agree(surface, {"Model": "3.14 2 1.57", "A": "2.89 1", "B": "0.25 1"}) == 7
    assert cells_agree(surface, {"Pure error": "0.20 3 0.067", "Cor total": "3.46 7"}) == 5
    assert [c.value for c in surface.coefficients] == pytest.approx([84.1, 0.85, 0.25])


def test_box_cox_of_the_textile_experiment():
    """Box and Cox 1964, section 5: cycles to failure of worsted yarn, 3³; λ̂ = −0.06, interval −0.18 to 0.06.

    Their interval takes the likelihood as normal; with t it is a little wider.
    """
    cycles = [674, 370, 292, 338, 266, 210, 170, 118, 90, 1414, 1198, 634, 1022, 620, 438, 442, 332, 220]
    cycles += [3636, 3184, 2000, 1568, 1070, 566, 1140, 884, 360]
    x = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
    found = box_cox(np.column_stack([np.ones(27), x]), np.array(cycles, dtype=float))
    assert agrees("-0.06", found.best)
    assert found.low == pytest.approx(-0.18, abs=0.02) and found.high == pytest.approx(0.06, abs=0.02)
    assert found.advised == 0.0


def test_lenth_of_the_filtration_rate():
    """Montgomery, example 6.2: fifteen effects, PSE 2.625; its ME of 6.748 (Design-Expert) is t(0.975; 5)·PSE."""
    design = full_factorial(4)
    columns = [np.prod(design[:, [i for i in range(4) if m >> i & 1]], axis=1) for m in range(1, 16)]
    size = lenth(np.array(columns) @ np.array(FILTRATION) / 8.0)
    assert size.pse == pytest.approx(2.625)
    assert size.me == pytest.approx(2.157 * 2.625, rel=5e-3)
