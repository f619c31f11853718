"""`stemcal run`, the command of each stage, `stemcal enter` and `stemcal report`."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from functools import partial
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stemcal.cli.console import note, say, say_json, say_tables, say_whole, warn
from stemcal.cli.session import AsJson, ExecutorName, Out, Quiet, Session, Spec, Workers, finished_work, opened
from stemcal.errors import RunsFailed, TargetUnreachable, UsageError
from stemcal.stages.stage import Stage
from stemcal.storage.plain import read_plain

if TYPE_CHECKING:
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.stages.result import StageResult
    from stemcal.stages.results import Results
    from stemcal.stages.verdict.result import Verdict
    from stemcal.study.model.study import Study

_Until = Annotated[
    str | None,
    typer.Option("--until", metavar="STAGE", help="Stage after which the study stops.", show_default="all stages"),
]
_Retry = Annotated[bool, typer.Option("--retry", help="Repeat the failed runs before any other runs.")]
_Quick = Annotated[bool, typer.Option("--quick", help="Calibrate in few runs, without a surface and intervals.")]


def run(
    spec: Spec,
    until: _Until = None,
    retry: _Retry = False,
    quick: _Quick = False,
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

    A spec with a `goal` has the stage `optimise` instead of `invert` and `validate`.
    With `--quick`, the study has only the stages `refine` and `validate`, as with `rsm: {design: none}` in the spec.
    Other commands, such as `stemcal report`, find the results if that is in the spec.

    Example: [bold]stemcal run configs/smoke.yaml --out runs/first --workers 2[/bold]
    """
    from stemcal.formats import counted
    from stemcal.stages.rsm.options import WITHOUT_SURFACE
    from stemcal.stages.stage import stages_of

    with opened(spec, out, workers, executor, quiet, changes=WITHOUT_SURFACE if quick else None) as work:
        names = [stage.name for stage in stages_of(work.study)]
        if until is not None and until not in names:
            message = f"--until {until[:40]}: the study has no stage with this name; use one of {', '.join(names)}"
            raise UsageError(message)
        if not quiet:
            note(f"Report: {work.folder.path / 'report.html'}, updated after each stage")
        if retry:
            from stemcal.overview.status import retry as repeated

            entries = work.continued(lambda: repeated(work.study, work.folder, work.executor, work.watch))
            note(f"repeated {counted(len(entries), 'failed run')}")
            if failed := sum(entry.status == "failed" for entry in entries):
                again = "failed again; `stemcal status SPEC --failed` lists the failed runs"
                warn(f"{failed} of {len(entries)} runs {again}")
        work.foresee()
        show = _go_through(work, until)
    show(as_json, quiet)


def _go_through(work: Session, until: str | None = None) -> Callable[..., None]:
    """Compute the stages and the report of a study; return a function that prints them, to call after unlocking."""
    from stemcal.report.redraw import draw, draw_words
    from stemcal.stages.fresh import finished, make_all
    from stemcal.stages.results import fresh_results
    from stemcal.stages.stage import stages_of
    from stemcal.stages.verdict.verdict_rules import verdict_of

    study, folder = work.study, work.folder
    unreachable: TargetUnreachable | None = None
    computed: list[StageResult] = []
    last, before = stages_of(study)[-1].name, finished(study, folder)

    def draw_so_far(result: StageResult) -> None:
        if result.name != last and not before:  # after the last stage, the page with figures follows anyway
            draw_words(study, folder)

    folder.remember_spec(study.source)
    compute = partial(make_all, study, folder, work.executor, work.watch, done=draw_so_far, until=until)
    try:
        computed = work.continued(compute)
    except TargetUnreachable as error:
        unreachable = error
    work.watch.busy("drawing the report")
    results = fresh_results(study, folder, computed)
    verdict = verdict_of(study, folder, results)
    page = draw(study, folder, results, verdict)

    def show(as_json: bool, quiet: bool) -> None:
        _show_run(study, results, verdict, page, folder, as_json, quiet)
        if unreachable is not None:
            raise unreachable

    return show


def _show_run(
    study: Study, results: Results, verdict: Verdict, page: Path, folder: StudyFolder, as_json: bool, quiet: bool
) -> None:
    from stemcal.vocabulary import Wording

    if as_json:
        from stemcal.stages.verdict.words import verdict_json

        stages = {result.name: result.to_json() for result in results.done}
        say_json({**stages, **verdict_json(verdict, Wording(study.naming)), "report": str(page)})
    else:
        _show_findings(results, verdict, folder, quiet)
    failed = _warn_of_failed(*results.done)
    if not as_json:
        from stemcal.report.terminal import final_tables
        from stemcal.stages.verdict.words import lines

        say(*lines(verdict, Wording(study.naming)), "")
        say_tables(*final_tables(study, results, verdict.holds))
        say_whole(f"Report: {page}")
    if failed:
        raise typer.Exit(RunsFailed.exit_code)


