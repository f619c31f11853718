"""Tables of a response surface: analysis of variance, coefficients, quality of the fit, its shape."""

from __future__ import annotations

from dataclasses import replace

from stemcal.files.rows import Column, Table
from stemcal.report.tables.columns import factor, level_list, ratio, response_decimals, squares, starred, to_decimals
from stemcal.report.terms import equation, written
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.surface.shape import Shape
from stemcal.text.names import Names
from stemcal.text.numbers import fixed, short, significant, unit_written
from stemcal.text.tables import line

CROWDED = 3  # factors beyond which the columns of a surface are headed by symbols


def surface_tables(stage: SurfaceResult, names: Names) -> list[Table]:
    """Return all tables of a surface."""
    tables = [anova_table(stage), coefficient_table(stage, names), fit_table(stage)]
    tables += [canonical_table(stage, stage.canonical, names)] if stage.canonical else []
    tables += [sobol_table(stage, names)] if stage.sobol else []
    return [*tables, *([ridge_table(stage, names)] if stage.ridge else [])]


def anova_table(stage: SurfaceResult) -> Table:
    """Return the analysis of variance."""
    symbols = stage.symbols()
    columns = [
        Column("source", "Source", of=lambda row: written(row.source, symbols)),
        Column("sum_of_squares", "Sum of squares", form=squares),
        Column("df", "df", form=format),
        Column("mean_square", "Mean square", form=squares),
        Column("f", "F", form=ratio),
        Column("p", "p", form=starred, of=lambda row: (row.p, row.stars)),
    ]
    strong = frozenset(i for i, row in enumerate(stage.anova) if row.stars)
    title = line("sequential anova" if stage.sums_of_squares == "sequential" else "anova")
    foot = () if stage.lack_of_fit_testable else (line("untestable"),)
    return Table.of(columns, stage.anova, title, foot, strong=strong, detail=True)


def coefficient_table(stage: SurfaceResult, names: Names) -> Table:
    """Return the coefficients with their intervals, the equation below."""
    symbols, response = stage.symbols(), names.response
    form = to_decimals(response_decimals(response, [row.value for row in stage.coefficients[1:]], 3))
    columns = [
        Column("term", "Term", of=lambda row: written(row.term, symbols)),
        Column("value", "Coefficient", response.written, form),
        Column("standard_error", "Std. error", form=form),
        Column("low", "95 % low", form=form),
        Column("high", "95 % high", form=form),
    ]
    coded = (
        f"{entry.symbol or entry.factor} = ({entry.factor} − {short(entry.center)}) / {short(entry.half_step)}"
        for entry in stage.factors
    )
    foot = equation(stage.coefficients, symbols, response), "; ".join(coded)
    return Table.of(columns, stage.coefficients, line("coefficients"), foot, detail=True)


def fit_table(stage: SurfaceResult) -> Table:
    """Return how well the surface fits."""
    response = stage.naming.response
    rows = [
        ("R²", fixed(stage.r2, 4)),
        ("Adjusted R²", fixed(stage.adjusted_r2, 4)),
        ("Predicted R²", fixed(stage.predicted_r2, 4)),
        ("Adequate precision", fixed(stage.adequate_precision, 2)),
        (replace(response, unit=response.squared).headed("PRESS"), significant(stage.press, 6)),
        ("Coefficient of variation, %", fixed(stage.cv_percent, 2)),
    ]
    columns = Column("statistic", "Statistic"), Column("value", "Value", form=fixed)
    return Table(columns, tuple(rows), line("fit"))


def canonical_table(stage: SurfaceResult, canonical: Shape, names: Names) -> Table:
    """Return the surface along its own axes: curvature, and the direction in coded units."""
    rows = [
        {"axis": number, "curvature": value, **axis}
        for number, (value, axis) in enumerate(zip(canonical.eigenvalues, canonical.axes, strict=True), 1)
    ]
    columns = [
        Column("axis", "Axis", form=format),
        Column("curvature", "Curvature", names.response.written, significant),
        *(Column(name, head, form=to_decimals(3)) for name, head in _heads(stage, names).items()),
    ]
    return Table.of(columns, rows, line("canonical"), (_point(canonical, names), line("curvature", names)), detail=True)


def _point(shape: Shape, names: Names) -> str:
    """Say where the surface is stationary."""
    if shape.natural is None:
        return line("no stationary point")
    return line(
        "inside" if shape.inside else "outside",
        names,
        kind=shape.kind,
        value=shape.predicted,
        levels=level_list(shape.natural, names),
        radius=shape.coded_radius,
    )


def sobol_table(stage: SurfaceResult, names: Names) -> Table:
    """Return which share of the surface's variation over the factors' ranges each factor has."""
    columns = [
        factor(names),
        Column("first", "By itself", "%", to_decimals(1), lambda row: 100.0 * row.first),
        Column("total", "Total", "%", to_decimals(1), lambda row: 100.0 * row.total),
    ]
    return Table.of(columns, stage.sobol, line("sobol", names), [line("uniform")], detail=True)


def ridge_table(stage: SurfaceResult, names: Names) -> Table:
    """Return the way along which the surface climbs most."""
    rows, response = stage.ridge or (), names.response
    levels = [{name: stage.coding[name].natural(row.coded[name]) for name in stage.names} for row in rows]
    places = response_decimals(response, [row.standard_error for row in rows])
    columns = [
        Column("radius", "Coded radius", form=fixed),
        *(
            Column(name, head, unit_written(stage.factor(name).unit or "1"), significant)
            for name, head in _heads(stage, names).items()
        ),
        Column("predicted", "Largest", response.written, significant),
        Column("standard_error", "Std. error", response.written, to_decimals(places)),
    ]
    return Table.of(
        columns,
        [vars(row) | level for row, level in zip(rows, levels, strict=True)],
        line("ridge"),
        detail=True,
    )


def _heads(stage: SurfaceResult, names: Names) -> dict[str, str]:
    """Return what heads the column of each factor: where they are many, its symbol."""
    symbols = stage.symbols() if len(stage.names) > CROWDED else {}
    return {name: symbols.get(name) or names.factor(name) for name in stage.names}
