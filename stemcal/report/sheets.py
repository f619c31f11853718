"""Tables as data: made once from the stage files, drawn by the terminal and by the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from stemcal.report.closing import audit_sheet, climb_sheet, further_sheets, refine_sheet
from stemcal.report.numbers import fixed, interval, percent, probability, short, significant
from stemcal.report.terms import equation, symbols_of, written

Stage = Mapping[str, Any]


@dataclass(frozen=True)
class Sheet:
    """A table: the first `texts` columns are words, the others numbers; `strong` rows stand out, `long` words wrap."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    texts: int = 1
    foot: tuple[str, ...] = ()
    strong: frozenset[int] = frozenset()
    long: bool = False


def sheets_of(stage: Stage) -> list[Sheet]:
    """Return the tables of a stage."""
    sheets = [make(stage) for make in _SHEETS[stage["stage"]]]
    return [*sheets, *further_sheets(stage)]


def screening_sheet(stage: Stage) -> Sheet:
    """Return the effects as papers print them, with Lenth's t and the p-value adjusted by Holm."""
    effects = stage["effects"]
    rows = [
        (
            e["symbol"],
            e["factor"],
            fixed(e["effect"]),
            percent(e["contribution_percent"]),
            significant(e["sum_of_squares"]),
            fixed(e["f"], 4) if e["f"] is not None and e["f"] < 0.01 else significant(e["f"]),
            starred(e["p"], e["stars"]),
            probability(e["p_holm"]),
            fixed(e["lenth_t"]),
        )
        for e in effects
    ]
    residual = stage["residual"]
    share = 100.0 * residual["sum_of_squares"] / (stage["total_sum_of_squares"] or 1.0)
    rows.append(("", "Residual", "", percent(share), significant(residual["sum_of_squares"]), "", "", "", ""))
    return Sheet(
        "Effects on the maximum force",
        ("", "Factor", "Effect,\nN", "Share,\n%", "Sum of\nsquares", "F", "p", "p\nHolm", "Lenth\nt"),
        tuple(rows),
        texts=2,
        foot=(*_lenth_foot(stage), "** p < 0.01, * p < 0.05. Share: of the total sum of squares."),
        strong=frozenset(i for i, e in enumerate(effects) if e["factor"] in stage["significant"]),
    )


def _lenth_foot(stage: Stage) -> list[str]:
    lenth = stage.get("lenth") or {}
    if lenth.get("pse") is None:
        return []
    return [
        f"Lenth: pseudo standard error {significant(lenth['pse'])} N; an effect beyond "
        f"±{significant(lenth['me'])} N is active, "
        f"beyond ±{significant(lenth['sme'])} N even among all factors."
    ]


def starred(p: float | None, stars: str) -> str:
    """Return a p-value with its stars, the digits aligned."""
    return f"{probability(p)}{stars:<2}" if p is not None else ""


def anova_sheet(stage: Stage) -> Sheet:
    """Return the analysis of variance."""
    symbols = symbols_of(stage)
    rows = [
        (
            _source(row["source"], symbols),
            significant(row["sum_of_squares"], 6),
            str(row["df"]),
            significant(row["mean_square"], 6) if row["mean_square"] is not None else "",
            significant(row["f"]) if row["f"] is not None else "",
            starred(row["p"], row.get("stars", "")),
        )
        for row in stage["anova"]
    ]
    return Sheet(
        "Analysis of variance",
        ("Source", "Sum of squares", "df", "Mean square", "F", "p"),
        tuple(rows),
        foot=() if stage["lack_of_fit_testable"] else ("Lack of fit cannot be tested.",),
        strong=frozenset(i for i, row in enumerate(stage["anova"]) if row.get("stars")),
    )


def _source(source: str, symbols: Mapping[str, str]) -> str:
    known = any(name in symbols for name in source.removesuffix("^2").split(":"))
    return written(source, symbols) if known else source


def coefficient_sheet(stage: Stage) -> Sheet:
    """Return the coefficients with their intervals, the equation below."""
    symbols = symbols_of(stage)
    rows = [
        (
            _source(row["term"], symbols),
            fixed(row["value"], 3),
            fixed(row["standard_error"], 3),
            fixed(row["low"], 3),
            fixed(row["high"], 3),
        )
        for row in stage["coefficients"]
    ]
    coded = (
        f"{entry.get('symbol') or entry['factor']} = ({entry['factor']} − {short(entry['center'])}) / "
        f"{short(entry['half_step'])}"
        for entry in stage["factors"]
    )
    return Sheet(
        "Response surface in coded units",
        ("Term", "Coefficient, N", "Std. error", "95 % low", "95 % high"),
        tuple(rows),
        foot=(equation(stage["coefficients"], symbols), "; ".join(coded)),
    )


def fit_sheet(stage: Stage) -> Sheet:
    """Return how well the surface fits."""
    rows = (
        ("R²", fixed(stage["r2"], 4)),
        ("Adjusted R²", fixed(stage["adjusted_r2"], 4)),
        ("Predicted R²", fixed(stage["predicted_r2"], 4)),
        ("Adequate precision", fixed(stage["adequate_precision"], 2)),
        ("PRESS, N²", significant(stage["press"], 6)),
        ("Coefficient of variation, %", fixed(stage["cv_percent"], 2)),
    )
    return Sheet("Quality of the fit", ("Statistic", "Value"), rows)


def calibration_sheet(stage: Stage) -> Sheet:
    """Return the calibrated parameters with the range each may take."""
    published = (stage.get("published") or {}).get("solution") or {}
    rows = []
    for name, value in stage["solution"].items():
        row = (name, significant(value), interval(stage["ranges"].get(name)), fixed(stage["coded"][name], 3))
        rows.append((*row, short(published.get(name))) if published else row)
    columns = ("Factor", "Calibrated", "Range over all solutions", "Coded")
    foot = (
        f"Target {short(stage['target'])} N; predicted {significant(stage['predicted'])} N; coded radius "
        f"{fixed(stage['coded_radius'], 3)}; rule {stage['rule']}.",
        f"95 % interval of the mean {interval(stage['mean_interval'])} N, of one prediction "
        f"{interval(stage['prediction_interval'])} N.",
    )
    return Sheet("Calibrated parameters", (*columns, "Published") if published else columns, tuple(rows), foot=foot)


def validation_sheet(stage: Stage) -> Sheet:
    """Return measured against simulated force over the diameters."""
    rows = [
        (
            short(row["diameter"]),
            row["role"],
            short(row["measured"]),
            significant(row["simulated"]) if row["simulated"] is not None else row.get("reason") or "failed",
            fixed(row["error_percent"]),
        )
        for row in stage["rows"]
    ]
    foot = (
        f"Largest error {fixed(stage['max_abs_error_percent'])} %, mean "
        f"{fixed(stage['mean_abs_error_percent'])} % (absolute).",
        "Error = 100·(measured − simulated)/measured.",
    )
    columns = ("Diameter, mm", "Role", "Measured, N", "Simulated, N", "Error, %")
    return Sheet("Measured against simulated force", columns, tuple(rows), texts=2, foot=foot)


_SHEETS = {
    "screen": (screening_sheet,),
    "climb": (climb_sheet,),
    "rsm": (anova_sheet, coefficient_sheet, fit_sheet),
    "invert": (calibration_sheet,),
    "refine": (refine_sheet,),
    "validate": (validation_sheet,),
    "audit": (audit_sheet,),
}
