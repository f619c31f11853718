"""The tables of a study as papers print them: Tables 5 to 13 of the wild chrysanthemum study, for one's own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from stemcal.naming import FORCE, Named, Naming
from stemcal.report.tables.equation import equation, written
from stemcal.report.tables.sheet import place_cell, response_decimals, response_or_reason
from stemcal.stages.climb import ClimbResult
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.refine.result import RefineResult
from stemcal.stages.result import DesignRuns
from stemcal.stages.results import Results
from stemcal.stages.screen import ScreenResult
from stemcal.stages.surface.result import SurfaceResult
from stemcal.stages.validate import FurtherRow, ValidateResult
from stemcal.text.numbers import MISSING, fixed, percent, probability, short, significant, unit_written
from stemcal.words import joined

if TYPE_CHECKING:
    from stemcal.study.model import Study

P_VALUE = "p-Value"
_SMALL = ("a", "an", "and", "at", "for", "in", "of", "on", "per", "the", "to")  # words that titles leave small
_NUMBER = re.compile(r"[<−-]?\d[\d.,]*( \*\*?)?")
STARS = "** represents extremely significant effect (p < 0.01), * represents significant effect (p < 0.05)."


@dataclass(frozen=True)
class PaperTable:
    """A table to publish: its number in the published study or 0, a name for files, caption, cells, note below."""

    number: int
    name: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


def paper_tables(study: Study, results: Results) -> list[PaperTable]:
    """Return the tables that the finished stages allow, in the order of the paper."""
    tables = [factor_table(study)]
    if results.screen is not None:
        tables += [run_table(6, results.screen.design, study), screening_table(results.screen)]
    if results.climb is not None:
        tables.append(ascent_table(study, results.climb))
    if results.surface is not None:
        surface = results.surface
        tables += [level_table(surface), run_table(9, surface.design, study), anova_table(surface)]
    if results.inversion is not None:
        tables += [calibration_table(study, results.inversion), parameter_table(study, results.inversion)]
    if results.refinement is not None:
        tables.append(refine_table(study, results.refinement))
    if results.validation is not None:
        tables.append(validation_table(results.validation))
    return tables


def numbered(tables: Sequence[PaperTable], first: int | None = None) -> list[PaperTable]:
    """Return tables counted through from `first`; as in the published study if none is given and it has all of them."""
    if first is None and all(table.number for table in tables):
        return list(tables)
    return [replace(table, number=number) for number, table in enumerate(tables, first or tables[0].number)]


def stars_apart(table: PaperTable) -> PaperTable:
    """Return a table with the stars of its p-values in cells of their own.

    >>> stars_apart(PaperTable(7, "a", "", ("X", "p-Value"), (("X1", "0.0022 **"), ("X2", "0.4"), ("Sum", "")))).rows
    (('X1', '0.0022', '**'), ('X2', '0.4', ''), ('Sum', '', ''))
    """
    if P_VALUE not in table.columns:
        return table
    place = table.columns.index(P_VALUE)

    def parted(cell: str) -> tuple[str, str]:
        number = cell.rstrip("*")
        return number.strip(), cell[len(number) :]

    rows = tuple((*row[:place], *parted(row[place]), *row[place + 1 :]) for row in table.rows)
    columns = (*table.columns[: place + 1], "Significance", *table.columns[place + 1 :])
    return replace(table, columns=columns, rows=rows)


def factor_table(study: Study) -> PaperTable:
    """Return the screened factors with their levels."""
    rows = tuple((f.symbol, _named(study, f.name), short(f.low), short(f.high)) for f in study.factors)
    columns = ("Symbol", "Parameters", "Low Level", "High Level")
    return PaperTable(5, "factors", "Screening test parameters.", columns, rows)


def run_table(number: int, design: DesignRuns, study: Study) -> PaperTable:
    """Return a design with its results."""
    varied = design.varied
    rows = tuple(
        (
            str(run.run),
            *(short(run.levels[name]) for name in varied),
            response_or_reason(run.response, f"failed ({run.outcome.reason or 'no reason'})"),
            *(significant(run.outcome.of(other.name)) for other in study.naming.others),
        )
        for run in design.runs
    )
    responses = map(response_head, (study.naming.response, *study.naming.others))
    columns = ("No.", *(study.factor(name).symbol for name in varied), *responses)
    if number == 6:
        return PaperTable(6, "screening-runs", "Design scheme and results of the screening test.", columns, rows)
    caption = "Test results and scheme of the response surface design."
    return PaperTable(9, "surface-runs", caption, columns, rows)


def screening_table(stage: ScreenResult) -> PaperTable:
    """Return the effects with their significance."""
    places = response_decimals(stage.naming.response, [e.effect for e in stage.effects])
    rows = tuple(
        (
            e.symbol,
            fixed(e.effect, places),
            percent(e.contribution_percent),
            _square(e.sum_of_squares),
            _ratio(e.f),
            starred(e.p, e.stars),
        )
        for e in stage.effects
    )
    columns = ("Parameters", "Effect", "Contribution/%", "Sum of Squares", "F-Value", P_VALUE)
    return PaperTable(7, "screening", "Significance analysis of the screening test parameters.", columns, rows, STARS)


def ascent_table(study: Study, stage: ClimbResult) -> PaperTable:
    """Return the steps of steepest ascent with their error against the target."""
    response = stage.naming.response
    rows = tuple(
        (
            str(row.step),
            *(short(row.levels[name]) for name in stage.names),
            response_or_reason(row.outcome.response, f"failed ({row.outcome.reason or 'no reason'})"),
            fixed(row.error_percent, 1),
        )
        for row in stage.rows
    )
    columns = ("No.", *(study.factor(name).symbol for name in stage.names), response_head(response), "Relative Error/%")
    measured = f"measured {short(stage.target)}{response.beside}"
    note = f"Relative error = 100·(measured − simulated)/measured, {measured}."
    return PaperTable(0, "ascent", "Scheme and results of the steepest ascent test.", columns, rows, note)


def level_table(stage: SurfaceResult) -> PaperTable:
    """Return what the coded levels of the response surface mean."""
    names = stage.names
    coded = sorted({round(run.coded[name], 3) + 0.0 for run in stage.design.runs for name in names})
    rows = []
    for level in reversed(coded):
        cells = [stage.coding[name].natural(level) for name in names]
        rows.append((short(level, 4), *(short(cell, 4) for cell in cells)))
    symbols = stage.symbols()
    columns = ("Factor Level", *(symbols[name] for name in names))
    return PaperTable(8, "levels", "Factor coding of the response surface design.", columns, tuple(rows))


def anova_table(stage: SurfaceResult) -> PaperTable:
    """Return the analysis of variance, the surface's equation below."""
    symbols = stage.symbols()
    rows = tuple(
        (
            _source(row.source, symbols),
            _square(row.sum_of_squares),
            str(row.df),
            _square(row.mean_square),
            _ratio(row.f),
            starred(row.p, row.stars),
        )
        for row in stage.anova
    )
    columns = ("Source", "Sum of Squares", "df", "Mean Square", "F-Value", P_VALUE)
    note = f"{STARS} {equation(stage.coefficients, symbols, stage.naming.response)} (coded values)."
    kind = "Sequential ANOVA" if stage.sums_of_squares == "sequential" else "ANOVA"
    return PaperTable(10, "anova", f"{kind} of the response surface.", columns, rows, note)


