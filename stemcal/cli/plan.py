"""`stemcal plan`: what would be run, and how long it would take."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stemcal.cli.console import note, say_json, say_tables, warn
from stemcal.cli.options import AsJson, Out, Quiet, Spec, Workers
from stemcal.cli.session import folder_of, read_study
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    pass


def plan(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Count the runs of every stage, and estimate time and memory; compute nothing.

    Example: [bold]stemcal plan configs/wild-chrysanthemum.yaml --workers 8[/bold]
    """
    from stemcal.cli.check import not_ready
    from stemcal.executors.machine import machine_memory
    from stemcal.files.rows import Column, Table
    from stemcal.folder.study_folder import StudyFolder
    from stemcal.numbers import duration
    from stemcal.overview.foresight import Demand, excess
    from stemcal.overview.plan import plan as make_plan
    from stemcal.text.names import Names
    from stemcal.text.notes import sentences
    from stemcal.text.plan import total

    study = read_study(spec)
    path = folder_of(study, out)
    found = make_plan(study, StudyFolder(path) if path.is_dir() else None, workers=workers)
    if as_json:
        say_json(to_json(found))
    else:
        timed = any(stage.seconds is not None for stage in found.stages)
        columns = (
            Column("stage", "Stage"),
            Column("rows", "Runs", form=format),
            Column("recorded", "Recorded", form=format),
            Column("to_run", "To compute", form=format),
            *([Column("seconds", "On one core", form=duration)] if timed else []),
        )
        say_tables(Table.of(columns, found.stages, f"Plan of {found.study}", [" ".join(total(found))]))
    demand = Demand(found.to_run, found.seconds or 0.0, found.memory or 0.0)
    for sentence in [*sentences(excess(demand, found.workers, machine_memory())), *not_ready(study)]:
        warn(sentence)
    if not quiet:
        for said in sentences(found.notes, Names(study.naming)):
            note(f"note: {said}")
