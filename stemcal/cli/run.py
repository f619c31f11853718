"""`stemcal run`, the command of each stage, `stemcal enter` and `stemcal report`."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stemcal.cli.console import note, say, say_json, say_whole, warn
from stemcal.cli.session import AsJson, ExecutorName, Out, Quiet, Session, Spec, Workers, finished_work, opened
from stemcal.errors import TargetUnreachable, UsageError
from stemcal.stages.stage import Stage
from stemcal.storage.plain import read_plain

if TYPE_CHECKING:
    from stemcal.stages.result import StageResult
    from stemcal.study.model.study import Study


Until = Annotated[
    str | None,
    typer.Option("--until", metavar="STAGE", help="Stage after which the study stops.", show_default="all stages"),
]
Retry = Annotated[bool, typer.Option("--retry", help="Repeat the failed runs before any other runs.")]


def run(
    spec: Spec,
    until: Until = None,
    retry: Retry = False,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Run all stages of a study and write the report.

    By default, the stages are `screen`, `rsm`, `invert` and `validate`. The optional stages `climb` and `refine` are
    included if the spec contains sections with these names. You can interrupt a study at any time. To resume the
    study, run the same command again; completed runs are reused.

    Example: [bold]stemcal run configs/smoke.yaml --out runs/first --workers 2[/bold]
    """
    with opened(spec, out, workers, executor, quiet) as work:
        _require_stage(work.study, until)
        if not quiet:
            note(f"Report: {work.folder.path / 'report.html'}, updated after each stage")
        if retry:
            _compute_again(work)
        work.foresee()
        show = _go_through(work, until)
    show(as_json, quiet)


def _require_stage(study: Study, name: str | None) -> None:
    """Refuse the name of a stage that this study does not have."""
    from stemcal.stages.stage import stages_of

    names = [stage.name for stage in stages_of(study)]
    if name is not None and name not in names:
        raise UsageError(f"--until {name[:40]}: the study has no stage with this name; use one of {', '.join(names)}")


def _compute_again(work: Session) -> None:
    """Compute the failed runs again; warn of those that failed again."""
    from stemcal.formats import counted
    from stemcal.overview.status import retry

    entries = work.continued(lambda: retry(work.study, work.folder, work.executor, work.watch))
    failed = sum(entry.status == "failed" for entry in entries)
    note(f"repeated {counted(len(entries), 'failed run')}")
    if failed:
        warn(f"{failed} of {len(entries)} runs failed again; `stemcal status SPEC --failed` lists the failed runs")


def _go_through(work: Session, until: str | None = None) -> Callable[..., None]:
    """Take an open study through its stages and draw its page; return what shows it once the study is closed."""
    from stemcal.cli.show import show_run
    from stemcal.report.redraw import draw
    from stemcal.stages.fresh import make_all
    from stemcal.stages.results import fresh_results
    from stemcal.stages.verdict.verdict_rules import verdict_of

    unreachable: TargetUnreachable | None = None
    made: list[StageResult] = []
    work.folder.remember_spec(work.study.source)
    try:
        made = work.continued(
            lambda: make_all(work.study, work.folder, work.executor, work.watch, done=_showing(work), until=until)
        )
    except TargetUnreachable as error:
        unreachable = error
    work.watch.busy("drawing the report")
    results = fresh_results(work.study, work.folder, made)
    verdict = verdict_of(work.study, work.folder, results)
    page = draw(work.study, work.folder, results, verdict)

    def show(as_json: bool, quiet: bool) -> None:
        show_run(work.study, results, verdict, page, work.folder, as_json, quiet)
        if unreachable is not None:
            raise unreachable

    return show


def _showing(work: Session) -> Callable[[StageResult], None]:
    """Return a function that writes the page after each stage but the last, which the whole page follows."""
    from stemcal.report.redraw import draw_words
    from stemcal.stages.fresh import finished
    from stemcal.stages.stage import stages_of

    last, before = stages_of(work.study)[-1].name, finished(work.study, work.folder)

    def show(result: StageResult) -> None:
        if result.name != last and not before:
            draw_words(work.study, work.folder)

    return show


def command_of(stage: Stage[Any], example: str = "configs/smoke.yaml") -> Callable[..., None]:
    """Return the command that runs a stage and shows its result."""

    def command(
        spec: Spec,
        out: Out = None,
        workers: Workers = None,
        executor: ExecutorName = "local",
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:
        from stemcal.cli.show import show_stage
        from stemcal.stages.fresh import make
        from stemcal.stages.verdict.verdict_rules import verdict_of

        with opened(spec, out, workers, executor, quiet) as work:
            if stage.simulates:
                work.foresee(stage.name)
            result = work.continued(lambda: make(stage, work.study, work.folder, work.executor, work.watch))
            verdict = verdict_of(work.study, work.folder)
        show_stage(result, verdict, work.folder, as_json, quiet)

    command.__name__ = stage.name
    command.__doc__ = f"{cleandoc(stage.help)}\n\nExample: [bold]stemcal {stage.name} {example}[/bold]"
    return command


def report(
    spec: Spec,
    out: Out = None,
    show: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write a report on the completed stages as a self-contained HTML page.

    The report can also be written while the study is running.

    Example: [bold]stemcal report configs/smoke.yaml[/bold]
    """
    from stemcal.report.redraw import draw
    from stemcal.stages.verdict.verdict_rules import verdict_of

    study, folder, results = finished_work(spec, out, quiet)
    verdict = verdict_of(study, folder, results)
    page = draw(study, folder, results, verdict, again=True)
    drawn = folder.path / "figures"
    if show and not webbrowser.open(page.resolve().as_uri()):
        warn(f"No browser was found. Open {page} in a browser.")
    if as_json:
        say_json({"page": str(page), "figures": str(drawn)})
    else:
        say_whole(f"Report: {page}", f"Figures: {drawn}")


Sheet = Annotated[Path, typer.Argument(metavar="SHEET", help="Run sheet with the results (`.csv` or `.xlsx`).")]
Replace = Annotated[
    str, typer.Option("--replace", metavar="WHY", help="Reason for replacing recorded results.", show_default=False)
]


def enter(
    spec: Spec, sheet: Sheet, out: Out = None, replace: Replace = "", as_json: AsJson = False, quiet: Quiet = False
) -> None:
    """Record the results of manual runs and continue the study.

    The command records the valid rows of the run sheet and lists the rows with errors. If a run could not be performed,
    enter `failed: REASON` in its row of the run sheet. With `--replace`, the recorded result of a run is
    removed if the run is marked as failed in the run sheet.

    Example: [bold]stemcal enter my-study.yaml my-sheet.xlsx[/bold]
    """
    from stemcal.by_hand.entering import record_results
    from stemcal.by_hand.run_sheet import MAX_BYTES, filled

    try:
        content = read_plain(sheet, MAX_BYTES)
    except OSError as error:
        raise UsageError(f"{sheet}: {error.strerror}; specify the path of the run sheet") from None
    with opened(spec, out, None, "local", quiet, entered=sheet) as work:
        rows, reason = filled(content, sheet.name, work.study.by_hand), replace.strip()
        found = record_results(work.study, work.folder, rows, replace_because=reason)
        if as_json:
            refused = [
                {"kind": one.kind, "place": one.place, "run": one.run, "text": str(one)} for one in found.refused
            ]
            say_json({"schema_version": 1, "stage": "enter", **vars(found), "refused": refused})
        else:
            say(found.summary())
        found.require_all()
        show = _go_through(work)
    if not as_json:
        show(False, quiet)
