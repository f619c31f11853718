"""Tables of what the laboratory brought."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stemcal.report.numbers import fixed, interval, probability, short, significant
from stemcal.report.tables.sheet import Sheet

Data = Mapping[str, Any]


def diameter_sheets(data: Data) -> list[Sheet]:
    """Return the normal fit of the stem diameters, and their grades."""
    tests = [
        (test["name"], f"{fixed(test['statistic'], 4)}, p = {probability(test['p'])}{_verdict(test['p'])}")
        for test in data["normality"]
    ]
    rows = (
        ("Stems", f"{data['n']}, {data['readings']} readings"),
        ("Mean, mm", f"{fixed(data['mean'], 3)} (95 % {interval(data['mean_interval'])})"),
        ("Standard deviation, mm", f"{fixed(data['sd'], 3)} (95 % {interval(data['sd_interval'])})"),
        ("Coefficient of variation, %", fixed(data["cv_percent"], 2)),
        *tests,
    )
    grades = tuple(
        (f"{short(g['diameter'])}", f"{short(g['low'])} to {short(g['high'])}", str(g["count"]),
         fixed(g["share_percent"], 1), fixed(g["fitted_percent"], 1))
        for g in data["grades"]
    )  # fmt: skip
    foot = f"Together {fixed(data['share_percent'], 1)} % of the stems; the upper limit belongs to the next grade."
    columns = ("Grade, mm", "Diameters, mm", "Stems", "Share, %", "Fitted, %")
    return [
        Sheet("Stem diameters", ("Statistic", "Value"), rows, texts=2),
        Sheet("Grades", columns, grades, texts=2, foot=(foot,)),
    ]


def _verdict(p: float) -> str:
    return ", normal is tenable" if p >= 0.05 else ", not normal"


def shear_sheets(data: Data) -> list[Sheet]:
    """Return the maximum shear force of every specimen, and what each grade comes to."""
    rows = tuple(
        (
            short(g["diameter"]),
            str(g["n"]),
            significant(g["mean"]),
            significant(g["sd"]),
            fixed(g["cv_percent"], 1),
            interval(g["mean_interval"]),
            f"{g['suspect'] or 'none'}",
        )
        for g in data["grades"]
    )
    columns = ("Diameter, mm", "n", "Mean, N", "SD, N", "CV, %", "95 % of the mean, N", "Outlier")
    foot = ("Outlier: by Grubbs' test, counted nevertheless.", *_law(data["power_law"]))
    return [Sheet("Maximum shear force by grade", columns, rows, texts=0, foot=foot), _specimen_sheet(data)]


def _law(law: Data | None) -> tuple[str, ...]:
    if law is None:
        return ()
    bounds = f" (95 % {interval(law['exponent_interval'], 3)})" if law["exponent_interval"] else ""
    return (
        f"F = {significant(law['factor'], 3)}·d^{fixed(law['exponent'], 2)}{bounds}, F in N, d in mm, "
        f"R² {fixed(law['r2'], 3)} of the logarithms.",
    )


def _specimen_sheet(data: Data) -> Sheet:
    rows = tuple(
        (s["specimen"], short(s["diameter"]), significant(s["max_force"]), fixed(s["travel_at_max"], 2),
         str(s["trimmed_points"]), "left out" if s["excluded"] else "")
        for s in data["specimens"]
    )  # fmt: skip
    columns = ("Specimen", "Diameter, mm", "Maximum, N", "at, mm", "Points trimmed", "")
    return Sheet("Specimens", columns, rows)
