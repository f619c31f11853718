"""How a finished stage is shown, and the exit code when some of its runs failed."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stemcal.cli.console import note, say, say_json, say_whole, warn
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    from stemcal.folder.store import StudyFolder
    from stemcal.stages.result import StageResult
    from stemcal.stages.results import Results
    from stemcal.stages.verdict.result import Verdict

SOME_RUNS_FAILED = 3


def show_stage(result: StageResult, verdict: Verdict, folder: StudyFolder, as_json: bool, quiet: bool) -> None:
    """Print a stage's tables (or its JSON) on stdout, warnings and notes on stderr; leave with 3 if runs failed.

    Where what is done so far says that the study is not calibrated, no interval is shown as if it held.
    """
    if as_json:
        say_json(result.to_json())
    else:
        from stemcal.report.tables.terminal import stage_tables

        say(*stage_tables(result, verdict.may_hold))
    if not quiet:
        from stemcal.report.verdict import claims_of, shown_notes

        for sentence in shown_notes(result, verdict.may_hold):
            note(f"note: {sentence}")
        if claims_of(result) and not verdict.holds:
            reasons = [reason for reason in verdict.reasons if reason.rule != "unfinished"] or list(verdict.reasons)
            note(f"note: {verdict.word}: {reasons[0].sentence}.")
    warn_of_runs(result, folder)
    leave_if_failed(result)


def warn_of_runs(results: Results | StageResult, folder: StudyFolder) -> None:
    """Pass on what the solver warned of in the results' runs."""
    from stemcal.report.records import read_records, run_warnings

    for sentence in run_warnings(read_records(results, folder)):
        warn(sentence)


def show_run(results: Results, verdict: Verdict, page: Path, folder: StudyFolder, as_json: bool, quiet: bool) -> None:
    """Print what a whole study came to: parameters, validation, at last the verdict; or all stages as JSON.

    Leaves with exit code 3 if runs failed.
    """
    if as_json:
        stages = {result.name: result.to_json() for result in results.done()}
        told = {"verdict": to_json(verdict), "report": str(page)}
        say_json({"schema_version": 1, "stage": "run", **stages, **told})
    else:
        from stemcal.report.tables.terminal import stage_tables

        shown = [
            result
            for result in (results.inversion, results.refinement, results.mesh, results.validation)
            if result is not None
        ]
        say(*(part for result in shown for part in stage_tables(result, verdict.holds)))
        if not quiet:
            _show_notes(results, verdict)
    warn_of_runs(results, folder)
    failed = warn_of_failed(*results.done())
    if not as_json:
        say(*verdict.lines())
        say_whole(f"Report: {page}")
    if failed:
        raise typer.Exit(SOME_RUNS_FAILED)


def _show_notes(results: Results, verdict: Verdict) -> None:
    from stemcal.report.verdict import shown_notes

    for result in results.done():
        for sentence in shown_notes(result, verdict.holds):
            note(f"{result.name}: {sentence}")


def leave_if_failed(*results: StageResult) -> None:
    """Leave with exit code 3 if any run failed; the failed runs of each stage are counted with their reasons."""
    if warn_of_failed(*results):
        raise typer.Exit(SOME_RUNS_FAILED)


def warn_of_failed(*results: StageResult) -> bool:
    """Count the failed runs of each stage with their reasons; returns whether there are any."""
    any_failed = False
    for result in results:
        outcomes = [outcome for _, outcome in result.runs()]
        failed = [outcome for outcome in outcomes if not outcome.ok]
        if failed:
            any_failed = True
            reasons = Counter(outcome.reason or "no reason given" for outcome in failed)
            listed = ", ".join(f"{reason} ({count})" for reason, count in reasons.items())
            warn(f"{result.name}: {len(failed)} of {len(outcomes)} runs failed: {listed}; see {result.name}.json")
    return any_failed
