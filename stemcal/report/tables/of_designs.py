"""Tables of runs: those of a design, and those of a whole study."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from stemcal.drawing.columns import condition, levels, simulated, to_decimals
from stemcal.drawing.table import Column, Table
from stemcal.formats import short, significant
from stemcal.stages.result import DesignRuns, StageResult
from stemcal.stages.stage import stage_called
from stemcal.vocabulary import FIRST, Variable, Wording

if TYPE_CHECKING:
    from stemcal.stages.ledger import LedgerRow

MANY = 4  # factors beyond which columns are headed by symbols instead of names


def design_tables(result: StageResult, symbols: Mapping[str, str]) -> list[Table]:
    """Return the runs of the design of a stage, the varied levels and the responses; nothing where it has none."""
    if not isinstance(design := getattr(result, "design", None), DesignRuns):
        return []
    naming, crowded = result.naming, len(design.varied) > MANY
    columns = [
        Column("run", "Run", form=format),
        *levels(design.varied, Wording(naming, symbols if crowded else {}), lambda value: short(value, 4)),
        simulated(naming.response),
        *map(_other, naming.others),
    ]
    foot = ["The symbols are defined in the table of factors."] if crowded and any(symbols.values()) else []
    return [Table.of(columns, design.runs, f"{stage_called(result.name).title} runs", foot, detail=True)]


def _other(named: Variable) -> Column:
    return Column(named.name, named.capital, named.written, significant, lambda run: run.outcome.of(named.name))


def runs_table(found: Iterable[LedgerRow], names: Wording, title: str) -> Table:
    """Return runs one by one."""
    columns = [
        Column("stage", "Stage"),
        Column("key", "Key", form=lambda key: key[:8], words=True),
        Column("status", "Status"),
        Column("reason", "Reason"),
        Column("run", "Run", form=format),
        *condition(names.naming),
        Column(FIRST, names.response.capital, names.response.written, significant),
        Column("wall_seconds", "Time", "s", to_decimals(1)),
    ]
    entries = list(found)
    return Table.of(columns, entries, title, () if entries else ["None."])
