"""The tables of a study as papers print them: Tables 5 to 13 of the wild chrysanthemum study, for one's own."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from stemcal.files.rows import Column, Table
from stemcal.files.showing import in_a_line
from stemcal.names import Names
from stemcal.naming import FIRST, FORCE, Named, capital
from stemcal.numbers import probability, short, significant, unit_written
from stemcal.report.tables.columns import ERROR, condition, level, simulated, starred, to_decimals
from stemcal.report.tables.of_designs import anova_table, design_table, effects_table, equation
from stemcal.report.tables.of_responses import errors_in_short, runs
from stemcal.report.tables.stages import calibration_table, cited_ranges, climb_table, visible
from stemcal.stages.invert.words import assumptions, valid_for
from stemcal.stages.results import Results
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate.result import ValidateResult, ValidateRow
from stemcal.study.model import Factor, Study
from stemcal.words import series

NUMBERS = {"factors": 5, "screening-runs": 6, "screening": 7, "levels": 8, "surface-runs": 9, "anova": 10,
           "calibration": 11, "parameters": 12, "validation": 13}  # fmt: skip
"""The numbers that tables have in the published study."""
_CAPTIONS = {
    "screening-runs": "Design scheme and results of the screening test.",
    "screening": "Significance analysis of the screening test parameters.",
    "ascent": "Scheme and results of the steepest ascent test.",
    "surface-runs": "Test results and scheme of the response surface design.",
    "anova": "ANOVA of the response surface.",
    "calibration": "Parameter calibration values.",
    "refinement": "Iterations of simulation and refitted surface.",
}
_ERRORS = "Error = 100·(measured − simulated)/measured"
_SMALL = ("a", "an", "and", "at", "for", "in", "of", "on", "per", "the", "to")  # words that titles leave small


@dataclass(frozen=True)
class PaperTable:
    """A table to publish: its number in the published study or 0, a name for files, caption, cells, note below."""

    number: int
    name: str
    caption: str
    table: Table
    note: str = ""

    @property
    def heads(self) -> tuple[str, ...]:
        """The headings, each over the unit that its numbers are divided by."""
        return tuple(in_a_line(over_unit(column.name, column.unit)) for column in self.table.columns)

    @property
    def cells(self) -> tuple[tuple[str, ...], ...]:
        """The texts of the cells, one line each."""
        return tuple(tuple(in_a_line(cell).rstrip() for cell in row) for row in self.table.cells)


def paper_tables(study: Study, results: Results, holds: bool = True) -> list[PaperTable]:
    """Return the tables that the finished stages allow, in the order of the paper.

    Where the study's verdict is that nothing is calibrated, `holds` is false and ranges are left out.
    """
    screen, surface, inversion = results.screen, results.surface, results.inversion
    labels, symbols = _names(study)
    tables = [_factors(study, labels)]
    stars = "** represents extremely significant effect (p < 0.01), * represents significant effect (p < 0.05)."
    if screen is not None:
        # who publishes effects leaves the residual out
        effects = effects_table(screen, labels)
        heads = {"symbol": "Parameters", "effect": "Effect", "contribution_percent": "Contribution"}
        heads |= {"sum_of_squares": "", "f": "F-Value", "p": "p-Value"}
        tables.append(_printed("screening-runs", design_table(screen.design, symbols), _runs(study, "run")))
        tables.append(_printed("screening", replace(effects, rows=effects.rows[:-1]), heads, stars))
    if results.climb is not None:
        measured = f"measured {labels.quantity(results.climb.target, '.6g')}"
        note = f"Relative error = 100·(measured − simulated)/measured, {measured}."
        heads = _runs(study, "step") | {"error_percent": "Relative Error"}
        tables.append(_printed("ascent", climb_table(results.climb, symbols), heads, note))
    if surface is not None:
        note = f"{equation(surface.coefficients, surface.symbols(), study.naming.response)} (coded values)."
        heads = {"source": "", "sum_of_squares": "", "df": "df", "mean_square": "", "f": "F-Value", "p": "p-Value"}
        tables.append(_levels(surface))
        tables.append(_printed("surface-runs", design_table(surface.design, symbols), _runs(study, "run")))
        tables.append(_printed("anova", anova_table(surface), heads, f"{stars} {note}"))
    if inversion is not None:
        heads = {"factor": "Parameter", "solution": "Numerical Calibration", "range": ""}
        found = visible([calibration_table(inversion, labels, results.parameters)], holds)
        beside = [*valid_for(inversion), *(assumptions(inversion) if holds else ())]
        tables += [_printed("calibration", table, heads, " ".join(beside)) for table in found]
        calibrated = {name: results.parameters[name] for name in inversion.point.solution}
        tables.append(_parameters(study, labels, calibrated, cited_ranges(inversion) if holds else None))
    if results.refinement is not None:
        heads = {**_runs(study, "run"), "predicted": "Predicted Value"}
        then = "Predicted by the surface before the run."
        tables.append(_printed("refinement", runs(results.refinement, symbols), heads, then))
    if results.validation is not None:
        tables.append(_validation(results.validation))
    return tables


def numbered(tables: Sequence[PaperTable], as_published: bool = False) -> list[PaperTable]:
    """Return tables numbered from 1, or from 5 as in the published study; with its numbers where it has all of them."""
    if as_published and all(table.number for table in tables):
        return list(tables)
    first = tables[0].number if as_published else 1
    return [replace(table, number=number) for number, table in enumerate(tables, first)]


def stars_apart(paper: PaperTable) -> PaperTable:
    """Return a table with the stars of its p-values in cells of their own."""
    columns, rows = paper.table.columns, paper.table.rows
    at = next((place for place, column in enumerate(columns) if column.form is starred), None)
    if at is None:
        return paper
    p = replace(columns[at], form=lambda value: "" if value is None else probability(value))
    apart = (*columns[:at], p, Column("stars", "Significance"), *columns[at + 1 :])
    parted = tuple((*row[:at], *row[at], *row[at + 1 :]) for row in rows)
    return replace(paper, table=replace(paper.table, columns=apart, rows=parted))


def _names(study: Study) -> tuple[Names, Names]:
    """Return the factors' names as published: by label and unit, and by symbol."""
    units = {one.name: unit_written(one.unit) for one in study.factors}
    labels = {one.name: f"{one.label or one.name} ({units[one.name]})" for one in study.factors if units[one.name]}
    plain = {one.name: one.label for one in study.factors}
    return Names(study.naming, plain | labels), Names(study.naming, {one.name: one.symbol for one in study.factors})