def calibration_table(study: Study, stage: InvertResult) -> PaperTable:
    """Return the calibrated parameters."""
    rows = tuple((_named(study, name), significant(value)) for name, value in stage.point.solution.items())
    return PaperTable(11, "calibration", "Parameter calibration values.", ("Parameter", "Numerical Calibration"), rows)


def parameter_table(study: Study, stage: InvertResult) -> PaperTable:
    """Return all parameters of the validation's simulations."""
    levels = {**study.midlevels(), **stage.parameters, **stage.point.solution}
    rows = tuple((f.symbol, _named(study, f.name), significant(levels[f.name])) for f in study.factors)
    of_stem = "Finite element simulation parameters of the stem."
    caption = of_stem if stage.naming.is_cutting else "Parameters of the simulation."
    return PaperTable(12, "parameters", caption, ("Symbol", "Parameters", "Value"), rows)


def refine_table(study: Study, stage: RefineResult) -> PaperTable:
    """Return the runs of the closed loop: where, as the surface predicted, as simulated."""
    names, jointly, naming = list(stage.solution), bool(stage.at_conditions), stage.naming
    rows = tuple(
        (
            str(row.iteration),
            *(place_cell(naming, row.condition) if jointly else ()),
            *(significant(row.levels[name]) for name in names),
            significant(row.predicted),
            response_or_reason(row.outcome.response, f"failed ({row.outcome.reason or 'no reason'})"),
            fixed(row.error_percent, 1),
        )
        for row in stage.rows
    )
    place = place_head(naming) if jointly else ()
    symbols = tuple(study.factor(name).symbol for name in names)
    predicted = over_unit("Predicted Value", naming.response)
    columns = ("No.", *place, *symbols, predicted, response_head(naming.response), "Error/%")
    note = "Predicted by the surface as it was before the run; error = 100·(measured − simulated)/measured."
    return PaperTable(0, "refinement", "Iterations of simulation and refitted surface.", columns, rows, note)


