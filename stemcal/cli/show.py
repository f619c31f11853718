"""How a finished stage is shown, and the exit code when some of its runs failed."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from stemcal.cli.console import note, say, say_json, warn

if TYPE_CHECKING:
    from stemcal.folder.store import StudyFolder
    from stemcal.stages.result import StageResult
    from stemcal.stages.results import Results

SOME_RUNS_FAILED = 3


def show_stage(result: StageResult, folder: StudyFolder, as_json: bool, quiet: bool) -> None:
    """Print a stage's tables (or its JSON) on stdout, warnings and notes on stderr; leave with 3 if runs failed."""
    if as_json:
        say_json(result.to_json())
    else:
        from stemcal.report.tables.terminal import stage_tables

        say(*stage_tables(result))
    if not quiet:
        for sentence in result.notes:
            note(f"note: {sentence}")
    warn_of_runs(result, folder)
    leave_if_failed(result)


def warn_of_runs(results: Results | StageResult, folder: StudyFolder) -> None:
    """Pass on what the solver warned of in the results' runs."""
    from stemcal.report.records import read_records, run_warnings

    for sentence in run_warnings(read_records(results, folder)):
        warn(sentence)


def show_run(results: Results, page: Path, as_json: bool, quiet: bool) -> None:
    """Print what a whole study came to: calibrated parameters and validation, or all stages as JSON."""
    if as_json:
        stages = {result.name: result.to_json() for result in results.done()}
        say_json({"schema_version": 1, "stage": "run", **stages, "report": str(page)})
        return
    from stemcal.report.tables.terminal import stage_tables

    shown = [result for result in (results.inversion, results.refinement, results.validation) if result is not None]
    say(*(part for result in shown for part in stage_tables(result)), f"Report: {page}")
    if not quiet:
        for result in results.done():
            for sentence in result.notes:
                note(f"{result.name}: {sentence}")


def leave_if_failed(*results: StageResult) -> None:
    """Count the failed runs of each stage with their reasons; leave with exit code 3 if there are any."""
    any_failed = False
    for result in results:
        outcomes = [outcome for _, outcome in result.runs()]
        failed = [outcome for outcome in outcomes if not outcome.ok]
        if failed:
            any_failed = True
            reasons = Counter(outcome.reason or "no reason given" for outcome in failed)
            listed = ", ".join(f"{reason} ({count})" for reason, count in reasons.items())
            warn(f"{result.name}: {len(failed)} of {len(outcomes)} runs failed: {listed}; see {result.name}.json")
    if any_failed:
        raise typer.Exit(SOME_RUNS_FAILED)
