"""The tables of each stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from stemcal.report.tables.closing import audit_sheet, climb_sheet, further_sheets, refine_sheet, share_of
from stemcal.report.tables.equation import equation, written
from stemcal.report.tables.mesh import budget_sheet, mesh_sheet
from stemcal.report.tables.sheet import Sheet, place_cell, place_head, response_decimals, response_or_reason, starred
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.result import StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import ValidateResult
from stemcal.text.calibration import range_to_cite, valid_for
from stemcal.text.names import Names
from stemcal.text.numbers import alike, fixed, interval, percent, probability, short, significant


def sheets_of(stage: StageResult) -> list[Sheet]:
    """Return the tables of a stage."""
    sheets = [make(stage) for make in _SHEETS[stage.name]]
    return [*sheets, *_of_others(stage), *further_sheets(stage)]


def _of_others(stage: StageResult) -> list[Sheet]:
    """Return the tables of the further responses that a study itself has named: effects, analyses of variance."""
    if isinstance(stage, ScreenResult):
        return [screening_sheet(one) for one in stage.of_each[1:]]
    if not isinstance(stage, SurfaceResult):
        return []
    own = {response.name for response in stage.naming.others}
    fitted = [(part.condition, name) for part in stage.conditions for name in part.responses or {} if name in own]
    seen = [(place, stage.seen_by(name, place)) for place, name in fitted]
    made = [(place, one, make(one)) for place, one in seen for make in _SHEETS["rsm"]]
    return [
        replace(sheet, title=f"{sheet.title}: {one.naming.response.noun}{one.naming.at(place)}")
        for place, one, sheet in made
    ]


def screening_sheet(stage: ScreenResult) -> Sheet:
    """Return the effects as papers print them, with Lenth's t and the p-value adjusted by Holm."""
    effects, response = stage.effects, stage.naming.response
    places = response_decimals(response, [e.effect for e in effects])
    residual = stage.residual
    squares = alike([residual.sum_of_squares, *(e.sum_of_squares for e in effects)])
    rows = [
        (
            e.symbol,
            e.factor,
            fixed(e.effect, places),
            percent(e.contribution_percent),
            squares(e.sum_of_squares),
            fixed(e.f, 4) if e.f is not None and e.f < 0.01 else significant(e.f),
            starred(e.p, e.stars),
            probability(e.p_holm),
            fixed(e.lenth_t),
        )
        for e in effects
    ]
    share = 100.0 * residual.sum_of_squares / (stage.total_sum_of_squares or 1.0)
    rows.append(("", "Residual", "", percent(share), squares(residual.sum_of_squares), "", "", "", ""))
    return Sheet(
        f"Effects on the {response.long}",
        (
            "",
            "Factor",
            response.headed("Effect", ",\n"),
            "Share,\n%",
            "Sum of\nsquares",
            "F",
            "p",
            "p\nHolm",
            "Lenth\nt",
        ),
        tuple(rows),
        texts=2,
        foot=(*_lenth_foot(stage), "** p < 0.01, * p < 0.05. Share: of the total sum of squares."),
        strong=frozenset(i for i, e in enumerate(effects) if e.factor in stage.significant),
    )


def _lenth_foot(stage: ScreenResult) -> list[str]:
    lenth, unit = stage.lenth, stage.naming.response.beside
    if lenth is None or lenth.pse is None:
        return []
    return [
        f"Lenth: pseudo standard error {significant(lenth.pse)}{unit}; an effect beyond "
        f"±{significant(lenth.me)}{unit} is active, "
        f"beyond ±{significant(lenth.sme)}{unit} even among all factors."
    ]


def anova_sheet(stage: SurfaceResult) -> Sheet:
    """Return the analysis of variance."""
    symbols = stage.symbols()
    squares, means = (
        alike(values) for values in zip(*((r.sum_of_squares, r.mean_square) for r in stage.anova), strict=True)
    )
    rows = [
        (
            _source(row.source, symbols),
            squares(row.sum_of_squares),
            str(row.df),
            means(row.mean_square),
            significant(row.f) if row.f is not None else "",
            starred(row.p, row.stars),
        )
        for row in stage.anova
    ]
    return Sheet(
        "Analysis of variance" + (", type I sums of squares" if stage.sums_of_squares == "sequential" else ""),
        ("Source", "Sum of squares", "df", "Mean square", "F", "p"),
        tuple(rows),
        foot=() if stage.lack_of_fit_testable else ("Lack of fit cannot be tested.",),
        strong=frozenset(i for i, row in enumerate(stage.anova) if row.stars),
        detail=True,
    )


def _source(source: str, symbols: Mapping[str, str]) -> str:
    known = any(name in symbols for name in source.removesuffix("^2").split(":"))
    return written(source, symbols) if known else source


