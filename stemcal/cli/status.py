"""`stemcal status`: the progress and the verdict of a study, its runs, its failed runs, and the check of its files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stemcal.cli.console import fail, say_json, say_tables, say_whole
from stemcal.cli.session import AsJson, Out, Spec, existing_folder, study_or_exit
from stemcal.formats import counted, series, short
from stemcal.storage.encodings import in_a_line
from stemcal.storage.typed import to_json

if TYPE_CHECKING:
    from stemcal.overview.status import StageStatus, Status
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.stages.ledger import LedgerRow
    from stemcal.study.model.study import Study
    from stemcal.vocabulary import Wording

_MOST_NAMES = 20


def status(
    spec: Spec,
    runs: Annotated[bool, typer.Option("--runs", help="List all runs with their status and results.")] = False,
    failed: Annotated[bool, typer.Option("--failed", help="List the failed runs.")] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Check whether any file has changed (exit code 1 if so).")
    ] = False,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Show the progress, the failed runs and the verdict of a study.

    You can use this command while the study is running. To repeat failed runs, use `stemcal run SPEC --retry`. Runs
    with damaged records are repeated automatically by `stemcal run SPEC`.

    Example: [bold]stemcal status configs/smoke.yaml --failed[/bold]
    """
    study = study_or_exit(spec)
    folder = existing_folder(study, out)
    result: dict[str, Any] = {}
    if not runs and not failed and not verify:
        result = _progress(study, folder, as_json)
    if runs or failed:
        result = _runs(study, folder, failed, as_json)
    sound = True
    if verify:
        from stemcal.overview.status import inspect

        count, damaged = inspect(study, folder)
        sound = not damaged
        result = {**result, "verify": {"ok": sound, "records": count, "damaged": damaged}}
        if not as_json:
            intact = count - sum(file.startswith("runs/") for file in damaged)
            say_whole(f"{folder.path}: {intact} of {count} records are intact.")
        for file, problem in islice(damaged.items(), _MOST_NAMES):
            fail(f"{file} {problem}")
    if as_json:
        say_json(result)
    if not sound:
        raise typer.Exit(1)


def _progress(study: Study, folder: StudyFolder, as_json: bool) -> dict[str, Any]:
    from stemcal.by_hand.own_sheet import awaiting_sheet
    from stemcal.drawing.table import Column, Table
    from stemcal.overview.status import stage_states as count
    from stemcal.stages.verdict.words import verdict_json
    from stemcal.vocabulary import Wording

    progress, names = count(study, folder), Wording(study.naming)
    if any(stage.left != 0 for stage in progress.stages):
        progress = replace(progress, sheet=awaiting_sheet(study, folder))
    if not as_json:
        heads = {"rows": "Runs", "done": "Done", "failed": "Failed", "left": "Left"}
        # a number is None as long as the runs depend on the result of an earlier stage
        counts = (Column(key, head, form=lambda n: "?" if n is None else str(n)) for key, head in heads.items())
        columns = [Column("stage", "Stage"), Column("file", "File"), *counts]
        say_tables(Table.of(columns, progress.stages, f"Study {progress.study}", state(progress, names)))
    return {**to_json(progress), **verdict_json(progress.verdict, names)}


def state(progress: Status, names: Wording) -> list[str]:
    """Return sentences on the running process, failed runs, out-of-date stages, and the verdict with its reasons."""
    from stemcal.stages.verdict.words import in_full
    from stemcal.vocabulary import capital

    stages = [line for stage in progress.stages for line in _remarks(stage)]
    if progress.sheet is not None:
        stages.append(f"Waiting for results. Fill in {progress.sheet}. Then run `stemcal run SPEC`.")
    working = progress.working or "no process is working on this study"
    return [f"{capital(working)}.", *stages, *in_full(progress.verdict, names)]


def _remarks(stage: StageStatus) -> Iterator[str]:
    name = stage.stage
    if stage.reasons:
        why = ", ".join(f"{reason} ({count})" for reason, count in stage.reasons.items())
        yield f"{name}: some runs failed: {why}; `stemcal status SPEC --failed` lists the failed runs."
    if stage.censored:
        few = counted(stage.censored, "response")
        yield f"{name}: {few} may be too low because the stroke ended before the force had clearly passed its maximum."
    if stage.damaged:
        yield (
            f"{name}: {counted(stage.damaged, 'damaged record')}; `stemcal run SPEC` repeats "
            f"{'the run' if stage.damaged == 1 else 'these runs'}."
        )
    if stage.changed:
        yield f"{name}.json is out of date: {', '.join(stage.changed)} changed after {name}.json was written."


def _runs(study: Study, folder: StudyFolder, failed: bool, as_json: bool) -> dict[str, Any]:
    from stemcal.report.study_tables import runs_table
    from stemcal.stages.ledger import ledger
    from stemcal.vocabulary import Wording

    entries, names = ledger(study, folder), Wording(study.naming)
    listed = [entry for entry in entries if not failed or entry.status == "failed"]
    if not as_json and failed:
        say_whole(*_failures(listed, names) or ["No run has failed."])
    elif not as_json:
        say_tables(runs_table(listed, names, f"Runs of study {study.name}"))
    return {"study": study.name, "naming": to_json(study.naming), "runs": to_json(listed)}


def _failures(failed: Iterable[LedgerRow], names: Wording) -> list[str]:
    runs: dict[str, list[LedgerRow]] = {}
    for entry in failed:
        runs.setdefault(entry.key, []).append(entry)
    lines = []
    for first, *more in runs.values():
        numbers = list(dict.fromkeys(entry.run for entry in (first, *more)))
        levels = ", ".join(f"{name}={short(value)}" for name, value in first.levels.items())
        where = f"{first.stage} {'run' if len(numbers) == 1 else 'runs'} {series(numbers)}"
        lines.append(f"{where}{names.at(first.condition)} ({levels}): {in_a_line(f'{first.reason}: {first.message}')}")
    return lines
