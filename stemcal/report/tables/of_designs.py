"""Tables of designs: the effects of a screening, the analysis of a response surface and its shape, the runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from stemcal.doe.regression.canonical import Shape
from stemcal.doe.regression.fit_statistics import Coefficient
from stemcal.doe.regression.least_squares import stars
from stemcal.files.rows import Column, Table
from stemcal.files.typed import to_json
from stemcal.names import Names
from stemcal.naming import FIRST, FORCE, Named
from stemcal.numbers import fixed, percent, short, significant
from stemcal.report.records import Records, distinct_of
from stemcal.report.tables.columns import (
    condition,
    factor,
    level,
    level_list,
    levels,
    ratio,
    response_decimals,
    simulated,
    squares,
    starred,
    to_decimals,
)
from stemcal.stages.result import DesignRuns
from stemcal.stages.screen import ScreenResult, standing
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.surface.words import shape_name

if TYPE_CHECKING:
    from stemcal.overview.status import Entry

MANY = {"surface": 3, "design": 4}  # factors beyond which columns are headed by symbols in place of names
SHORT_KEY = 8
ONE = "1"  # the term of the constant
LISTED = ("stage", "key", "status", "reason", "run", "condition", FIRST, "wall_seconds")
"""What the terminal shows of a run; its CSV file has more."""


def effects_table(stage: ScreenResult, names: Names, judged: bool = False) -> Table:
    """Return the effects as papers print them, with F test and Lenth's t; a `judged` table has a verdict in words."""
    effects, response, residual, lenth = stage.effects, names.response, stage.residual, stage.lenth
    rows = [{**to_json(e), "p": (e.p, stars(e.p)), "standing": standing(e, stage)} for e in effects]
    empty = dict.fromkeys(("symbol", "standing", "effect", "f", "lenth_t"), "")
    share = 100.0 * residual.sum_of_squares / (stage.total_sum_of_squares or 1.0)
    rows.append({**empty, "factor": "Residual", "contribution_percent": share, **to_json(residual)})
    places = response_decimals(response, [e.effect for e in effects])
    columns = [
        Column("symbol", ""),
        factor(names),
        *([Column("standing", "Verdict")] if judged else []),
        Column("effect", "Effect", response.written, to_decimals(places)),
        Column("contribution_percent", "Share", "%", percent),
        Column("sum_of_squares", "Sum of squares", form=squares),
        Column("f", "F", form=ratio),
        Column("p", "p", form=starred),
        Column("lenth_t", "Lenth t", form=fixed),
    ]
    rule = (
        "Lenth's method chooses the factors: the residual has fewer than 3 degrees of freedom or is zero."
        if stage.by_lenth
        else "The F test chooses the factors: its residual has at least 3 degrees of freedom."
    )
    margins = []
    if lenth.pse is not None and lenth.me is not None and lenth.sme is not None:
        pse, me, sme = (names.quantity(value) for value in (lenth.pse, lenth.me, lenth.sme))
        margins.append(
            f"Lenth: pseudo standard error {pse}; an effect beyond ±{me} is significant, beyond ±{sme} also after "
            "correction for the number of effects."
        )
    shares = "** p < 0.01, * p < 0.05. Share: of the total sum of squares."
    strong = frozenset(i for i, e in enumerate(effects) if e.factor in stage.significant)
    return Table.of(columns, rows, f"Effects on the {response.long}", (rule, *margins, shares), strong=strong)


# ---- response surfaces


def surface_tables(stage: SurfaceResult, names: Names) -> list[Table]:
    """Return all tables of a surface."""
    tables = [anova_table(stage), coefficient_table(stage, names), fit_table(stage)]
    tables += [canonical_table(stage, stage.canonical, names)] if stage.canonical else []
    return tables


def written(term: str, symbols: Mapping[str, str]) -> str:
    """Return a term as it stands in an equation.

    >>> written("yield_stress:failure_strain", {"yield_stress": "X4", "failure_strain": "X9"})
    'X4·X9'
    """
    if term.endswith("^2"):
        name = term.removesuffix("^2")
        return f"{symbols.get(name, name)}²"
    return "·".join(symbols.get(name, name) for name in term.split(":"))


def equation(coefficients: Sequence[Coefficient], symbols: Mapping[str, str], response: Named = FORCE) -> str:
    """Return the surface of a response as an equation in coded units.

    >>> from types import SimpleNamespace as C
    >>> equation([C(term="1", value=120.415), C(term="a^2", value=-0.829)], {"a": "X9"})
    'F = 120.42 − 0.83·X9²'
    """
    text, places = "", response_decimals(response, [row.value for row in coefficients if row.term != ONE])
    for row in coefficients:
        size = fixed(abs(row.value), places) + ("" if row.term == ONE else f"·{written(row.term, symbols)}")
        sign = "−" if row.value < 0.0 else "+"
        text += f" {sign} {size}" if text else f"{'−' if row.value < 0.0 else ''}{size}"
    return f"{response.symbol} = {text}"


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
    foot = () if stage.lack_of_fit_testable else ["Lack of fit cannot be tested."]
    strong = frozenset(i for i, row in enumerate(stage.anova) if row.stars)
    return Table.of(columns, stage.anova, "Analysis of variance", foot, strong=strong, detail=True)


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
    return Table.of(columns, stage.coefficients, "Response surface in coded units", foot, detail=True)