def coefficient_sheet(stage: SurfaceResult) -> Sheet:
    """Return the coefficients with their intervals, the equation below."""
    symbols = stage.symbols()
    places = response_decimals(stage.naming.response, [row.value for row in stage.coefficients[1:]], 3)
    rows = [
        (
            _source(row.term, symbols),
            fixed(row.value, places),
            fixed(row.standard_error, places),
            fixed(row.low, places),
            fixed(row.high, places),
        )
        for row in stage.coefficients
    ]
    coded = (
        f"{entry.symbol or entry.factor} = ({entry.factor} − {short(entry.center)}) / {short(entry.half_step)}"
        for entry in stage.factors
    )
    return Sheet(
        "Response surface in coded units",
        ("Term", stage.naming.response.headed("Coefficient"), "Std. error", "95 % low", "95 % high"),
        tuple(rows),
        foot=(equation(stage.coefficients, symbols, stage.naming.response), "; ".join(coded)),
        detail=True,
    )


def fit_sheet(stage: SurfaceResult) -> Sheet:
    """Return how well the surface fits."""
    squared = replace(stage.naming.response, unit=stage.naming.response.squared)
    rows = (
        ("R²", fixed(stage.r2, 4)),
        ("Adjusted R²", fixed(stage.adjusted_r2, 4)),
        ("Predicted R²", fixed(stage.predicted_r2, 4)),
        ("Adequate precision", fixed(stage.adequate_precision, 2)),
        (squared.headed("PRESS"), significant(stage.press, 6)),
        ("Coefficient of variation, %", fixed(stage.cv_percent, 2)),
    )
    return Sheet("Quality of the fit", ("Statistic", "Value"), rows)


def calibration_sheet(stage: InvertResult) -> Sheet:
    """Return the calibrated parameters with the range of each that is to be cited, and what else was found."""
    published = {} if stage.published is None else stage.published.point.solution
    (head, ranges), point, rows = cited_ranges(stage), stage.point, []
    for name, value in point.solution.items():
        row = (name, significant(value), ranges[name], *_share(stage, name), fixed(point.coded[name], 3))
        rows.append((*row, short(published.get(name))) if published else row)
    share = ("of its\nrange",) if stage.certainty is not None else ()
    columns = ("Factor", "Calibrated", head, *share, "Coded", *(("Published",) if published else ()))
    noun, unit = stage.naming.response.noun, stage.naming.response.beside
    intervals = (
        f"95 % interval of the mean {noun} {interval(point.mean_interval)}{unit}, of one simulated {noun} "
        f"{interval(point.prediction_interval)}{unit}."
    )
    other = range_to_cite(stage, Names(stage.naming))
    foot = (
        f"Target {short(stage.target)}{unit}; predicted {significant(point.predicted)}{unit}; coded radius "
        f"{fixed(point.coded_radius, 3)}; rule {stage.rule}.",
        intervals,
        *valid_for(stage),
        *other,
    )
    return Sheet("Calibrated parameters", columns, tuple(rows), foot=foot, claiming=(head, *share, intervals, *other))


def joint_sheets(stage: InvertResult) -> list[Sheet]:
    """Return the tables of a joint fit: each diameter, what it leaves of each parameter; none of a single response."""
    return further_sheets(stage) if stage.joint is not None else []


def cited_ranges(stage: InvertResult) -> tuple[str, dict[str, str]]:
    """Return the range of each parameter to cite, as it is written, and what it is called."""
    if stage.certainty is None:
        return "Exact solutions", {name: interval(stage.ranges.get(name)) for name in stage.point.solution}
    known = stage.certainty.intervals
    return "95 % range", {name: interval(known.get(name)) for name in stage.point.solution}


def _share(stage: InvertResult, name: str) -> list[str]:
    """Return how much of a factor's range the 95 % range takes."""
    return [] if stage.certainty is None else [share_of(stage.certainty, name)]


def validation_sheet(stage: ValidateResult) -> Sheet:
    """Return measured against simulated force over the diameters."""
    naming, response = stage.naming, stage.naming.response
    meshed = any(row.mesh_interval is not None for row in stage.rows)
    rows = [
        (
            *place_cell(naming, row.compared.condition),
            row.compared.role,
            short(row.compared.measured),
            response_or_reason(row.compared.simulated, row.reason or "failed"),
            fixed(row.compared.error_percent),
            *([interval(row.mesh_interval)] if meshed else []),
        )
        for row in stage.rows
    ]
    largest = (
        f"Largest error {fixed(stage.max_abs_error_percent)} %, mean "
        f"{fixed(stage.mean_abs_error_percent)} % (absolute)."
    )
    foot = (*([largest] if naming.condition is not None else []), "Error = 100·(measured − simulated)/measured.")
    between = ",\n" if meshed else ", "
    place = place_head(naming, between)
    measured, simulated = response.headed("Measured", between), response.headed("Simulated", between)
    over_meshes = (response.headed("95 % over\nmeshes"),) if meshed else ()
    columns = (*place, "Role", measured, simulated, f"Error{between}%", *over_meshes)
    title = f"Measured against simulated {response.noun}"
    return Sheet(title, columns, tuple(rows), texts=len(place) + 1, foot=foot, claiming=over_meshes)


_SHEETS: dict[str, tuple[Callable[[Any], Sheet], ...]] = {
    "screen": (screening_sheet,),
    "climb": (climb_sheet,),
    "rsm": (anova_sheet, coefficient_sheet, fit_sheet),
    "invert": (calibration_sheet,),
    "refine": (refine_sheet,),
    "mesh": (mesh_sheet, budget_sheet),
    "validate": (validation_sheet,),
    "audit": (audit_sheet,),
}
