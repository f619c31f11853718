"""Tables of measured stems and curves, cell by cell."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_measured_tests import STIFFNESS, THREE, sheet

from stemcal.measured import shear
from stemcal.measured.diameters import Diameters, Grade, _MeasuredStem
from stemcal.measured.shear import ShearTests, _GradeForces
from stemcal.measured.shear_curves import CurveOptions, ShearCurve
from stemcal.measured.statistics import ShapiroWilk, Summary, summarise
from stemcal.overview import measured_tests
from stemcal.overview.measured_tests import diameter_tables, measure_tests, shear_tables
from stemcal.power_law import PowerLaw
from stemcal.storage.rows import Rows
from stemcal.study.reading import load_study

STEMS = Diameters(
    source="stems.csv",
    stems=Rows([_MeasuredStem("1", 7.5)]),
    readings=6,
    summary=Summary(3, 8.0, 1.0, 12.5, (5.5159, 10.4841), (0.5207, 6.2847)),
    normality=ShapiroWilk(0.98765, 0.05),
    grades=Rows([Grade(7.0, 6.5, 7.5, 1, 100.0 / 3.0, 24.17), Grade(8.0, 7.5, 8.5, 2, 200.0 / 3.0, 38.29)]),
    share_percent=98.76,
    synthetic=False,
)


def test_diameters() -> None:
    statistics, grades = diameter_tables(STEMS)
    assert statistics.title == "Stem diameters" and statistics.heads == ("Statistic", "Value")
    assert statistics.cells == (
        ("Stems", "3, 6 readings"),
        ("Mean, mm", "8.000 (95 % CI 5.516 to 10.48)"),
        ("Standard deviation, mm", "1.000 (95 % CI 0.5207 to 6.285)"),
        ("Coefficient of variation, %", "12.50"),
        ("Shapiro–Wilk", "0.9877, p = 0.0500, normality not rejected"),
    )
    assert grades.title == "Grades"
    assert grades.heads == ("Grade, mm", "Diameters, mm", "Stems", "Share, %", "Fitted, %")
    assert grades.cells == (("7", "6.500 to 7.500", "1", "33.3", "24.2"), ("8", "7.500 to 8.500", "2", "66.7", "38.3"))
    assert grades.foot == ("The grades contain 98.8 % of the stems. A grade does not include its upper limit.",)
    skew, _ = diameter_tables(replace(STEMS, normality=ShapiroWilk(0.8, 0.0499)))
    assert skew.cells[-1] == ("Shapiro–Wilk", "0.8000, p = 0.0499, normality rejected")


def curve(*points: tuple[float, float], trimmed: int = 0) -> ShearCurve:
    travel, force = map(np.array, zip(*points, strict=True))
    return ShearCurve("a.csv", travel, force, trimmed, None, False)


WHOLE = curve((0.0, 0.0), (1.0, 100.0), (1.1, 20.0), (2.0, 150.0), (2.1, 40.0), (3.0, 0.0), trimmed=4)
SHORT = curve((0.0, 0.0), (1.5, 80.0), trimmed=1)
TESTS = ShearTests(
    specimens=(shear.TestedSpecimen("7mm-1", 7.0, 7.02, SHORT), shear.TestedSpecimen("7mm-2", 7.0, 6.9, SHORT)),
    grades=(
        _GradeForces(
            diameter=7.0,
            summary=Summary(2, 80.123, 2.5, 3.1202, (57.66, 102.6), (1.0, 80.0)),
            travel=summarise([1.5]),
            work=summarise([60.0]),
        ),
    ),
    power_law=PowerLaw(1.8523, 2.1234, (1.9, 2.35), 0.98765, 2),
    synthetic=False,
)
LAW = "F = 1.85·d^2.12{} with F in N and d in mm (R² = 0.988 for the log–log fit)."


def test_shear_tests() -> None:
    grades, specimens = shear_tables(TESTS)
    assert grades.title == "Maximum shear force by grade"
    assert grades.heads == ("Diameter, mm", "n", "Mean, N", "SD, N", "CV, %", "95 % CI of the mean, N")
    assert grades.cells == (("7", "2", "80.12", "2.500", "3.1", "57.66 to 102.6"),)
    assert grades.foot == (LAW.format(" (95 % CI 1.90 to 2.35)"),)
    assert specimens.title == "Specimens"
    assert specimens.heads == ("Specimen", "Diameter, mm", "Maximum, N", "Travel, mm", "Points trimmed")
    assert specimens.cells == (("7mm-1", "7.02", "80.00", "1.50", "1"), ("7mm-2", "6.9", "80.00", "1.50", "1"))
    two_points = replace(TESTS, power_law=replace(TESTS.power_law, exponent_interval=None))
    assert shear_tables(two_points)[0].foot == (LAW.format(""),)
    assert shear_tables(replace(TESTS, power_law=None))[0].foot == ()


def test_a_curve_through_the_whole_stem_has_its_energy() -> None:
    """∫F du: 50 + 6 + 76.5 + 9.5 + 18 = 160 mJ; the first fracture is at 100 N, the maximum at 150 N."""
    both = (*TESTS.specimens[:1], shear.TestedSpecimen("7mm-3", 7.0, 7.0, WHOLE))
    _, specimens = shear_tables(replace(TESTS, specimens=both))
    assert specimens.heads[3:] == (
        "Travel, mm",
        "Cutting energy, mJ",
        "First fracture, N",
        "Points trimmed",
    )
    assert specimens.cells[1] == ("7mm-3", "7", "150.0", "2.00", "160.0", "100.0", "4")
    assert specimens.cells[0][4:] == ("–", "–", "1")


def test_means_of_the_tests(tmp_path: Path) -> None:
    """Straight lines to 600 and 640 N: work F²/2k."""
    (tmp_path / "pull").mkdir()
    for number, maximum in enumerate((600.0, 640.0)):
        (tmp_path / "pull" / f"8mm-{number}.csv").write_text(sheet(maximum), encoding="utf-8")
    table = measured_tests.tests_table(measure_tests(load_study(THREE), tmp_path, CurveOptions(preload=0.0)))
    works = [force**2 / (2.0 * STIFFNESS) for force in (600.0, 640.0)]
    assert table.title == "Test measurements"
    assert table.heads == ("Test", "Diameter, mm", "Response", "n", "Mean", "SD", "Unit")
    force, work = table.cells
    assert (force[:2], force[3:]) == (("pull", "8"), ("2", "620.0", "28.28", "N"))
    assert work[3:] == ("2", f"{sum(works) / 2:.1f}", f"{(works[1] - works[0]) / 2**0.5:.2f}", "mJ")
    assert force[2] != work[2]


def test_excluded_specimens_leave_their_test_alone(tmp_path: Path) -> None:
    for test in ("pull", "bending"):
        (tmp_path / test).mkdir()
        for number, maximum in enumerate((600.0, 640.0)):
            (tmp_path / test / f"8mm-{number}.csv").write_text(sheet(maximum), encoding="utf-8")
    found = measure_tests(load_study(THREE), tmp_path, CurveOptions(preload=0.0), exclude=["pull/8mm-1"])
    n = {(mean.test, mean.response): mean.summary.n for mean in found.means}
    assert {count for (test, _), count in n.items() if test == "pull"} == {1}
    assert {count for (test, _), count in n.items() if test == "bending"} == {2}
    assert n["pull", "force"] == 1 and not found.synthetic
    assert [note.kind for note in found.notes].count("excluded") == 1
    assert found.means[0].summary.mean == pytest.approx(600.0) or found.means[0].test == "bending"