def _show_findings(results: Results, verdict: Verdict, folder: StudyFolder, quiet: bool) -> None:
    from stemcal.drawing.showing import names_of
    from stemcal.formats import counted
    from stemcal.report.outcome import KNOWN, MOST, notes_of_all, read_first, shortened, showing_of
    from stemcal.report.records import read_records, run_warnings
    from stemcal.report.terminal import identifiability

    for result in results.done:
        say_tables(*(shortened(result, table) for table in showing_of(result).findings(result, names_of(result))))
        say(*identifiability(result, verdict.holds))
    if quiet:
        return
    warnings = run_warnings(read_records(results, folder), verdict)
    sorted_notes = read_first([*(("runs", warning) for warning in warnings), *notes_of_all(results, verdict.holds)])
    notes = [f"note: {title}: {remark}" for title, remark in sorted_notes if remark.kind != KNOWN]
    note("\n".join(notes[:MOST]))
    if len(notes) > MOST:
        note(f"{counted(len(notes) - MOST, 'more note')} in the report")


def _warn_of_failed(*results: StageResult) -> bool:
    from stemcal.report.outcome import failures_of

    failed = [text for result in results if (text := failures_of(result))]
    for text in failed:
        warn(text)
    return bool(failed)


def command_of(stage: Stage[Any], example: str = "") -> Callable[..., None]:
    """Return the command-line function that runs a stage and shows its result."""
    example = example or f"configs/{'chrysanthemum-cutter' if 'goal' in stage.reads else 'smoke'}.yaml"

    def command(
        spec: Spec,
        out: Out = None,
        workers: Workers = None,
        executor: ExecutorName = "local",
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:
        from stemcal.stages.fresh import make
        from stemcal.stages.verdict.verdict_rules import verdict_of

        with opened(spec, out, workers, executor, quiet) as work:
            if stage.simulates:
                work.foresee(stage.name)
            result = work.continued(lambda: make(stage, work.study, work.folder, work.executor, work.watch))
            verdict = verdict_of(work.study, work.folder)
        _show_stage(result, verdict, work.folder, as_json, quiet)

    command.__name__ = stage.name
    command.__doc__ = f"{cleandoc(stage.help)}\n\nExample: [bold]stemcal {stage.name} {example}[/bold]"
    return command


def _show_stage(result: StageResult, verdict: Verdict, folder: StudyFolder, as_json: bool, quiet: bool) -> None:
    """Print the tables (or JSON) of a stage on stdout, warnings and notes on stderr; exit with code 3 if runs failed.

    Confidence intervals are omitted if the finished stages show that the study is not calibrated.
    """
    from stemcal.report.outcome import KNOWN, shown_notes
    from stemcal.report.records import read_records, run_warnings
    from stemcal.report.terminal import stage_tables
    from stemcal.stages.verdict.words import opening

    if as_json:
        say_json(result.to_json())
    else:
        say(*stage_tables(result, verdict.may_hold))
    if not quiet:
        for remark in shown_notes(result, verdict.may_hold):
            note(f"note: {remark}")
        if not verdict.holds and any(remark.kind == KNOWN for remark in shown_notes(result, holds=True)):
            note(f"note: {opening(verdict)}")
    for warning in run_warnings(read_records(result, folder)):
        warn(str(warning))
    if _warn_of_failed(result):
        raise typer.Exit(RunsFailed.exit_code)


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
    page = draw(study, folder, results, verdict_of(study, folder, results), again=True)
    figures = folder.path / "figures"
    if show and not webbrowser.open(page.resolve().as_uri()):
        warn(f"No browser was found. Open {page} in a browser.")
    if as_json:
        say_json({"page": str(page), "figures": str(figures)})
    else:
        say_whole(f"Report: {page}", f"Figures: {figures}")


_Sheet = Annotated[Path, typer.Argument(metavar="SHEET", help="Run sheet with the results (`.csv` or `.xlsx`).")]
_Replace = Annotated[
    str, typer.Option("--replace", metavar="WHY", help="Reason for replacing recorded results.", show_default=False)
]


def enter(
    spec: Spec, sheet: _Sheet, out: Out = None, replace: _Replace = "", as_json: AsJson = False, quiet: Quiet = False
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
        entered = record_results(work.study, work.folder, rows, replace_because=reason)
        if as_json:
            refused = [
                {"kind": row.kind, "place": row.place, "run": row.run, "text": str(row)} for row in entered.refused
            ]
            say_json({"schema_version": 1, "stage": "enter", **vars(entered), "refused": refused})
        else:
            say(entered.summary())
        entered.require_all()
        show = _go_through(work)
    if not as_json:
        show(False, quiet)
