"""`stemcal status`: how far a study has come."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.cli.options import AsJson, Out, Spec

if TYPE_CHECKING:
    from stemcal.files.rows import Table
    from stemcal.folder.store import Holder
    from stemcal.overview.status import Status


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

    study = read_study(spec)
    found = count(study, existing_folder(study, out))
    if as_json:
        say_json(to_json(found))
    else:
        say(*drawn(_table(found)))


def _table(found: Status) -> Table:
    from stemcal.files.rows import Column, Table

    counts = ("Runs", "rows"), ("Done", "done"), ("Running", "running"), ("Failed", "failed"), ("Left", "left")
    columns = [
        Column("stage", "Stage"),
        Column("file", "File"),
        *(Column(key, head, form=_cell) for head, key in counts),
    ]
    return Table.of(columns, found.stages, title=f"Study {found.study}", foot=tuple(_foot(found)))


def _cell(count: int | None) -> str:
    """Return a count; what a stage before has to decide is open."""
    return "?" if count is None else str(count)


def _foot(found: Status) -> list[str]:
    working = found.working
    lines = [_worker(working) if working is not None else "No process works here now."]
    for stage in found.stages:
        if stage.reasons:
            listed = ", ".join(f"{reason} ({count})" for reason, count in stage.reasons.items())
            lines.append(f"{stage.stage}: failed: {listed}; `stemcal runs SPEC --status failed` tells more.")
        if stage.censored:
            lines.append(
                f"{stage.stage}: {stage.censored} forces not clearly past their maximum when the stroke ended."
            )
        if stage.damaged:
            lines.append(f"{stage.stage}: {stage.damaged} records are damaged; their runs will be done again.")
        if stage.changed:
            lines.append(f"{stage.stage}.json is stale: {', '.join(stage.changed)} changed since.")
    return [*lines, *found.verdict.lines()]


def _worker(working: Holder) -> str:
    if working.pid is None:
        return "A process works here."
    return f"Process {working.pid} on {working.host} works here since {working.since}."
