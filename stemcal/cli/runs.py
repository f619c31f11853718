"""`stemcal runs`: every run of a study, one by one."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from stemcal.cli.console import note, say_json, say_tables
from stemcal.cli.options import AsJson, Out, Quiet, Spec
from stemcal.cli.session import existing_folder, read_study
from stemcal.errors import UsageError
from stemcal.files.typed import to_json
from stemcal.outputs import write_output
from stemcal.stages.base import STAGES

SIMULATING = tuple(stage.name for stage in STAGES if stage.simulates)


def _simulating(name: str) -> str:
    """Return the name of a stage that has runs of its own."""
    if name not in SIMULATING:
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(SIMULATING)}")
    return name


StageName = Annotated[
    str | None,
    typer.Option(
        metavar="|".join(SIMULATING),
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
    from stemcal.folder.study_folder import SCHEMA_VERSION
    from stemcal.overview.status import ledger
    from stemcal.report.tables.of_designs import listed, runs_table
    from stemcal.text.language import say as say_text
    from stemcal.text.names import Names

    study = read_study(spec)
    if csv_file and not csv_file.absolute().parent.is_dir():
        raise UsageError(f"{csv_file}: the folder {csv_file.parent} does not exist")
    entries = ledger(study, existing_folder(study, out))
    found = [e for e in entries if stage in (None, e.stage) and status in (None, e.status)]
    names = Names(study.naming)
    table = runs_table(found, names, study.names, say_text("Runs of study {study}", study=study.name))
    if csv_file:
        write_output(csv_file, table.headed(study.naming.headings).csv())
    if as_json:
        head = {"schema_version": SCHEMA_VERSION, "stage": "runs", "study": study.name}
        say_json({**head, "naming": to_json(study.naming), "runs": to_json(found)})
    elif not csv_file:
        say_tables(listed(table, names))
    if csv_file and not quiet:
        note(f"wrote {csv_file}")