def _printed(name: str, table: Table, heads: Mapping[str, str], note: str = "") -> PaperTable:
    """Return a table with the columns that `heads` knows, where it has them; an empty head keeps the column's label."""
    keys = [column.key for column in table.columns]
    picked = table.only(key for key in keys if key in heads)
    columns = tuple(
        replace(
            column,
            label=heads[column.key] or _titled(column.name),
            unit="" if column.key == "effect" else column.unit,
            form=to_decimals(1) if column.label == ERROR.label else column.form,
        )
        for column in picked.columns
    )
    return PaperTable(NUMBERS.get(name, 0), name, _CAPTIONS[name], replace(picked, columns=columns), note)


def _runs(study: Study, number: str) -> dict[str, str]:
    """Return the heads of the columns that tell of runs: number, condition, levels, responses."""
    naming = study.naming
    place = {} if naming.condition is None else {"condition": _titled(naming.condition.label)}
    responses = {FIRST: _label(naming.response), **{other.name: _titled(other.label) for other in naming.others}}
    return {number: "No.", **place, **dict.fromkeys(study.names, ""), **responses}


def _factors(study: Study, names: Names) -> PaperTable:
    """Return the screened factors with their levels."""
    columns = [
        Column("symbol", "Symbol"),
        Column("name", "Parameters", form=names.factor, words=True),
        Column("low", "Low Level", form=short),
        Column("high", "High Level", form=short),
    ]
    table = Table.of(columns, study.factors)
    return PaperTable(NUMBERS["factors"], "factors", "Screening test parameters.", table)


def _levels(stage: SurfaceResult) -> PaperTable:
    """Return what the coded levels of the response surface mean."""
    coded = sorted({round(run.coded[name], 3) + 0.0 for run in stage.design.runs for name in stage.names})
    rows = [{name: stage.coding[name].natural(one) for name in stage.names} | {"": one} for one in coded[::-1]]
    heads = {"": "Factor Level", **stage.symbols()}
    columns = [Column(key, head, form=level) for key, head in heads.items()]
    return PaperTable(
        NUMBERS["levels"], "levels", "Factor coding of the response surface design.", Table.of(columns, rows)
    )


