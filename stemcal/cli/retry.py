"""`stemcal retry`: failed runs once more."""

from typing import Annotated

import typer

from stemcal.cli.console import note, say_json, say_tables, warn
from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers
from stemcal.cli.session import opened
from stemcal.files.typed import to_json

SOME_RUNS_FAILED = 3

Keys = Annotated[
    list[str] | None, typer.Argument(metavar="KEY", help="Keys of runs or how they begin.", show_default="all")
]


def retry(
    spec: Spec,
    keys: Keys = None,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute failed runs again: all, or those named. Runs that succeeded are never touched.

    Example: [bold]stemcal retry configs/smoke.yaml 3f2a91c0[/bold]
    """
    from stemcal.folder.study_folder import SCHEMA_VERSION
    from stemcal.overview.status import retry as again
    from stemcal.report.tables.of_designs import listed, runs_table
    from stemcal.text.names import Names

    with opened(spec, out, workers, executor, quiet) as work:
        entries = again(work.study, work.folder, work.executor, keys or (), work.watch)
        title = f"Runs of study {work.study.name} begun again"
    if as_json:
        naming = to_json(work.study.naming)
        say_json({"schema_version": SCHEMA_VERSION, "stage": "retry", "naming": naming, "runs": to_json(entries)})
    else:
        names = Names(work.study.naming)
        say_tables(listed(runs_table(entries, names, title=title), names))
    if entries and not quiet:
        note(f"now `stemcal run {spec}` takes the new answers into its tables")
    failed = sum(entry.status == "failed" for entry in entries)
    if failed:
        warn(f"{failed} of {len(entries)} runs failed again")
        raise typer.Exit(SOME_RUNS_FAILED)
