"""`stemcal status`: how far a study has come."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.cli.options import AsJson, Out, Spec

if TYPE_CHECKING:
    from stemcal.files.rows import Table
    from stemcal.overview.status import Status
    from stemcal.text.names import Names


def status(spec: Spec, out: Out = None, as_json: AsJson = False) -> None:
    """Show how many runs of each stage are done, running, failed (and why) and left, and what the study comes to.

    It may be asked while the study runs.

    Example: [bold]stemcal status configs/smoke.yaml[/bold]
    """
    from stemcal.cli.console import say, say_json
    from stemcal.cli.session import existing_folder, read_study
    from stemcal.files.typed import to_json
    from stemcal.overview.status import status as count
    from stemcal.report.tables.terminal import drawn
    from stemcal.text.names import Names
    from stemcal.text.verdict import verdict_json

    study = read_study(spec)
    found = count(study, existing_folder(study, out))
    if as_json:
        say_json(to_json(found) | verdict_json(found.verdict, Names(study.naming)))
    else:
        say(*drawn(_table(found, Names(study.naming))))


def _table(found: Status, names: Names) -> Table:
    from stemcal.files.rows import Column, Table
    from stemcal.text.status import lines

    counts = ("Runs", "rows"), ("Done", "done"), ("Running", "running"), ("Failed", "failed"), ("Left", "left")
    columns = [
        Column("stage", "Stage"),
        Column("file", "File"),
        *(Column(key, head, form=_cell) for head, key in counts),
    ]
    return Table.of(columns, found.stages, f"Study {found.study}", lines(found, names))


def _cell(count: int | None) -> str:
    """Return a count; what a stage before has to decide is open."""
    return "?" if count is None else str(count)
