"""Tables beyond those of the stages: verdicts in words, the shape of the surface, the checks of every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from stemcal.naming import CUTTING, Named, Naming
from stemcal.report.records import Records, distinct_of
from stemcal.report.tables.sheet import Sheet, response_decimals, response_or_reason
from stemcal.stages.result import DesignRuns, StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.surface.shape import Shape
from stemcal.text.numbers import fixed, short, significant
from stemcal.text.screening import standing
from stemcal.text.surface import shape_name

WIDE = 3  # factors from which a table on the terminal does
MANY = 4  # factors from which a table's columns bear symbols in place of names


def page_sheets(stage: StageResult) -> list[Sheet]:
    """Return a stage's tables for the page, beyond those that the terminal shows."""
    return [replace(sheet, detail=True) for sheet in shape_sheets(stage)]


def shape_sheets(stage: StageResult) -> list[Sheet]:
    """Return the tables of a surface's shape; none of other stages."""
    if not isinstance(stage, SurfaceResult):
        return []
    sheets = [canonical_sheet(stage, stage.canonical)] if stage.canonical else []
    sheets += [sobol_sheet(stage)] if stage.sobol else []
    return [*sheets, *([ridge_sheet(stage)] if stage.ridge else [])]


def judged(sheet: Sheet, stage: ScreenResult) -> Sheet:
    """Return the table of effects with a column that says in words what each of them means."""
    told = [standing(effect) for effect in stage.effects]
    if not any(told):
        return sheet
    told += [""] * (len(sheet.rows) - len(told))
    rows = tuple((*row[:2], words, *row[2:]) for row, words in zip(sheet.rows, told, strict=True))
    return replace(sheet, columns=(*sheet.columns[:2], "Verdict", *sheet.columns[2:]), rows=rows, texts=3)


def canonical_sheet(stage: SurfaceResult, canonical: Shape) -> Sheet:
    """Return the surface along its own axes: curvature, and the direction in coded units."""
    names, response = stage.names, stage.naming.response
    rows = tuple(
        (str(number), significant(value), *(fixed(axis[name], 3) for name in names))
        for number, (value, axis) in enumerate(zip(canonical.eigenvalues, canonical.axes, strict=True), 1)
    )
    foot = (
        _stationary_point(canonical, names, response),
        f"Negative: the {response.noun} falls on both sides along that axis; the columns give its direction, coded.",
    )
    return Sheet("Canonical analysis", ("Axis", response.headed("Curva-\nture"), *_heads(stage)), rows, foot=foot)


def sobol_sheet(stage: SurfaceResult) -> Sheet:
    """Return which share of the surface's variation over the factors' ranges each factor has."""
    rows = tuple((row.factor, fixed(100.0 * row.first, 1), fixed(100.0 * row.total, 1)) for row in stage.sobol)
    foot = ("Sobol' indices of the fitted surface, factors uniform over their ranges; total: with all interactions.",)
    title = f"Share of {stage.naming.response.its('variation')}"
    return Sheet(title, ("Factor", "By itself, %", "Total, %"), rows, foot=foot)


def _stationary_point(canonical: Shape, names: Sequence[str], response: Named) -> str:
    natural = canonical.natural
    if natural is None:
        return "No single stationary point: the surface is a plane, or level along some direction."
    place = ", ".join(f"{name} {significant(natural[name])}" for name in names)
    where = "inside" if canonical.inside else "outside"
    value = f"{significant(canonical.predicted)}{response.beside}"
    return (
        f"Stationary point: a {shape_name(canonical)} of {value} at {place}; "
        f"coded radius {fixed(canonical.coded_radius)}, {where} the region of the runs."
    )


def ridge_sheet(stage: SurfaceResult) -> Sheet:
    """Return the way along which the surface climbs most."""
    names, coding, response = stage.names, stage.coding, stage.naming.response
    places = response_decimals(response, [row.standard_error for row in stage.ridge or ()])
    rows = tuple(
        (
            fixed(row.radius),
            *(significant(coding[n].natural(row.coded[n])) for n in names),
            significant(row.predicted),
            fixed(row.standard_error, places),
        )
        for row in stage.ridge or ()
    )
    told = response.headed(f"Largest\n{response.noun}"), response.headed("Std.\nerror")
    columns = ("Coded\nradius", *_heads(stage, with_units=True), *told)
    return Sheet("Ridge of steepest ascent", columns, rows, texts=0)


def _heads(stage: SurfaceResult, with_units: bool = False) -> list[str]:
    """Return a column's head per factor of a surface: its name, where they are many its symbol, the unit below."""
    crowded = len(stage.names) > WIDE
    heads = []
    for name in stage.names:
        entry = stage.factor(name)
        head = entry.symbol or name if crowded else name
        unit = entry.unit or "1"
        heads.append(head if unit == "1" or not with_units else f"{head},\n{unit}")
    return heads


def design_sheet(title: str, design: DesignRuns, symbols: Mapping[str, str], naming: Naming = CUTTING) -> Sheet:
    """Return the runs of a design: the varied levels and the responses, or why there is none."""
    runs, varied = design.runs, design.varied
    crowded = len(varied) > MANY
    names = [symbols.get(name) or name if crowded else name for name in varied]
    rows = tuple(
        (
            str(run.run),
            *(short(run.levels[name]) for name in varied),
            response_or_reason(run.response, run.outcome.reason or "–"),
            *(significant(run.outcome.of(response.name)) for response in naming.others),
        )
        for run in runs
    )
    foot = ("Symbols as in the table of factors.",) if crowded and any(symbols.values()) else ()
    return Sheet(
        title,
        ("Run", *names, naming.response.heading(), *(response.heading() for response in naming.others)),
        rows,
        texts=0,
        foot=foot,
    )


def checks_sheet(records: Records) -> Sheet | None:
    """Return the solver's checks of every distinct run, None where no solver told of them."""
    told = [(label, record.checks) for label, record in distinct_of(records).values() if record.checks]
    if not told:
        return None
    rows = tuple(
        (
            label,
            significant(d.peak_force),
            fixed(d.peak_travel, 3),
            "yes" if d.stroke_was_enough else "no",
            str(d.elements),
            str(d.deleted_elements),
            str(d.steps),
            fixed(d.energy_drift_percent, 3),
            fixed(d.kinetic_ratio_percent, 2),
            fixed(d.hourglass_ratio_percent, 2),
        )
        for label, d in told
    )
    foot = (
        "Failed: elements that had failed at the peak. Drift: largest error of the energy balance. Kinetic, hourglass: "
        "largest share of the internal energy on the way to the peak; small shares mean a quasi-static test.",
    )
    columns = ("Run", "Peak,\nN", "at,\nmm", "Fell\nagain", "Elements", "Failed", "Steps", "Drift,\n%",
               "Kinetic,\n%", "Hourglass,\n%")  # fmt: skip
    return Sheet("Checks of every run", columns, rows, foot=foot)
