"""How a finished stage is shown, and the exit code when some of its runs failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from stemcal.cli.console import note, say, say_json, warn
from stemcal.cli.session import failed_runs, runs_of

if TYPE_CHECKING:
    from stemcal.study.store import StudyFolder

SOME_RUNS_FAILED = 3


def show_stage(stage: dict[str, Any], folder: StudyFolder, as_json: bool, quiet: bool) -> None:
    """Print a stage's tables (or its JSON) on stdout, warnings and notes on stderr; leave with 3 if runs failed."""
    if as_json:
        say_json(stage)
    else:
        from stemcal.report.tables import stage_tables

        say(*stage_tables(stage))
    if not quiet:
        for sentence in stage.get("notes", []):
            note(f"note: {sentence}")
    warn_of_runs([stage], folder)
    leave_if_failed(stage)


def warn_of_runs(stages: Iterable[dict[str, Any]], folder: StudyFolder) -> None:
    """Pass on what the solver warned of in the stages' runs."""
    from stemcal.report.records import read_records, run_warnings

    for sentence in run_warnings(read_records(stages, folder)):
        warn(sentence)


def show_run(stages: dict[str, dict[str, Any]], page: Path, as_json: bool, quiet: bool) -> None:
    """Print what a whole study came to: calibrated parameters and validation, or all stages as JSON."""
    if as_json:
        say_json({"schema_version": 1, "stage": "run", **stages, "report": str(page)})
        return
    from stemcal.report.tables import stage_tables

    shown = [stages[name] for name in ("invert", "refine", "validate") if name in stages]
    say(*(part for stage in shown for part in stage_tables(stage)), f"Report: {page}")
    if not quiet:
        for name, stage in stages.items():
            for sentence in stage.get("notes", []):
                note(f"{name}: {sentence}")


def leave_if_failed(*stages: dict[str, Any]) -> None:
    """Count the failed runs of each stage with their reasons; leave with exit code 3 if there are any."""
    any_failed = False
    for stage in stages:
        failed, total = failed_runs(stage), len(runs_of(stage))
        if failed:
            any_failed = True
            reasons = Counter(run.get("reason") or "no reason given" for run in failed)
            listed = ", ".join(f"{reason} ({count})" for reason, count in reasons.items())
            warn(f"{stage['stage']}: {len(failed)} of {total} runs failed: {listed}; see {stage['stage']}.json")
    if any_failed:
        raise typer.Exit(SOME_RUNS_FAILED)