def validation_table(stage: ValidateResult) -> PaperTable:
    """Return measured against simulated force."""
    naming, response, others = stage.naming, stage.naming.response, stage.naming.others
    rows = tuple(
        (
            *place_cell(naming, row.condition),
            short(row.measured),
            response_or_reason(row.simulated, reason or "failed"),
            fixed(row.error_percent, 1),
            *(cell for other in others for cell in _compared_cells(further, other)),
        )
        for row, reason, further in ((row.compared, row.reason, row.further) for row in stage.rows)
    )
    heads = (head for one in (response, *others) for head in _compared_heads(one))
    columns = (*place_head(naming), *heads)
    target = next((naming.place(row.condition) for row in stage.compared if row.role == "calibration"), MISSING)
    what = target or f"the {response.noun}"
    note = f"Error = 100·(measured − simulated)/measured; {what} served for calibration and checks nothing."
    compared = "maximum shear force" if response == FORCE else joined([response.long, *(o.long for o in others)])
    caption = f"Comparison of the measured and simulated {compared}."
    return PaperTable(13, "validation", caption, columns, rows, note)


def response_head(response: Named) -> str:
    """Return the head of a response's column.

    >>> response_head(FORCE), response_head(Named("rho", "Bulk density at rest", "", "ρ", "kg/m3"))
    ('Maximum Shear Force/N', 'Bulk Density at Rest/(kg/m³)')
    """
    return over_unit(_published_label(response), response)


def place_head(naming: Naming) -> tuple[str, ...]:
    """Return the head of the column that tells the condition; none where a study has none."""
    return () if naming.condition is None else (over_unit(_titled(naming.condition.label), naming.condition),)


def over_unit(word: str, named: Named) -> str:
    """Return a heading over the unit that its numbers are divided by."""
    unit = f"({named.written})" if "/" in named.written else named.written
    return f"{word}/{unit}" if unit else word


def _published_label(response: Named) -> str:
    """Return a response's label as the head of a column; the published study calls its own so."""
    return "Maximum Shear Force" if response == FORCE else _titled(response.label)


def _titled(label: str) -> str:
    """Return a label with capital letters, as titles have them; words that have any keep theirs."""
    words = (word if word in _SMALL else word[:1].upper() + word[1:] for word in label.split(" "))
    return " ".join(words)


def _compared_heads(response: Named) -> tuple[str, str, str]:
    """Return the heads over what was measured and simulated of a response."""
    label = _published_label(response)
    return over_unit(f"{label} Measured", response), over_unit(f"{label} Simulation Value", response), "Error/%"


def _compared_cells(further: Sequence[FurtherRow], response: Named) -> tuple[str, str, str]:
    """Return what stands below them of a further response; dashes where nothing was measured."""
    row = next((row for row in further if row.response == response.name), None)
    if row is None:
        return MISSING, MISSING, MISSING
    return short(row.measured), significant(row.simulated), fixed(row.error_percent, 1)


def starred(p: float | None, stars: str) -> str:
    """Return a p-value with its stars; empty where there is none."""
    return f"{probability(p)} {stars}".strip() if p is not None else ""


def _named(study: Study, name: str) -> str:
    factor = study.factor(name)
    label = factor.label or name
    unit = unit_written(factor.unit)
    return f"{label} ({unit})" if unit else label


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
