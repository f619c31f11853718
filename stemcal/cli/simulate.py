"""`stemcal simulate`: one virtual test, or one run of the external program in a spec."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stemcal.cli.console import note, say, say_json, waiting, warn
from stemcal.cli.session import AsJson, Quiet, Spec, study_or_exit
from stemcal.errors import RunsFailed, UsageError
from stemcal.formats import did_you_mean
from stemcal.storage.atomic import write_atomic
from stemcal.storage.encodings import csv_text
from stemcal.storage.typed import from_json, to_json

if TYPE_CHECKING:
    from stemcal.cutting.result import CuttingResult
    from stemcal.solvers.protocol import Answer
    from stemcal.study.model.laboratory_kind import LaboratorySection
    from stemcal.study.model.study import Study

CUTTING = "cutting"  # name of the main shear test of a spec

Diameter = Annotated[str | None, typer.Option(metavar="MM", help="Diameter of the stem.", show_default="the spec's")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="FACTOR=VALUE", help="Factor value in the unit given in the spec (can be repeated)."),
]
_CsvFile = Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="CSV file for the time history.")]
_FigureFile = Annotated[
    Path | None,
    typer.Option("--figure", metavar="FILE", help="File for the force–travel plot (`.png`, `.svg` or `.pdf`)."),
]
_FramesFolder = Annotated[
    Path | None,
    typer.Option("--frames", metavar="DIR", help="Folder for about 50 simulation frames in ParaView format."),
]
_TestName = Annotated[str | None, typer.Option("--test", metavar="NAME", help="Name of a test.", show_default=CUTTING)]


def simulate(
    spec: Spec,
    diameter: Diameter = None,
    settings: Settings = None,
    csv_file: _CsvFile = None,
    figure: _FigureFile = None,
    frames: _FramesFolder = None,
    test: _TestName = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the virtual shear test or another test defined in the spec.

    If the study uses an external simulation program, the command runs this program once. Factors that are not
    specified with `--set` are set to their mid-range values.

    Example: [bold]stemcal simulate configs/smoke.yaml --diameter 7 --set yield_stress=18[/bold]
    """
    from stemcal.study.reading.messages import typed_size

    study = study_or_exit(spec)
    at = study.specimen.outer_diameter if diameter is None else typed_size(diameter, "--diameter")
    levels = chosen_levels(study, study.midlevels(), settings or [])
    require_material(study, levels, at)
    _check_outputs(study, csv_file, figure, frames)

    if not study.kind.simulates_stems and test in (None, CUTTING):
        at = study.targets.calibrate_at if diameter is None else at
        _one_run(study, levels, at, as_json, quiet, csv_file)
        return
    section = None if test in (None, CUTTING) else _section_called(study, test)
    from stemcal.fem.warm import is_compiled
    from stemcal.overview.foresight import demand_of_one, warnings_before
    from stemcal.report.progress import COMPILING
    from stemcal.solvers.embedded import simulate_levels as simulated

    cuts = section is None or section.is_further_cut
    alone = study.cut_as(section, at) if section is not None and cuts else study
    for sentence in warnings_before(demand_of_one(alone, [at]), 1):
        warn(sentence)
    if not is_compiled(study.is_layered) and not quiet:
        note(COMPILING)
    with waiting("one virtual shear test" if section is None else f"virtual test {test}", quiet):
        result = simulated(study, levels, at, frames=frames, section=section)
    if csv_file:
        columns = vars(result.history)  # in s, mm, N, mJ
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        write_atomic(csv_file, csv_text([columns, *rows], newline="\r\n"))
    if figure:
        _draw_force(result, figure, cuts)
    if as_json:
        say_json(summary(result, at, test or CUTTING, [response.name for response in study.naming.further]))
    else:
        from stemcal.report.terminal import simulation_table

        say(simulation_table(result, section, at))
    for warning in result.warnings:
        warn(str(warning))
    if not quiet:
        for path in (csv_file, figure, frames):
            if path:
                note(f"wrote {path}")


def _section_called(study: Study, test: str) -> LaboratorySection:
    section = next((section for section in study.tests if section.name == test), None)
    if section is None:
        known = [CUTTING, *(section.name for section in study.tests)]
        raise UsageError(f"--test {test[:60]!r}: no test has this name; {did_you_mean(test, known)}")
    return section


def _draw_force(result: CuttingResult, path: Path, of_blade: bool) -> None:
    from stemcal.drawing.style import save
    from stemcal.report.curves import force_travel
    from stemcal.report.records import RunCurve

    travel, history = tuple(result.history.travel.tolist()), result.history
    forces = {"contact force": history.force, "filtered": history.force_filtered}
    curves = {name: RunCurve(travel, tuple(force.tolist()), result.break_travel) for name, force in forces.items()}
    save(force_travel(curves, highlighted=["filtered"], of_blade=of_blade), path)


