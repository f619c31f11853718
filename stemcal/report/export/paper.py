"""The tables of a study as papers print them: Tables 5 to 13 of the wild chrysanthemum study, for one's own."""

from collections.abc import Sequence
from dataclasses import replace

from stemcal.files.rows import Column, Table
from stemcal.names import Names
from stemcal.numbers import probability, short
from stemcal.report.showing import Setting, showing_of
from stemcal.report.tables.columns import starred
from stemcal.report.tables.printed import NUMBERS, PaperTable
from stemcal.stages.results import Results
from stemcal.study.model import Study


def paper_tables(study: Study, results: Results, holds: bool = True) -> list[PaperTable]:
    """Return the tables that the finished stages allow, in the order of the paper.

    Where the study's verdict is that nothing is calibrated, `holds` is false and ranges are left out.
    """
    setting = Setting(study, results, holds)
    tables = [table for result in results.done for table in showing_of(result).printed(result, setting)]
    return [_factors(study, setting.labelled), *tables]


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
