"""`stemcal export deck` and `stemcal export material`: shear tests and material cards for LS-DYNA and OpenRadioss."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from stemcal.cli.console import note, say_json, say_tables, warn
from stemcal.cli.session import AsJson, ExecutorName, Out, Quiet, Spec, Workers, opened, study_or_exit
from stemcal.cli.simulate import Diameter, Settings, chosen_levels, require_material
from stemcal.errors import RunsFailed, UsageError
from stemcal.storage.atomic import make_folder, write_atomic
from stemcal.storage.typed import to_json

if TYPE_CHECKING:
    from stemcal.solvers.deck import Deck
    from stemcal.stages.element_size import SizedStrain
    from stemcal.study.model.study import Study

RADIOSS = ".rad"


def export_deck(
    spec: Spec,
    path: Annotated[
        Path,
        typer.Argument(
            metavar="PATH", help="Deck file with extension `.k` (LS-DYNA) or `.rad` (OpenRadioss).", show_default=False
        ),
    ],
    program: Annotated[
        Literal["lsdyna", "openradioss"] | None,
        typer.Option("--for", help="Solver for which the deck is written.", show_default="from study or file name"),
    ] = None,
    diameter: Diameter = None,
    settings: Settings = None,
    out: Out = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write the shear test as a deck for LS-DYNA or OpenRadioss.

    The deck contains the calibrated value of each factor, or the mid-range value if the study is not calibrated. For a
    deck file with the extension `.rad`, the command also writes the starter and engine files of OpenRadioss. The units
    of the deck are mm, tonne, s, N and MPa.

    Example: [bold]stemcal export deck configs/wild-chrysanthemum.yaml run.k --for lsdyna[/bold]
    """
    from stemcal.solvers.deck import Deck, DeckForm, deck_text
    from stemcal.solvers.deck.keywords import form_of
    from stemcal.study.reading.messages import typed_size

    study = study_or_exit(spec)
    chosen = _program_of(study, path, program)
    study, levels = _calibrated(study, chosen, out)
    levels = chosen_levels(study, levels, settings or [])
    at = study.specimen.outer_diameter if diameter is None else typed_size(diameter, "--diameter")
    size = 0.0 if study.solver.mesh is None else study.solver.mesh.element_size.at(at)
    if at < 2 * size:
        raise UsageError(f"--diameter {at:g}: less than twice the element size of {size:g} mm; use a larger diameter")
    require_material(study, levels, at)
    if not path.absolute().parent.is_dir():
        raise UsageError(f"{path}: the folder {path.parent} does not exist; create the folder first")
    form = form_of(study) if study.kind.writes_decks else DeckForm(chosen, lengths=True)
    deck = Deck.of(study, levels, at, form)
    texts = _files(deck, path, deck_text(deck))
    for file, text in texts.items():
        write_atomic(file, text)
    if as_json:
        say_json({"files": [str(file) for file in texts], "levels": levels, "otherwise": deck.notes})
    if not quiet:
        for sentence in deck.notes:
            warn(sentence)
        for file in texts:
            note(f"wrote {file}")


def _program_of(study: Study, path: Path, requested: str | None) -> Literal["lsdyna", "openradioss"]:
    """Return the program for which the deck is written; `UsageError` if unknown, or not that of file name or study."""
    own = study.solver.program_name if study.kind.writes_decks else None
    chosen = requested or ("openradioss" if path.suffix == RADIOSS else own)
    if chosen == "lsdyna" and path.suffix == RADIOSS:
        raise UsageError(f"{path}: LS-DYNA cannot read {RADIOSS} files; name the deck {path.stem}.k")
    if own is not None and chosen != own:
        raise UsageError(
            f"--for {chosen}: the study is calibrated for {own}, and the calibrated values do not apply to {chosen}. "
            f"Use `--for {own}`, or calibrate for {chosen}: write `solver: {{kind: deck, program: {chosen}}}` and run "
            "`stemcal run SPEC`"
        )
    if chosen is None:
        raise UsageError(f"{path}: the target program is unknown; add `--for lsdyna` or `--for openradioss`")
    return "lsdyna" if chosen == "lsdyna" else "openradioss"