def chosen_levels(study: Study, start: Mapping[str, float], settings: list[str]) -> dict[str, float]:
    """Return the levels `start` of all factors, changed by the settings (texts ``FACTOR=VALUE``)."""
    from stemcal.study.reading.messages import level_of

    levels = dict(start)
    for setting in settings:
        name, equals, text = setting.partition("=")
        name = name.strip()
        if not equals:
            raise UsageError(f"--set {setting}: write the setting as FACTOR=VALUE")
        if name not in levels:
            raise UsageError(f"--set {setting}: no factor is named {name!r}; {did_you_mean(name, levels)}")
        levels[name] = level_of(study.factor(name), text.strip())
    return levels


def require_material(study: Study, levels: Mapping[str, float], diameter: float) -> None:
    """Raise `UsageError` if a material cannot have these levels at this stem diameter (mm)."""
    from stemcal.study.rules.factors import wrong_levels

    if wrong := list(wrong_levels(study, levels, diameter)):
        raise UsageError("\n".join(wrong))


def _check_outputs(study: Study, csv_file: Path | None, figure: Path | None, frames: Path | None) -> None:
    options = [name for name, path in {"--frames": frames, "--figure": figure}.items() if path is not None]
    if options and not study.kind.simulates_stems:
        these = "this option" if len(options) == 1 else "these options"
        raise UsageError(f"{', '.join(options)}: available only with `solver: {{kind: embedded}}`; omit {these}")
    for path in (csv_file, figure):
        if path and not path.parent.is_dir():
            raise UsageError(f"{path}: the folder {path.parent} does not exist; create the folder first")
    if figure and figure.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise UsageError(f"--figure {figure}: the name must end in .png, .svg or .pdf")


def summary(result: CuttingResult, diameter: float, test: str = CUTTING, measured: Iterable[str] = ()) -> object:
    """Return the numbers of a result as JSON values, with the responses in `measured` that other packages define."""
    from stemcal.laboratory.perform import LaboratoryResult
    from stemcal.responses import CUT, ForceTravel, responses_in

    numbers = {name: value for name, value in vars(result).items() if isinstance(value, bool | int | float)}
    if isinstance(result, LaboratoryResult):
        responses = result.responses
    else:
        curve = result.history.travel, result.history.force_filtered
        cut = ForceTravel(*curve, result.peak_force, result.peak_travel, diameter, CUT, vars(result))
        table = responses_in(CUT, measured=measured)
        responses = {response.name: value for response in table if (value := response.value(cut)) is not None}
    return {"test": test, "responses": responses, **numbers, "warnings": to_json(result.warnings)}


def _one_run(
    study: Study, levels: Mapping[str, float], at: float, as_json: bool, quiet: bool, csv_file: Path | None
) -> None:
    from stemcal.notes import Note
    from stemcal.runs.answer import Batch
    from stemcal.runs.executors.local import LocalExecutor
    from stemcal.runs.record import Run
    from stemcal.solvers import make_solver
    from stemcal.solvers.protocol import Request

    if study.kind.answers != "computes":
        raise UsageError(
            f"`simulate` requires `solver: {{kind: embedded}}` or an external program; the solver kind of this spec "
            f"is `{study.solver.kind}`"
        )
    solver = make_solver(study)
    solver.prepare()
    run, limit = Run.of(solver, Request("simulate", 0, dict(levels), at)), study.solver.run_limit
    with waiting(f"one run of the {study.solver.kind} solver", quiet), LocalExecutor(1, limit) as executor:
        [(_, (answer, _))] = Batch([run], executor).arriving()
    if as_json:
        say_json(vars(answer))
    if answer.response is None:
        raise RunsFailed(f"the run failed ({answer.reason}): {answer.message}")
    if not as_json:
        say("\n".join(_lines(study, answer)))
    for warning in answer.details.get("warnings", []):
        warn(str(from_json(Note, warning)))
    if csv_file:
        if (curve := answer.details.get("curve")) is None:
            raise UsageError("--csv: the program returns no force–travel curve; omit the option")
        rows = zip(curve["travel"], curve["force"], strict=True)
        write_atomic(csv_file, csv_text([["travel", "force"], *rows], newline="\r\n"))
        if not quiet:
            note(f"wrote {csv_file}")


def _lines(study: Study, answer: Answer) -> list[str]:
    from stemcal.solvers.protocol import RESPONSES

    naming, details = study.naming, answer.details
    values = {naming.response.name: answer.response, **details.get(RESPONSES, {})}
    lines = [f"{naming.named(name).label}: {naming.named(name).text(value, '.4g')}" for name, value in values.items()]
    if "peak_travel" in details:
        lines.append(f"travel at maximum force: {details['peak_travel']:.3f} mm")
    if "deleted_in_all" in details:
        at_maximum, total = details["deleted_elements"], details["deleted_in_all"]
        lines.append(f"deleted elements: {at_maximum} at maximum force, {total} in total")
    return lines
