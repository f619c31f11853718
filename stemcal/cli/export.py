"""`stemcal export`: write tables, figures, decks and material cards of a study to files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from stemcal.cli import export_program
from stemcal.cli.console import say_json, say_tables, say_whole
from stemcal.cli.session import AsJson, Out, Spec, finished_work
from stemcal.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from stemcal.drawing.plot import Plot
    from stemcal.report.records import Records
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.study.model.study import Study

_TableFormat = Annotated[
    Literal["csv", "md", "tex", "docx"],
    typer.Option("--format", "-f", help="Output format: CSV (one file per table), Markdown, LaTeX or Word."),
]
_Names = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="NAME", help="Figure names or their prefixes; `list` prints all figure names.", show_default="all"
    ),
]
_FigureFormat = Annotated[
    Literal["svg", "png", "pdf", "eps", "tiff"] | None,
    typer.Option("--format", "-f", help="Figure format.", show_default="svg and png"),
]
_Dpi = Annotated[
    float,
    typer.Option("--dpi", metavar="N", min=50, max=1200, help="Resolution of PNG and TIFF files in dots per inch."),
]
_Width = Annotated[float | None, typer.Option("--width", metavar="MM", min=40, max=400, help="Figure width in mm.")]
_ANIMATION = "animation"

app = typer.Typer(
    no_args_is_help=True,
    help="Export the tables, figures, decks or material cards of a study.\n\n"
    "Example: [bold]stemcal export tables configs/smoke.yaml --format docx[/bold]",
)


@app.command()
def tables(spec: Spec, kind: _TableFormat = "csv", out: Out = None, as_json: AsJson = False) -> None:
    """Write publication-ready tables of the results.

    The tables are saved in the `tables` subfolder of the study folder. The tables contain the factors, the runs and
    results of each stage, and the calibrated parameters. With `--format docx`, the Word file also contains the figures.

    Example: [bold]stemcal export tables configs/smoke.yaml --format docx[/bold]
    """
    from stemcal.report.export import export_tables, study_tables
    from stemcal.report.gallery import gallery
    from stemcal.report.records import read_records
    from stemcal.stages.verdict.verdict_rules import verdict_of

    study, folder, results = finished_work(spec, out)
    holds = verdict_of(study, folder, results).holds
    tables_of_study = study_tables(study, results, holds)
    plots = gallery(study, results, read_records(results, folder)) if kind == "docx" else []
    plots = [plot for plot in plots if plot.on_page and not plot.detail and (holds or not plot.claims)]
    _print_paths([str(path) for path in export_tables(tables_of_study, kind, folder.path / "tables", plots)], as_json)


@app.command()
def figures(
    spec: Spec,
    names: _Names = None,
    kind: _FigureFormat = None,
    dpi: _Dpi = 300,
    width: _Width = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Draw the figures of a study.

    The figures are saved in the `figures` subfolder of the study folder. A prefix such as `contour` selects all figures
    whose names start with this prefix. `animation` selects a GIF animation of the cutting simulation at the calibration
    diameter, and `animation-7mm` selects an animation at a diameter of 7 mm.

    Example: [bold]stemcal export figures configs/smoke.yaml contour --format pdf --width 90[/bold]
    """
    from stemcal.drawing.table import Column, Table
    from stemcal.report.gallery import gallery, write_as
    from stemcal.report.records import read_records

    study, folder, results = finished_work(spec, out)
    records = read_records(results, folder)
    plots = gallery(study, results, records)
    if names == ["list"]:
        named = {plot.name: plot.caption for plot in plots}
        named |= dict.fromkeys(films(records), "Animation of the cut (GIF).")
        if as_json:
            say_json({"figures": named})
        else:
            say_tables(Table((Column("name", "Figure"), Column("caption", "Content")), tuple(named.items())))
        return
    drawn = [chosen(plots, name) for name in names or ["all"] if not name.startswith(_ANIMATION)]
    kinds = ["svg", "png"] if kind is None else [kind]
    paths = write_as([plot for group in drawn for plot in group], folder.path / "figures", kinds, dpi, width)
    paths += [write_film(study, records, folder, name) for name in names or () if name.startswith(_ANIMATION)]
    _print_paths([str(path) for path in paths], as_json)


app.command("deck")(export_program.export_deck)
app.command("material")(export_program.export_material)


def _print_paths(paths: list[str], as_json: bool) -> None:
    if as_json:
        say_json({"files": paths})
    else:
        say_whole(*paths)


def chosen(plots: list[Plot], name: str) -> list[Plot]:
    """Return the figure with this name (or all for `all`); if there is none, the figures whose names begin with it."""
    matches = [p for p in plots if name in ("all", p.name)] or [p for p in plots if p.name.startswith(name)]
    if not matches:
        known = ", ".join(p.name for p in plots) or "not drawn yet; run `stemcal run SPEC` first"
        raise UsageError(f"no figure is named {name!r}; the figures are {known}")
    return matches


def films(records: Records) -> dict[str, str]:
    """Return the label of the run for each available animation, by the name of the animation."""
    kept = (label for label, record in records.items() if record.details.film and record.at_solution)
    return {f"{_ANIMATION}-{label.replace(' ', '')}": label for label in kept}


def write_film(study: Study, records: Records, folder: StudyFolder, name: str) -> Path:
    """Write an animation as a GIF and return its path; `name` without a diameter means the calibration diameter."""
    from stemcal.cutting.end_state import Shape
    from stemcal.formats import short
    from stemcal.report.fracture import write_animation
    from stemcal.solvers.film import frames_of
    from stemcal.storage.atomic import make_folder

    wanted = f"{name}-{short(study.targets.calibrate_at)}mm" if name == _ANIMATION else name
    known = films(records)
    if wanted not in known:
        remedy = "the `refine` and `validate` stages store the frames; run `stemcal run SPEC` first"
        raise UsageError(
            f"unknown animation {wanted!r}; the animations are {', '.join(known)}" if known else f"{wanted}: {remedy}"
        )
    details = records[known[wanted]].details
    curve = None if details.curve is None else (details.curve.travel, details.curve.force)
    frames = frames_of(Shape.unpacked(details.shape), details.film)
    return write_animation(frames, make_folder(folder.path / "figures") / f"{wanted}.gif", curve)
