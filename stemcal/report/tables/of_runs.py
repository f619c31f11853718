"""Tables of runs: the designs, the solver's checks, every run of a study one by one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stemcal.files.rows import Column, Table
from stemcal.naming import FIRST, Named
from stemcal.overview.status import Entry
from stemcal.report.records import Records, distinct_of
from stemcal.report.tables.columns import condition, levels, response, to_decimals
from stemcal.stages.result import DesignRuns
from stemcal.text.language import say
from stemcal.text.names import Names
from stemcal.text.numbers import fixed, short, significant
from stemcal.text.tables import line

CROWDED = 4  # factors beyond which columns are headed by symbols in place of names
SHORT_KEY = 8
LISTED = ("stage", "key", "status", "reason", "run", "condition", FIRST, "wall_seconds")
"""What the terminal shows of a run; its CSV file has more."""


def design_table(design: DesignRuns, names: Names, symbols: Mapping[str, str] | None = None, title: str = "") -> Table:
    """Return the runs of a design: the varied levels and the responses, or why there is none."""
    crowded = symbols is not None and len(design.varied) > CROWDED
    heads = Names(names.naming, symbols or {}) if crowded else names
    foot = (line("symbols"),) if crowded and any((symbols or {}).values()) else ()
    columns = [
        Column("run", "Run", form=format),
        *levels(design.varied, heads, short),
        response(names.response),
        *(_further(other) for other in names.naming.others),
    ]
    return Table.of(columns, design.runs, title, foot, detail=True)


def _further(named: Named) -> Column:
    return Column(named.name, named.capital, named.written, significant, lambda run: run.outcome.of(named.name))


def checks_table(records: Records) -> Table | None:
    """Return the solver's checks of every distinct run, None where no solver told of them."""
    rows = [vars(one.checks) | {"run": run} for run, one in distinct_of(records).values() if one.checks is not None]
    columns = (
        Column("run", "Run"),
        Column("peak_force", "Peak", "N", significant),
        Column("peak_travel", "at", "mm", to_decimals(3)),
        Column("again", "Fell again", "", str, lambda row: say("yes") if row["stroke_was_enough"] else say("no")),
        Column("elements", "Elements", form=format),
        Column("deleted_elements", "Failed", form=format),
        Column("steps", "Steps", form=format),
        Column("energy_drift_percent", "Drift", "%", to_decimals(3)),
        Column("kinetic_ratio_percent", "Kinetic", "%", fixed),
        Column("hourglass_ratio_percent", "Hourglass", "%", fixed),
    )
    return Table.of(columns, rows, line("checks"), [line("shares")], detail=True) if rows else None


def runs_table(found: Iterable[Entry], names: Names, factors: Iterable[str] = (), title: str = "") -> Table:
    """Return runs one by one, with all that their CSV file has."""
    columns = [
        Column("stage", "Stage"),
        Column("run", "Run", form=format),
        Column("key", "Key", form=lambda key: key[:SHORT_KEY], words=True),
        Column("status", "Status"),
        Column(FIRST, names.response.capital, names.response.written, significant),
        Column("reason", "Reason"),
        Column("message"),
        *(condition(names.naming) or [Column("condition")]),
        *factors,
        Column("tries"),
        Column("wall_seconds", "Time", "s", to_decimals(1)),
        *("started", "host", "stemcal"),
    ]
    entries = list(found)
    return Table.of(columns, entries, title, () if entries else (say("There are none."),))


def listed(runs: Table, names: Names) -> Table:
    """Return what the terminal shows of runs."""
    return runs.only(key for key in LISTED if key != "condition" or names.naming.condition is not None)
