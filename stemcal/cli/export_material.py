"""`stemcal export material`: the calibrated material for a model with its own elements."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from stemcal.cli.console import note, say_json, say_tables
from stemcal.cli.session import AsJson, ExecutorName, Out, Quiet, Spec, Workers, opened
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.durable import make_folder, write_atomic
from stemcal.files.typed import to_json

if TYPE_CHECKING:
    from stemcal.solvers.deck import Deck
    from stemcal.stages.refine.element_size import SizedStrain, SizedStrains
    from stemcal.study.model import Study

_COARSEST = 0.5  # of the diameter

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder for the files.", show_default=False)]
Program = Annotated[
    Literal["lsdyna", "openradioss"],
    typer.Option("--for", help="Program: *MAT_003 (lsdyna) or *MAT_024.", show_default=False),
]
Sizes = Annotated[
    list[str],
    typer.Option(
        "--element-size",
        metavar="LENGTH",
        help="Element size of your model; repeatable.",
        show_default=False,
    ),
]


def export_material(
    spec: Spec,
    folder: Folder,
    program: Program,
    element_size: Sizes,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write the material card for your own model and its element size.

    If each element fails by itself, the force depends on the element size and on the position of the mesh. The failure
    strain is adjusted until the mean force over several positions is the calibrated force. The card is for the first
    --element-size; with several sizes a curve is written too. Run `stemcal run SPEC` first.

    Example: [bold]stemcal export material configs/smoke.yaml material --for lsdyna --element-size "2 mm"[/bold]
    """
    from stemcal.solvers import make_solver
    from stemcal.stages.refine.element_size import strains_of
    from stemcal.stages.refine.showing import strain_table
    from stemcal.stages.work import Work
    from stemcal.study.reading.checked import typed_size

    sizes = [typed_size(text, "--element-size") for text in element_size]
    with opened(spec, out, workers, executor, quiet) as session:
        study = session.study
        _require_small(study, sizes)
        work = Work(study, session.folder, session.executor, session.watch, make_solver(study))
        found = strains_of(work, list(dict.fromkeys(sizes)))
    if not as_json:
        say_tables(strain_table(found))
    written = _written(study, found, found.row(sizes[0]), program, folder)
    if as_json:
        say_json(written)
    elif not quiet:
        for name in written["files"]:
            note(f"wrote {folder / name}")


def _require_small(study: Study, sizes: list[float]) -> None:
    """Raise `UsageError` for an element size that does not fit the stem."""
    at = study.targets.calibrate_at
    if wrong := [size for size in sizes if size > _COARSEST * at]:
        most = f"Use at most {_COARSEST * at:g} mm."
        raise UsageError(f"--element-size: {wrong[0]:g} mm is too large for a {at:g} mm stem. {most}")


def _written(study: Study, found: SizedStrains, row: SizedStrain, program: str, folder: Path) -> dict[str, Any]:
    """Write the files; return what material.json holds."""
    from stemcal.report.records import spec_hash
    from stemcal.solvers.deck.writer import curve_text, material_text
    from stemcal.stages.refine.element_size import curve_lines, material_lines, not_valid
    from stemcal.version import __version__

    if not row.valid:
        raise RunsFailed(f"export material: {not_valid(found, row)}")
    make_folder(folder)
    deck = _deck(study, found, row, program)
    files = {"material.k": material_text(deck, material_lines(study, found, row))}
    if len(valid := [one for one in found.rows if one.valid]) > 1:
        points = [(one.element_size, one.failure_strain) for one in valid]
        files |= {"curve.k": curve_text(points, curve_lines(found)), "curve.csv": found.rows.table().csv()}
    content = {
        "schema_version": 1,
        "stage": "material",
        "study": study.name,
        "spec_sha256": spec_hash(study),
        "stemcal_version": __version__,
        "program": program,
        "element_size": row.element_size,
        "parameters": {**found.levels, "failure_strain": row.failure_strain},
        "condition": found.condition,
        "aim": found.aim,
        "rows": to_json(found.rows),
        "files": [*files, "material.json"],
    }
    for name, text in (files | {"material.json": json.dumps(content, indent=2) + "\n"}).items():
        write_atomic(folder / name, text)
    return content


def _deck(study: Study, found: SizedStrains, row: SizedStrain, program: str) -> Deck:
    """Return the shear test with the elements and the failure strain there, whose card is written."""
    from stemcal.solvers.deck import Deck, DeckForm
    from stemcal.solvers.embedded import meshed_as
    from stemcal.stages.refine.element_size import without_lengths

    levels = {**found.levels, "failure_strain": row.failure_strain}
    form = DeckForm("lsdyna" if program == "lsdyna" else "openradioss")
    return Deck.of(meshed_as(without_lengths(study), row.element_size), levels, found.condition, form)
