"""`stemcal status`: how far a study has come."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.cli.options import AsJson, Out, Spec

if TYPE_CHECKING:
    from stemcal.overview.status import Status
    from stemcal.report.tables.sheet import Sheet
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
        say(*drawn(_sheet(found, Names(study.naming))))


def _sheet(found: Status, names: Names) -> Sheet:
    from stemcal.report.tables.sheet import Sheet
    from stemcal.text.status import lines

    columns = ("Stage", "File", "Runs", "Done", "Running", "Failed", "Left")
    rows = tuple(
        (
            stage.stage,
            stage.file,
            *(_cell(getattr(stage, name)) for name in ("rows", "done", "running", "failed", "left")),
        )
        for stage in found.stages
    )
    return Sheet(f"Study {found.study}", columns, rows, texts=2, foot=tuple(lines(found, names)))


def _cell(count: int | None) -> str:
    """Return a count; what a stage before has to decide is open."""
    return "?" if count is None else str(count)