def _parameters(
    study: Study, names: Names, found: Mapping[str, float], cited: tuple[str, Mapping[str, str]] | None
) -> PaperTable:
    """Return all parameters of the validation's simulations: those `found` with their range, the others marked."""
    levels, (head, ranges) = {**study.midlevels(), **found}, cited or ("Source", {})

    def known(factor: Factor) -> str:
        if factor.name not in found:
            return "fixed"
        return ranges.get(factor.name, "calibrated")

    columns = [
        Column("symbol", "Symbol"),
        Column("name", "Parameters", form=names.factor, words=True),
        Column("value", "Value", form=significant, of=lambda factor: levels[factor.name]),
        Column("known", _titled(head), of=known),
    ]
    fixed = any(factor.name not in found for factor in study.factors)
    note = "fixed: held at the middle of its range, not calibrated." if fixed else ""
    of = (
        "Finite element simulation parameters of the stem."
        if study.naming.is_cutting
        else "Parameters of the simulation."
    )
    return PaperTable(NUMBERS["parameters"], "parameters", of, Table.of(columns, study.factors), note)


def _validation(stage: ValidateResult) -> PaperTable:
    """Return measured against simulated responses; dashes where nothing was measured."""
    naming = stage.naming
    columns = [replace(one, label=_titled(naming.condition.label)) for one in condition(naming) if naming.condition]
    for named in (naming.response, *naming.others):
        label, of = _label(named), _field_of(named, naming.response)
        columns += [
            Column("measured", f"{label} Measured", named.written, short, of("measured")),
            Column("simulated", f"{label} Simulation Value", named.written, significant, of("simulated")),
            replace(ERROR, form=to_decimals(1), of=of("error_percent")),
        ]
    first = next(i for i, column in enumerate(columns) if column.key == "simulated")
    columns[first] = simulated(naming.response, columns[first].name, "simulated")
    others = [one.long for one in (naming.response, *naming.others)]
    responses = ["maximum shear force"] if naming.response == FORCE else others
    at = [row.condition for row in stage.compared if row.role == "fitted"]
    served = Names(naming).conditions(at) if at and naming.condition is not None else f"the {naming.response.long}"
    checks = "check" if len(at) > 1 and naming.condition is not None else "checks"
    note = f"{_ERRORS}; {served} served for calibration and {checks} nothing."
    if stage.worst_held_out_percent is not None:
        note = f"{errors_in_short(stage, Names(naming))} {note}"
    caption = f"Comparison of the measured and simulated {series(responses)}."
    return PaperTable(NUMBERS["validation"], "validation", caption, Table.of(columns, stage.rows), note)


def _field_of(named: Named, first: Named) -> Callable[[str], Callable[[ValidateRow], Any]]:
    """Return what reads a field of the comparison of a response."""

    def compared(row: ValidateRow) -> object:
        found = row.compared if named == first else None
        return found or next((one for one in row.further if one.response == named.name), None)

    def value(key: str, row: ValidateRow) -> Any:
        found: Any = compared(row)
        told = getattr(found, key, None)
        return named.counted(told, found.measured) if told is not None and key in ("measured", "simulated") else told

    return lambda key: partial(value, key)


def over_unit(word: str, unit: str) -> str:
    """Return a heading over the unit that its numbers are divided by.

    >>> over_unit("Maximum Shear Force", "N"), over_unit("Bulk Density at Rest", "kg/m³"), over_unit("No.", "")
    ('Maximum Shear Force/N', 'Bulk Density at Rest/(kg/m³)', 'No.')
    """
    return f"{word}/({unit})" if "/" in unit else f"{word}/{unit}" if unit else word


def _label(response: Named) -> str:
    """Return a response's label as the head of a column; the published study calls its own so."""
    return "Maximum Shear Force" if response == FORCE else _titled(response.label)


def _titled(label: str) -> str:
    """Return a label with capital letters, as titles have them; words that have any keep theirs."""
    return " ".join(word if word in _SMALL else capital(word) for word in label.split(" "))
