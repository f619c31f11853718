"""`stemcal runs`: every run of a study, one by one."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from stemcal.cli.options import AsJson, Out, Quiet, Spec
from stemcal.naming import CUTTING, Naming
from stemcal.stages.base import STAGES

if TYPE_CHECKING:
    from stemcal.overview.status import Entry
    from stemcal.report.tables.sheet import Sheet

SHORT_KEY = 8
COLUMNS = ("stage", "run", "key", "status", "response", "reason", "message", "condition")
AFTER_LEVELS = ("tries", "wall_seconds", "started", "host", "stemcal")
SIMULATING = tuple(stage.name for stage in STAGES if stage.simulates)


def _simulating(name: str) -> str:
    """Return the name of a stage that has runs of its own."""
    if name not in SIMULATING:
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(SIMULATING)}")
    return name


StageName = Annotated[
    str | None,
    typer.Option(
        metavar=f"[{'|'.join(SIMULATING)}]",
        help="Only runs of this stage.",
        parser=_simulating,
        autocompletion=lambda: list(SIMULATING),
    ),
]
Status = Annotated[
    Literal["ok", "censored", "failed", "left", "damaged"] | None, typer.Option(help="Only runs of this status.")
]
CsvFile = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write the table here, with all columns.")]


def runs(
    spec: Spec,
    stage: StageName = None,
    status: Status = None,
    csv_file: CsvFile = None,
    out: Out = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """List the runs of a study: levels, force, or why there is none.

    Example: [bold]stemcal runs configs/smoke.yaml --status failed[/bold]
    """
    from stemcal.cli.console import note, say, say_json
    from stemcal.cli.session import existing_folder, read_study
    from stemcal.errors import UsageError
    from stemcal.files.typed import to_json
    from stemcal.folder.store import SCHEMA_VERSION
    from stemcal.overview.status import ledger
    from stemcal.report.tables.terminal import drawn

    study = read_study(spec)
    if csv_file and not csv_file.absolute().parent.is_dir():
        raise UsageError(f"{csv_file}: the folder {csv_file.parent} does not exist")
    entries = ledger(study, existing_folder(study, out))
    found = [e for e in entries if stage in (None, e.stage) and status in (None, e.status)]
    if csv_file:
        write_table(found, study.names, csv_file, study.naming)
    if as_json:
        say_json(
            {
                "schema_version": SCHEMA_VERSION,
                "stage": "runs",
                "study": study.name,
                "naming": to_json(study.naming),
                "runs": to_json(found),
            }
        )
    elif not csv_file:
        say(*drawn(table_of(f"Runs of study {study.name}", found, study.naming)))
    if csv_file and not quiet:
        note(f"wrote {csv_file}")


def write_table(found: Iterable[Entry], factors: Iterable[str], path: Path, naming: Naming = CUTTING) -> None:
    """Write runs as CSV: a column per factor, empty cells where there is nothing."""
    from stemcal.files.rows import Table
    from stemcal.outputs import write_output

    names = tuple(factors)
    rows = []
    for run in found:
        levels = [run.levels.get(name) for name in names]
        rows.append((*(getattr(run, c) for c in COLUMNS), *levels, *(getattr(run, c) for c in AFTER_LEVELS)))
    write_output(path, Table((*COLUMNS, *names, *AFTER_LEVELS), tuple(rows)).headed(naming.headings).csv())


def table_of(title: str, found: Iterable[Entry], naming: Naming = CUTTING) -> Sheet:
    """Return runs as a table for the terminal."""
    from stemcal.report.numbers import fixed, significant
    from stemcal.report.tables.sheet import Sheet, place_cell, place_head

    place, response = place_head(naming, ",\n"), naming.response.heading(",\n")
    columns = ("Stage", "Key", "Status", "Reason", "Run", *place, response, "Time,\ns")
    rows = tuple(
        (
            run.stage,
            run.key[:SHORT_KEY],
            run.status,
            run.reason,
            str(run.run),
            *place_cell(naming, run.condition),
            significant(run.response),
            fixed(run.wall_seconds, 1),
        )
        for run in found
    )
    foot = () if rows else ("There are none.",)
    return Sheet(title, columns, rows, texts=4, foot=foot)
