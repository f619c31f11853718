"""Tables as papers print them: a table of the report with chosen columns, their heads as titles, a caption, a note."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from stemcal.files.rows import Table
from stemcal.files.showing import in_a_line
from stemcal.naming import FIRST, FORCE, Named, capital
from stemcal.report.tables.columns import ERROR, to_decimals
from stemcal.study.model import Study

STARS = "** represents extremely significant effect (p < 0.01), * represents significant effect (p < 0.05)."
NUMBERS = {"factors": 5, "screening-runs": 6, "screening": 7, "levels": 8, "surface-runs": 9, "anova": 10,
           "calibration": 11, "parameters": 12, "validation": 13}  # fmt: skip
"""The numbers that tables have in the published study."""
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


def printed(name: str, caption: str, table: Table, heads: Mapping[str, str], note: str = "") -> PaperTable:
    """Return a table with those of its columns that are in `heads`; an empty head keeps the column's label."""
    keys = [column.key for column in table.columns]
    picked = table.only(key for key in keys if key in heads)
    columns = tuple(
        replace(
            column,
            label=heads[column.key] or titled(column.name),
            unit="" if column.key == "effect" else column.unit,
            form=to_decimals(1) if column.label == ERROR.label else column.form,
        )
        for column in picked.columns
    )
    return PaperTable(NUMBERS.get(name, 0), name, caption, replace(picked, columns=columns), note)


def run_heads(study: Study, number: str) -> dict[str, str]:
    """Return the heads of the columns of runs: number, condition, levels, responses."""
    naming = study.naming
    place = {} if naming.condition is None else {"condition": titled(naming.condition.label)}
    responses = {FIRST: label_of(naming.response), **{other.name: titled(other.label) for other in naming.others}}
    return {number: "No.", **place, **dict.fromkeys(study.names, ""), **responses}


def over_unit(word: str, unit: str) -> str:
    """Return a heading over the unit that its numbers are divided by.

    >>> over_unit("Maximum Shear Force", "N"), over_unit("Bulk Density at Rest", "kg/m³"), over_unit("No.", "")
    ('Maximum Shear Force/N', 'Bulk Density at Rest/(kg/m³)', 'No.')
    """
    return f"{word}/({unit})" if "/" in unit else f"{word}/{unit}" if unit else word


def label_of(response: Named) -> str:
    """Return a response's label as the head of a column; the published study calls its own so."""
    return "Maximum Shear Force" if response == FORCE else titled(response.label)


def titled(label: str) -> str:
    """Return a label with capital letters, as titles have them; words that have any keep theirs."""
    return " ".join(word if word in _SMALL else capital(word) for word in label.split(" "))