def _calibrated(study: Study, program: str, out: Path | None) -> tuple[Study, dict[str, float]]:
    """Return study and levels for a deck: the levels refined with the program, else calibrated, else mid-range ones."""
    from stemcal.runs.study_folder import StudyFolder, place_of
    from stemcal.stages.refine.result import RefineResult
    from stemcal.stages.results import fresh_results

    place = place_of(study.name, out)
    if place.is_dir():
        results = fresh_results(study, StudyFolder(place))
        for sentence in results.stale:
            warn(sentence)
        there, refined = study.there, results.of(RefineResult)
        if refined is not None and there.solver.program_name == program:
            return there, {**study.midlevels(), **refined.parameters}
        if results.calibrated:
            return study, {**study.midlevels(), **results.parameters}
    warn("The study is not calibrated yet, so factors not specified with `--set` have mid-range values.")
    return study, dict(study.midlevels())


def _files(deck: Deck, path: Path, text: str) -> dict[Path, str]:
    """Return the texts of the files to write by path: the deck and, if needed, the starter and engine files."""
    from stemcal.solvers.deck.writer import engine_text, starter_around

    is_radioss = path.suffix == RADIOSS
    name = path.stem.removesuffix("_0000") if is_radioss else path.stem
    keyword_deck = path.with_name(f"{name}.k") if is_radioss else path
    if not is_radioss and (deck.form.for_ls_dyna or not deck.nonlocal_lengths):
        return {keyword_deck: text}
    return {
        keyword_deck: text,
        path.with_name(f"{name}_0000{RADIOSS}"): starter_around(keyword_deck.name, deck.nonlocal_lengths),
        path.with_name(f"{name}_0001{RADIOSS}"): engine_text(deck, name),
    }


_COARSEST = 0.5  # largest element size, in units of the diameter


def export_material(
    spec: Spec,
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder for the output files.", show_default=False)],
    program: Annotated[
        Literal["lsdyna", "openradioss"],
        typer.Option("--for", help="Solver for which the material card is written.", show_default=False),
    ],
    element_size: Annotated[
        str,
        typer.Option(
            "--element-size", metavar="LENGTH", help="Element size of your finite element model.", show_default=False
        ),
    ],
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write a material card for a model with the given element size.

    If each element fails independently of its neighbours, the simulated force depends on the element size and on the
    position of the mesh relative to the blade. The command adjusts the failure strain until the mean of the forces
    simulated at several mesh positions equals the target force. Before you use this command, run the
    calibration with `stemcal run SPEC`.

    Example: [bold]stemcal export material configs/smoke.yaml material --for lsdyna --element-size "2 mm"[/bold]
    """
    from stemcal.solvers import make_solver
    from stemcal.stages.element_size import strain_of, strain_table
    from stemcal.stages.work import Work
    from stemcal.study.reading.messages import typed_size

    size = typed_size(element_size, "--element-size")
    with opened(spec, out, workers, executor, quiet) as session:
        study = session.study
        at = study.targets.calibrate_at
        if study.is_layered:
            message = "a material card is of a stem without `layers` and `transverse`; use `stemcal export deck`"
            raise UsageError(message)
        if size > _COARSEST * at:
            most = f"Use at most {_COARSEST * at:g} mm."
            raise UsageError(f"--element-size: {size:g} mm is too large for a stem diameter of {at:g} mm. {most}")
        work = Work(study, session.folder, session.executor, session.watch, make_solver(study))
        strain = strain_of(work, size)
    if not as_json:
        say_tables(strain_table(strain))
    written = _written(study, strain, program, folder)
    if as_json:
        say_json(written)
    elif not quiet:
        for name in written["files"]:
            note(f"wrote {folder / name}")


def _written(study: Study, strain: SizedStrain, program: str, folder: Path) -> dict[str, Any]:
    from stemcal.report.records import spec_hash
    from stemcal.solvers.deck import Deck, DeckForm
    from stemcal.solvers.deck.writer import material_text
    from stemcal.solvers.embedded import meshed_as
    from stemcal.stages.element_size import material_lines, not_valid, without_lengths
    from stemcal.version import __version__

    if not strain.valid:
        raise RunsFailed(f"export material: {not_valid(strain)}")
    make_folder(folder)
    form = DeckForm("lsdyna" if program == "lsdyna" else "openradioss")
    sized = meshed_as(without_lengths(study), strain.element_size)
    deck = Deck.of(sized, strain.levels, strain.condition, form)
    files = {"material.k": material_text(deck, material_lines(study, strain))}
    content = {
        "schema_version": 2,
        "stage": "material",
        "study": study.name,
        "spec_sha256": spec_hash(study),
        "stemcal_version": __version__,
        "program": program,
        "parameters": strain.levels,
        **{name: value for name, value in to_json(strain).items() if name != "levels"},
        "files": [*files, "material.json"],
    }
    for name, text in (files | {"material.json": json.dumps(content, indent=2) + "\n"}).items():
        write_atomic(folder / name, text)
    return content