def fit_table(stage: SurfaceResult) -> Table:
    """Return how well the surface fits."""
    response = stage.naming.response
    rows = (
        ("R²", fixed(stage.r2, 4)),
        ("Adjusted R²", fixed(stage.adjusted_r2, 4)),
        ("Predicted R²", fixed(stage.predicted_r2, 4)),
        ("Adequate precision", fixed(stage.adequate_precision, 2)),
        (replace(response, unit=response.squared).headed("PRESS"), significant(stage.press, 6)),
        ("Coefficient of variation, %", fixed(stage.cv_percent, 2)),
    )
    return Table((Column("statistic", "Statistic"), Column("value", "Value", form=str)), rows, "Quality of the fit")


def canonical_table(stage: SurfaceResult, shape: Shape, names: Names) -> Table:
    """Return the surface along its own axes: curvature, and the direction in coded units."""
    axes = enumerate(zip(shape.eigenvalues, shape.axes, strict=True), 1)
    columns = [
        Column("axis", "Axis", form=format),
        Column("curvature", "Curvature", names.response.written, significant),
        *levels(stage.names, _short_names(stage, names), to_decimals(3)),
    ]
    point = "No single stationary point: the surface is a plane, or level along some direction."
    if shape.natural is not None and shape.predicted is not None:
        point = (
            f"Stationary point: {shape_name(shape)}, {names.quantity(shape.predicted)} at "
            f"{level_list(shape.natural, names)}; coded radius {shape.coded_radius:.2f}, "
            f"{'inside' if shape.inside else 'outside'} the region of the runs."
        )
    curved = (
        f"Negative: the {names.response.long} falls on both sides along that axis; the columns give its direction, "
        "coded."
    )
    rows = ({"axis": number, "curvature": value, **axis} for number, (value, axis) in axes)
    return Table.of(columns, rows, "Canonical analysis", (point, curved), detail=True)


def _short_names(stage: SurfaceResult, names: Names) -> Names:
    """Return what heads the column of each factor: where they are many, its symbol."""
    return Names(names.naming, stage.symbols()) if len(stage.names) > MANY["surface"] else names


# ---- runs


def design_table(design: DesignRuns, names: Names, symbols: Mapping[str, str] | None = None, title: str = "") -> Table:
    """Return the runs of a design: the varied levels and the responses, or why there is none."""
    crowded = symbols is not None and len(design.varied) > MANY["design"]
    columns = [
        Column("run", "Run", form=format),
        *levels(design.varied, Names(names.naming, symbols or {}) if crowded else names, level),
        simulated(names.response),
        *map(_other, names.naming.others),
    ]
    foot = ["Symbols as in the table of factors."] if crowded and any((symbols or {}).values()) else []
    return Table.of(columns, design.runs, title, foot, detail=True)


def _other(named: Named) -> Column:
    return Column(named.name, named.capital, named.written, significant, lambda run: run.outcome.of(named.name))


def checks_table(records: Records) -> Table | None:
    """Return the solver's checks of every distinct run, None where no solver told of them."""
    rows = [vars(one.checks) | {"run": run} for run, one in distinct_of(records).values() if one.checks is not None]
    columns = (
        Column("run", "Run"),
        Column("peak_force", "Peak", "N", significant),
        Column("peak_travel", "at", "mm", to_decimals(3)),
        Column("again", "Fell again", "", str, lambda row: "yes" if row["stroke_was_enough"] else "no"),
        Column("elements", "Elements", form=format),
        Column("deleted_elements", "Failed", form=format),
        Column("steps", "Steps", form=format),
        Column("energy_drift_percent", "Drift", "%", to_decimals(3)),
        Column("kinetic_ratio_percent", "Kinetic", "%", fixed),
        Column("hourglass_ratio_percent", "Hourglass", "%", fixed),
    )
    foot = (
        "Failed: elements that had failed at the peak. Drift: largest error of the energy balance. Kinetic, "
        "hourglass: largest share of the internal energy before the peak; small shares mean a quasi-static test."
    )
    return Table.of(columns, rows, "Checks of every run", [foot], detail=True).without_zeros() if rows else None


def runs_table(found: Iterable[Entry], names: Names, factors: Iterable[str] = (), title: str = "") -> Table:
    """Return runs one by one, with all that their CSV file has."""
    columns = [
        Column("stage", "Stage"),
        Column("run", "Run", form=format),
        Column("key", "Key", form=lambda key: key[:SHORT_KEY], words=True),
        Column("status", "Status"),
        Column(FIRST, names.response.capital, names.response.written, significant),
        Column("reason", "Reason"),
        "message",
        *(condition(names.naming) or ["condition"]),
        *factors,
        "tries",
        Column("wall_seconds", "Time", "s", to_decimals(1)),
        *("started", "host", "stemcal"),
    ]
    entries = list(found)
    return Table.of(columns, entries, title, () if entries else ["There are none."])


def listed(runs: Table, names: Names) -> Table:
    """Return what the terminal shows of runs."""
    return runs.only(key for key in LISTED if key != "condition" or names.naming.condition is not None)
