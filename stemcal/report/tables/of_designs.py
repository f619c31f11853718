"""Tables of runs: those of a design, and those of a whole study."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from stemcal.files.rows import Column, Table
from stemcal.naming import FIRST, Named, Names
from stemcal.numbers import significant
from stemcal.report.tables.columns import condition, level, levels, simulated, to_decimals
from stemcal.stages.result import DesignRuns, StageResult
from stemcal.stages.stage import stage_called

if TYPE_CHECKING:
    from stemcal.overview.status import Entry

MANY = 4  # factors beyond which columns are headed by symbols instead of names
SHORT_KEY = 8
LISTED = ("stage", "key", "status", "reason", "run", "condition", FIRST, "wall_seconds")
"""What the terminal shows of a run; its CSV file has more."""


def design_tables(result: StageResult, symbols: Mapping[str, str]) -> list[Table]:
    """Return the runs of the design of a stage, the varied levels and the responses; nothing where it has none."""
    if not isinstance(design := getattr(result, "design", None), DesignRuns):
        return []
    naming, crowded = result.naming, len(design.varied) > MANY
    columns = [
        Column("run", "Run", form=format),
        *levels(design.varied, Names(naming, symbols if crowded else {}), level),
        simulated(naming.response),
        *map(_other, naming.others),
    ]
    foot = ["The symbols are defined in the table of factors."] if crowded and any(symbols.values()) else []
    return [Table.of(columns, design.runs, f"{stage_called(result.name).title} runs", foot, detail=True)]


def _other(named: Named) -> Column:
    return Column(named.name, named.capital, named.written, significant, lambda run: run.outcome.of(named.name))


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
    return Table.of(columns, entries, title, () if entries else ["None."])


def listed(runs: Table, names: Names) -> Table:
    """Return what the terminal shows of runs."""
    return runs.only(key for key in LISTED if key != "condition" or names.naming.condition is not None)
