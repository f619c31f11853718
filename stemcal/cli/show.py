"""How a finished stage is shown, and the exit code when some of its runs failed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stemcal.cli.console import note, say, say_json, say_tables, say_whole, warn
from stemcal.formats import counted
from stemcal.vocabulary import Wording

if TYPE_CHECKING:
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.stages.result import StageResult
    from stemcal.stages.results import Results
    from stemcal.stages.verdict.result import Verdict
    from stemcal.study.model.study import Study

SOME_RUNS_FAILED = 3


def show_stage(result: StageResult, verdict: Verdict, folder: StudyFolder, as_json: bool, quiet: bool) -> None:
    """Print a stage's tables (or its JSON) on stdout, warnings and notes on stderr; leave with 3 if runs failed.

    If the finished stages show that the study is not calibrated, no interval is shown.
    """
    from stemcal.report.records import read_records, run_warnings

    if as_json:
        say_json(result.to_json())
    else:
        from stemcal.report.terminal import stage_tables

        say(*stage_tables(result, verdict.may_hold))
    if not quiet:
        from stemcal.report.outcome import KNOWN, shown_notes
        from stemcal.stages.verdict.words import opening

        for found in shown_notes(result, verdict.may_hold):
            note(f"note: {found}")
        if not verdict.holds and any(found.kind == KNOWN for found in shown_notes(result, holds=True)):
            note(f"note: {opening(verdict)}")
    for warning in run_warnings(read_records(result, folder)):
        warn(str(warning))
    if _warn_of_failed(result):
        raise typer.Exit(SOME_RUNS_FAILED)


def show_run(
    study: Study, results: Results, verdict: Verdict, page: Path, folder: StudyFolder, as_json: bool, quiet: bool
) -> None:
    """Print what a whole study came to: what was found, notes, at last the verdict, a table, and where the page is.

    With `as_json` all stages as JSON. Leaves with exit code 3 if runs failed.
    """
    if as_json:
        from stemcal.stages.verdict.words import verdict_json

        stages = {result.name: result.to_json() for result in results.done}
        judged = {**verdict_json(verdict, Wording(study.naming)), "report": str(page)}
        say_json({**stages, **judged})
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
        raise typer.Exit(SOME_RUNS_FAILED)


def _show_findings(results: Results, verdict: Verdict, folder: StudyFolder, quiet: bool) -> None:
    """Print the identifiability and the most important notes, without those that the verdict repeats below."""
    from stemcal.drawing.showing import names_of
    from stemcal.report.outcome import KNOWN, MOST, notes_of_all, read_first, shortened, showing_of
    from stemcal.report.records import read_records, run_warnings
    from stemcal.report.terminal import spoken

    for result in results.done:
        say_tables(*(shortened(result, table) for table in showing_of(result).findings(result, names_of(result))))
        say(*spoken(result, verdict.holds))
    if quiet:
        return
    warnings = run_warnings(read_records(results, folder), verdict)
    found = read_first([*(("runs", one) for one in warnings), *notes_of_all(results, verdict.holds)])
    notes = [f"note: {title}: {one}" for title, one in found if one.kind != KNOWN]
    note("\n".join(notes[:MOST]))
    if len(notes) > MOST:
        note(f"{counted(len(notes) - MOST, 'more note')} in the report")


def _warn_of_failed(*results: StageResult) -> bool:
    """Count the failed runs of each stage with their reasons; returns whether there are any."""
    from stemcal.report.outcome import failures_of

    failed = [text for result in results if (text := failures_of(result))]
    for text in failed:
        warn(text)
    return bool(failed)
