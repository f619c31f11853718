"""`stemcal plan`: what would be run, and how long it would take."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stemcal.cli.console import note, say_json, say_tables, warn
from stemcal.cli.options import AsJson, Out, Quiet, Spec, Workers
from stemcal.cli.session import folder_of, opened, read_study
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    from stemcal.files.rows import Table
    from stemcal.overview.identify import Identified
    from stemcal.text.names import Names


def plan(
    spec: Spec,
    identify: Annotated[
        bool,
        typer.Option("--identify", help="Simulate a few runs and foretell what each combination of tests would tell."),
    ] = False,
    specimens: Annotated[
        list[int] | None,
        typer.Option(
            "--specimens", metavar="N", min=2, help="With --identify: specimens of each test; may be repeated."
        ),
    ] = None,
    out: Out = None,
    workers: Workers = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Count the runs of every stage, estimate their cost and tell what the designs can find; compute nothing.

    With --identify it foretells, before anything is measured, how narrow each parameter's interval would become with
    every combination of the spec's tests (of one test, of its diameters), from two runs per factor and one more.

    Example: [bold]stemcal plan configs/wild-chrysanthemum.yaml --workers 8[/bold]
    """
    from stemcal.files.rows import Column, Table
    from stemcal.numbers import duration
    from stemcal.text.names import Names

    if identify:
        _identify(spec, specimens, out, workers, as_json, quiet)
        return
    from stemcal.cli.check import not_ready
    from stemcal.executors.machine import machine_memory
    from stemcal.folder.study_folder import StudyFolder
    from stemcal.overview.foresight import Demand, excess
    from stemcal.overview.plan import plan as make_plan
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


def _identify(
    spec: Path, specimens: list[int] | None, out: Path | None, workers: int | None, as_json: bool, quiet: bool
) -> None:
    from stemcal.overview.identify import SPECIMENS
    from stemcal.overview.identify import identify as foretell
    from stemcal.solvers import make_solver
    from stemcal.stages.work import Work
    from stemcal.text.identification import remarks
    from stemcal.text.names import Names

    with opened(spec, out, workers, "local", quiet) as session:
        work = Work(session.study, session.folder, session.executor, session.watch, make_solver(session.study))
        found = foretell(work, specimens or SPECIMENS)
    names = Names(session.study.naming)
    if as_json:
        say_json(to_json(found))
    else:
        say_tables(_intervals(found, names))
    if not quiet:
        for said in remarks(found, names):
            note(f"note: {said}")


def _intervals(found: Identified, names: Names) -> Table:
    """Return a row per combination and number of specimens, with the expected interval of each factor."""
    from stemcal.files.rows import Column, Table
    from stemcal.numbers import unit_written
    from stemcal.text.identification import expected, foot, place

    columns = [
        Column("tests", "Measured"),
        Column("specimens", "n", form=format),
        *(Column(step.factor, names.factor(step.factor), unit_written(step.unit), str) for step in found.steps),
    ]
    rows = [
        (place(one.tests, one.conditions, names), one.specimens, *map(expected, one.parameters))
        for one in found.combinations
    ]
    return Table(tuple(columns), tuple(rows), f"Expected 95 % intervals of {found.study}", tuple(foot(found, names)))
