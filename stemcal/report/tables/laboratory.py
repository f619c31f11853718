"""Tables of what the laboratory brought."""

from __future__ import annotations

from stemcal.measured.diameters import Diameters
from stemcal.measured.shear import ShearTests
from stemcal.power_law import PowerLaw
from stemcal.report.tables.sheet import Sheet
from stemcal.text.numbers import fixed, interval, probability, short, significant


def diameter_sheets(found: Diameters) -> list[Sheet]:
    """Return the normal fit of the stem diameters, and their grades."""
    tests = [
        (test.name, f"{fixed(test.statistic, 4)}, p = {probability(test.p)}{_verdict(test.p)}")
        for test in found.normality
    ]
    summary = found.summary
    rows = (
        ("Stems", f"{summary.n}, {found.readings} readings"),
        ("Mean, mm", f"{fixed(summary.mean, 3)} (95 % {interval(summary.mean_interval)})"),
        ("Standard deviation, mm", f"{fixed(summary.sd, 3)} (95 % {interval(summary.sd_interval)})"),
        ("Coefficient of variation, %", fixed(summary.cv_percent, 2)),
        *tests,
    )
    grades = tuple(
        (short(g.diameter), f"{short(g.low)} to {short(g.high)}", str(g.count),
         fixed(g.share_percent, 1), fixed(g.fitted_percent, 1))
        for g in found.grades
    )  # fmt: skip
    foot = f"Together {fixed(found.share_percent, 1)} % of the stems; the upper limit belongs to the next grade."
    columns = ("Grade, mm", "Diameters, mm", "Stems", "Share, %", "Fitted, %")
    return [
        Sheet("Stem diameters", ("Statistic", "Value"), rows, texts=2),
        Sheet("Grades", columns, grades, texts=2, foot=(foot,)),
    ]


def _verdict(p: float) -> str:
    return ", normal is tenable" if p >= 0.05 else ", not normal"


def shear_sheets(tests: ShearTests) -> list[Sheet]:
    """Return the maximum shear force of every specimen, and what each grade comes to."""
    rows = tuple(
        (
            short(g.diameter),
            str(g.summary.n),
            significant(g.summary.mean),
            significant(g.summary.sd),
            fixed(g.summary.cv_percent, 1),
            interval(g.summary.mean_interval),
            g.suspect or "none",
        )
        for g in tests.grades
    )
    columns = ("Diameter, mm", "n", "Mean, N", "SD, N", "CV, %", "95 % of the mean, N", "Outlier")
    foot = ("Outlier: by Grubbs' test, counted nevertheless.", *_law(tests.power_law))
    return [Sheet("Maximum shear force by grade", columns, rows, texts=0, foot=foot), _specimen_sheet(tests)]


def _law(law: PowerLaw | None) -> tuple[str, ...]:
    if law is None:
        return ()
    bounds = f" (95 % {interval(law.exponent_interval, 3)})" if law.exponent_interval else ""
    return (
        f"F = {significant(law.factor, 3)}·d^{fixed(law.exponent, 2)}{bounds}, F in N, d in mm, "
        f"R² {fixed(law.r2, 3)} of the logarithms.",
    )


def _specimen_sheet(tests: ShearTests) -> Sheet:
    rows = tuple(
        (s.name, short(s.diameter), significant(s.curve.max_force), fixed(s.curve.travel_at_max, 2),
         str(s.curve.trimmed), "left out" if s.excluded else "")
        for s in tests.specimens
    )  # fmt: skip
    columns = ("Specimen", "Diameter, mm", "Maximum, N", "at, mm", "Points trimmed", "")
    return Sheet("Specimens", columns, rows)
