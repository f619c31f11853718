"""`stemcal export material`: the calibrated material for one's own model with its own elements."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from stemcal.cli.console import note, say_json, say_tables, waiting
from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers
from stemcal.cli.session import opened
from stemcal.errors import RunsFailed, UsageError
from stemcal.files.typed import to_json
from stemcal.outputs import make_folder, write_output

if TYPE_CHECKING:
    from stemcal.solvers.deck import Deck
    from stemcal.stages.regularise import Regularisation, Regularised
    from stemcal.study.model import Study

# Further sizes of the curve, times the one that is asked for: the first three of a quarter of the diameter at most.
_BESIDE = tuple(2.0 ** (0.5 * power) for power in (1, 2, 3, -1, -2, -3))
_COARSEST = 0.25
MOST_PLACES = 50

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Where the files are written.", show_default=False)]
Program = Annotated[
    Literal["lsdyna", "openradioss"],
    typer.Option("--for", help="Whose cards: lsdyna *MAT_003, openradioss *MAT_024.", show_default=False),
]
ElementSize = Annotated[
    str, typer.Option("--element-size", metavar="LENGTH", help="Of the elements there.", show_default=False)
]
Sizes = Annotated[
    list[str] | None,
    typer.Option(
        "--size",
        metavar="LENGTH",
        help="A further size of the curve; repeatable.",
        show_default="three in steps of √2",
    ),
]
Places = Annotated[int, typer.Option("--places", min=2, max=MOST_PLACES, help="Places of each mesh under the edge.")]


def export_material(
    spec: Spec,
    folder: Folder,
    program: Program,
    element_size: ElementSize,
    sizes: Sizes = None,
    places: Places = 5,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write the calibrated material for your own model: card, failure strain over element size, and a deck to check it.

    In a mesh whose elements fail each by itself the failure strain belongs to their size. For some sizes the strain is
    found with which the mean force over places of such a mesh is the calibrated one; its band is what each place would
    take. The study is calibrated first (stemcal run SPEC).

    Example: [bold]stemcal export material configs/smoke.yaml --for lsdyna --element-size "1 mm" material[/bold]
    """
    from stemcal.report.tables.of_transfer import regularisation_table
    from stemcal.solvers import make_solver
    from stemcal.stages.regularise import regularise
    from stemcal.stages.work import Work
    from stemcal.study.reading.checked import typed_size

    size = typed_size(element_size, "--element-size")
    given = [typed_size(text, "--size") for text in sizes or ()]
    with opened(spec, out, workers, executor, quiet) as session:
        study = session.study
        wanted = _sizes(study, size, given)
        work = Work(study, session.folder, session.executor, session.watch, make_solver(study))
        found = regularise(work, wanted, places)
    if not as_json:
        say_tables(regularisation_table(found))
    with waiting("the force that the check deck is to give", quiet):
        told = _written(study, found, found.row(size), program, folder)
    if as_json:
        say_json(told)
        return
    if not quiet:
        for name in told["files"]:
            note(f"wrote {folder / name}")
        note(f"{told['check']['deck']} is to give {told['check']['force']:.4g} N")


def _sizes(study: Study, size: float, given: list[float]) -> list[float]:
    """Return the sizes of the curve; raise `UsageError` for one that does not fit the stem."""
    at = study.targets.calibrate_at
    if wrong := [one for one in (size, *given) if one > 0.5 * at]:
        most = f"take {0.5 * at:g} mm at most"
        raise UsageError(f"elements of {wrong[0]:g} mm are too large for a {at:g} mm stem; {most}")
    beside = [float(f"{share * size:.4g}") for share in _BESIDE if share * size <= _COARSEST * at]
    return sorted({*(given or beside[:3]), size})


def _written(study: Study, found: Regularisation, row: Regularised, program: str, folder: Path) -> dict[str, Any]:
    """Write the files; return what material.json holds."""
    from dataclasses import replace

    from stemcal.solvers.deck import deck_text
    from stemcal.solvers.deck.material import curve_text, material_text
    from stemcal.text.regularisation import curve_lines, material_lines, not_valid

    if not row.found:
        raise RunsFailed(f"export material: {not_valid(found, row, MOST_PLACES)}")
    deck = _check_deck(study, found, row, program)
    force = _force_of(deck)
    valid = [one for one in found.rows if one.found]
    make_folder(folder)
    write_output(folder / "material.k", material_text(deck, material_lines(study, found, row, force)))
    points = [(one.element_size, one.failure_strain) for one in valid]
    write_output(folder / "curve.k", curve_text(points, curve_lines(found)))
    write_output(folder / "curve.csv", found.rows.table().csv())
    write_output(folder / "check.k", deck_text(replace(deck, force_to_give=force)))
    told = {
        "schema_version": 1,
        "stage": "export material",
        **_provenance(study),
        "program": program,
        "element_size": row.element_size,
        "parameters": {**found.levels, "failure_strain": row.failure_strain},
        "valid_sizes": [one.element_size for one in valid],
        "curve": to_json(found.rows),
        "condition": found.condition,
        "aim": found.aim,
        "check": {"deck": "check.k", "force": force, "diameter": found.condition},
        "files": ["material.k", "curve.k", "curve.csv", "check.k", "material.json"],
    }
    write_output(folder / "material.json", json.dumps(told, indent=2) + "\n")
    return told


def _provenance(study: Study) -> dict[str, str]:
    from stemcal.report.records import spec_hash
    from stemcal.version import __version__

    return {"study": study.name, "spec_sha256": spec_hash(study), "stemcal_version": __version__}


def _check_deck(study: Study, found: Regularisation, row: Regularised, program: str) -> Deck:
    """Return the shear test with the elements and the failure strain there."""
    from stemcal.solvers.deck import Deck, DeckForm
    from stemcal.solvers.embedded import meshed_as
    from stemcal.solvers.protocol import Request
    from stemcal.stages.regularise import without_lengths

    levels = {**found.levels, "failure_strain": row.failure_strain}
    request = Request("export material", 0, levels, found.condition, element_size=f"{row.element_size:g} mm")
    form = DeckForm("lsdyna" if program == "lsdyna" else "openradioss")
    there = meshed_as(without_lengths(study), request)
    return Deck.of(there, levels, found.condition, form)


def _force_of(deck: Deck) -> float:
    """Return the force that a deck is to give, N: the embedded solver computes what the deck says."""
    from stemcal.solvers.deck.as_embedded import as_embedded
    from stemcal.solvers.embedded import simulate

    return simulate(as_embedded(deck), {}, deck.diameter).peak_force
