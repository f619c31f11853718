"""The tables of a study as papers print them: Tables 5 to 13 of the wild chrysanthemum study, for one's own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stemcal.report.numbers import MISSING, fixed, percent, probability, short, significant
from stemcal.report.terms import equation, symbols_of, written

if TYPE_CHECKING:
    from stemcal.study.model import Study

Stage = Mapping[str, Any]
Stages = Mapping[str, Stage]
FORCE = "Maximum Shear Force/N"
_NUMBER = re.compile(r"[<−-]?\d[\d.,]*( \*\*?)?")
STARS = "** represents extremely significant effect (p < 0.01), * represents significant effect (p < 0.05)."


@dataclass(frozen=True)
class PaperTable:
    """A table to publish: its number in the published study, a name for files, caption, cells, note below."""

    number: int
    name: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def paper_tables(study: Study, stages: Stages) -> list[PaperTable]:
    """Return the tables that the finished stages allow, in the order of the paper."""
    tables = [factor_table(study)]
    if "screen" in stages:
        tables += [run_table(6, stages["screen"], study), screening_table(stages["screen"])]
    if "rsm" in stages:
        tables += [level_table(stages["rsm"]), run_table(9, stages["rsm"], study), anova_table(stages["rsm"])]
    if "invert" in stages:
        tables += [calibration_table(study, stages["invert"]), parameter_table(study, stages["invert"])]
    if "validate" in stages:
        tables.append(validation_table(stages["validate"]))
    return tables


def factor_table(study: Study) -> PaperTable:
    """Return the screened factors with their levels."""
    rows = tuple((f.symbol, _named(study, f.name), short(f.low), short(f.high)) for f in study.factors)
    columns = ("Symbol", "Parameters", "Low Level", "High Level")
    return PaperTable(5, "factors", "Screening test parameters.", columns, rows)


def run_table(number: int, stage: Stage, study: Study) -> PaperTable:
    """Return a design with its results."""
    runs = stage["design"]["runs"]
    varied = list(runs[0]["coded"])
    rows = tuple((str(r["run"]), *(short(r["levels"][name]) for name in varied), _force(r)) for r in runs)
    columns = ("No.", *(study.factor(name).symbol for name in varied), FORCE)
    if number == 6:
        return PaperTable(6, "screening-runs", "Design scheme and results of the screening test.", columns, rows)
    caption = "Test results and scheme of the response surface design."
    return PaperTable(9, "surface-runs", caption, columns, rows)


def _force(run: Mapping[str, Any]) -> str:
    return significant(run["force"]) if run["force"] is not None else f"failed ({run.get('reason') or 'no reason'})"


def screening_table(stage: Stage) -> PaperTable:
    """Return the effects with their significance."""
    rows = tuple(
        (
            e["symbol"],
            fixed(e["effect"]),
            percent(e["contribution_percent"]),
            _square(e["sum_of_squares"]),
            _ratio(e["f"]),
            starred(e["p"], e["stars"]),
        )
        for e in stage["effects"]
    )
    columns = ("Parameters", "Effect", "Contribution/%", "Sum of Squares", "F-Value", "p-Value")
    return PaperTable(7, "screening", "Significance analysis of the screening test parameters.", columns, rows, STARS)


def level_table(stage: Stage) -> PaperTable:
    """Return what the coded levels of the response surface mean."""
    names = stage["names"]
    coded = sorted({round(run["coded"][name], 3) + 0.0 for run in stage["design"]["runs"] for name in names})
    rows = []
    for level in reversed(coded):
        cells = [stage["coding"][name]["center"] + level * stage["coding"][name]["half_step"] for name in names]
        rows.append((short(level, 4), *(short(cell, 4) for cell in cells)))
    symbols = symbols_of(stage)
    columns = ("Factor Level", *(symbols[name] for name in names))
    return PaperTable(8, "levels", "Factor coding of the response surface design.", columns, tuple(rows))


def anova_table(stage: Stage) -> PaperTable:
    """Return the analysis of variance, the surface's equation below."""
    symbols = symbols_of(stage)
    rows = tuple(
        (
            _source(row["source"], symbols),
            _square(row["sum_of_squares"]),
            str(row["df"]),
            _square(row["mean_square"]),
            _ratio(row["f"]),
            starred(row["p"], row.get("stars", "")),
        )
        for row in stage["anova"]
    )
    columns = ("Source", "Sum of Squares", "df", "Mean Square", "F-Value", "p-Value")
    note = f"{STARS} {equation(stage['coefficients'], symbols)} (coded values)."
    return PaperTable(10, "anova", "ANOVA of the response surface.", columns, rows, note)


def calibration_table(study: Study, stage: Stage) -> PaperTable:
    """Return the calibrated parameters."""
    rows = tuple((_named(study, name), significant(value)) for name, value in stage["solution"].items())
    return PaperTable(11, "calibration", "Parameter calibration values.", ("Parameter", "Numerical Calibration"), rows)


def parameter_table(study: Study, stage: Stage) -> PaperTable:
    """Return all parameters of the validation's simulations."""
    levels = {**study.midlevels(), **stage.get("parameters", {}), **stage["solution"]}
    rows = tuple((f.symbol, _named(study, f.name), significant(levels[f.name])) for f in study.factors)
    caption = "Finite element simulation parameters of the stem."
    return PaperTable(12, "parameters", caption, ("Symbol", "Parameters", "Value"), rows)


def validation_table(stage: Stage) -> PaperTable:
    """Return measured against simulated force."""
    rows = tuple(
        (
            short(row["diameter"]),
            short(row["measured"]),
            significant(row["simulated"]) if row["simulated"] is not None else row.get("reason") or "failed",
            fixed(row["error_percent"], 1),
        )
        for row in stage["rows"]
    )
    columns = ("Stem Diameter/mm", f"{FORCE[:-2]} Measured/N", f"{FORCE[:-2]} Simulation Value/N", "Error/%")
    target = next((short(row["diameter"]) for row in stage["rows"] if row["role"] == "calibration"), MISSING)
    note = f"Error = 100·(measured − simulated)/measured; {target} mm served for calibration and checks nothing."
    caption = "Comparison of the measured and simulated maximum shear force."
    return PaperTable(13, "validation", caption, columns, rows, note)


def starred(p: float | None, stars: str) -> str:
    """Return a p-value with its stars; empty where there is none."""
    return f"{probability(p)} {stars}".strip() if p is not None else ""


def _named(study: Study, name: str) -> str:
    factor = study.factor(name)
    label = factor.label or name
    return label if factor.unit == "1" else f"{label} ({factor.unit})"


def _square(value: float | None) -> str:
    """Return a sum of squares with two decimals, more where they are needed to see it."""
    if value is None:
        return ""
    return fixed(value) if abs(value) >= 1.0 or value == 0.0 else significant(value)


def _ratio(value: float | None) -> str:
    if value is None:
        return ""
    return fixed(value) if value >= 1.0 else fixed(value, 4)


def _source(source: str, symbols: Mapping[str, str]) -> str:
    names: Sequence[str] = source.removesuffix("^2").split(":")
    return written(source, symbols) if any(name in symbols for name in names) else source


def is_numeric(cells: Sequence[str]) -> bool:
    """Tell whether most cells of a column that are not empty hold numbers.

    >>> is_numeric(["−2.95", "0.0022 **", ""]), is_numeric(["X1", "X2"]), is_numeric(["90", "80", "failed (nan)"])
    (True, False, True)
    """
    filled = [cell for cell in cells if cell]
    return 2 * sum(_NUMBER.fullmatch(cell) is not None for cell in filled) > len(filled)
