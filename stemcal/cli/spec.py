"""`stemcal init` writes a commented spec; `stemcal check` lists its errors, or estimates its runs and their time."""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stemcal.cli.console import note, route_log, say_json, say_tables, say_whole, warn
from stemcal.cli.session import AsJson, Out, Spec, Workers
from stemcal.errors import SpecError, UsageError

if TYPE_CHECKING:
    from stemcal.overview.plan import Plan
    from stemcal.study.model.study import Study

_MORE = "# ---- "  # marks where the optional part of the template begins, which only --full writes


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the study and of its spec file.")] = "my-study",
    full: Annotated[
        bool, typer.Option("--full", help="Also write all optional keys with their default values.")
    ] = False,
) -> None:
    """Write a commented spec as a starting point for a new study.

    The command writes `NAME.yaml` and does not overwrite an existing file.

    Example: [bold]stemcal init my-stems[/bold]
    """
    stem = Path(name).name.removesuffix(".yaml").removesuffix(".yml")
    path = Path(name).with_name(f"{stem}.yaml")
    text = spec_text(stem, full)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError as error:  # the spec, or a file in place of a folder above it
        raise UsageError(f"{error.filename} already exists; choose another name or delete the file first") from None
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; choose another folder") from None
    say_whole(str(path))
    typed = f'"{path}"' if " " in str(path) else path
    note("edit the file, then run:")
    for verb in ("check", "run"):
        note(f"  stemcal {verb} {typed}")


def spec_text(name: str, full: bool = False) -> str:
    """Return a commented spec for a study of this name; raise `UsageError` if the name is not valid."""
    from stemcal.study.reading.messages import checked
    from stemcal.study.types.field_types import StudyName

    checked(StudyName, name, "NAME")
    text = files("stemcal.cli").joinpath("study.yaml").read_text(encoding="utf-8")
    text = text.replace("@NAME@", json.dumps(name, ensure_ascii=False), 1)
    return text if full else text[: text.index(_MORE)]


def check(spec: Spec, out: Out = None, workers: Workers = None, as_json: AsJson = False) -> None:
    """Check a spec and estimate the number of runs and the computing time.

    No simulation is run, and no file is written. The estimated time excludes runs that are already recorded.

    Example: [bold]stemcal check my-study.yaml[/bold]
    """
    from stemcal.overview.foresight import Demand, beforehand, demand_of_one, excess
    from stemcal.overview.plan import plan
    from stemcal.runs.executors import machine_memory
    from stemcal.runs.study_folder import StudyFolder, place_of
    from stemcal.storage.typed import to_json
    from stemcal.study.reading import load_study

    route_log()
    try:
        study = load_study(spec)
    except SpecError as error:
        if as_json:
            say_json({"ok": False, "problems": [asdict(problem) for problem in error.problems]})
        raise
    before, memory = list(beforehand(study)), machine_memory()
    conditions = [study.targets.calibrate_at, *(target.condition for target in study.targets.means)]
    too_much = excess(demand_of_one(study, conditions), 1, memory)
    warnings = [
        *study.warnings,
        *_not_ready(study),
        *map(str, too_much),
        *(str(remark) for remark in before if remark.severity == "warning"),
    ]
    estimate = None
    if not too_much:  # `plan` builds the mesh, which then would need too much memory
        path = place_of(study.name, out)
        estimate = plan(study, StudyFolder(path) if path.is_dir() else None, workers=workers)
        demand = Demand(estimate.to_run, estimate.seconds or 0.0, estimate.memory or 0.0)
        warnings += map(str, excess(demand, estimate.workers, memory))
    remarks = [str(remark) for remark in before if remark.severity != "warning"]
    remarks += map(str, estimate.notes) if estimate else ()
    if as_json:
        details = {"warnings": warnings, "remarks": remarks, "plan": None if estimate is None else to_json(estimate)}
        say_json({"ok": True, "problems": [], **details})
    else:
        count = f", {len(warnings)} warning{'s' * (len(warnings) > 1)}" if warnings else ""
        say_whole(f"{spec}: OK{count}. {study}.")
    for sentence in warnings:
        warn(sentence)
    if not as_json and estimate is not None:
        _say_plan(estimate)
    for sentence in remarks:
        note(f"note: {sentence}")


def _say_plan(estimate: Plan) -> None:
    from stemcal.drawing.table import Column, Table
    from stemcal.formats import duration, in_bytes
    from stemcal.overview.plan import total

    timed = any(stage.seconds is not None for stage in estimate.stages)
    weighed = any(stage.memory for stage in estimate.stages)
    columns = (
        Column("stage", "Stage"),
        Column("rows", "Runs", form=format),
        Column("recorded", "Recorded", form=format),
        Column("to_run", "To compute", form=format),
        *([Column("seconds", "On one core", form=duration)] if timed else []),
        *([Column("memory", "Memory per run", form=in_bytes)] if weighed else []),
    )
    say_tables(Table.of(columns, estimate.stages, f"Runs of {estimate.study}", [" ".join(total(estimate))]))


def _not_ready(study: Study) -> list[str]:
    if not study.kind.starts_program:
        return []
    from stemcal.solvers import make_solver

    try:
        make_solver(study).prepare()
    except UsageError as error:
        return [f"no run can start on this machine: {line}" for line in str(error).splitlines()]
    return []
