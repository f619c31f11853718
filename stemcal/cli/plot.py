"""`stemcal plot`: the figures of a study as files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from stemcal.cli.console import say, say_json, say_tables, warn
from stemcal.cli.options import AsJson, Out, Spec
from stemcal.cli.session import existing_folder, read_study
from stemcal.errors import UsageError

if TYPE_CHECKING:
    from stemcal.folder.study_folder import StudyFolder
    from stemcal.report.figures.gallery import Plot
    from stemcal.study.model import Study

Name = Annotated[str, typer.Argument(metavar="NAME", help="A figure, the beginning of some names, all, or list.")]


Kind = Literal["svg", "png", "pdf", "eps", "tiff", "gif", "mp4"]
Format = Annotated[
    Kind | None,
    typer.Option("--format", help="Of figures; gif or mp4 (needs ffmpeg) of an animation.", show_default="svg and png"),
]
Dpi = Annotated[float, typer.Option("--dpi", metavar="N", min=50, max=1200, help="Dots per inch of PNG and TIFF.")]
Width = Annotated[
    str | None,
    typer.Option(
        "--width", metavar="one|two|MM", help="One or two columns of a journal, 90 and 190 mm, or any width in mm."
    ),
]
COLUMNS = {"one": 90.0, "two": 190.0}  # mm


def plot(
    name: Name,
    spec: Spec,
    out: Out = None,
    kind: Format = None,
    dpi: Dpi = 300,
    width: Width = None,
    as_json: AsJson = False,
) -> None:
    """Draw figures of a study into the folder figures of the study folder, for a journal in its format and width.

    NAME may be the beginning of several names: contour draws all contour plots, fracture all fractured stems. list
    shows the names there are, all draws everything. animation shows the cut at the calibration diameter as a short
    film, animation-7mm at another; view shows the cut stem in space, by pyvista with the extra view.

    Example: [bold]stemcal plot list configs/smoke.yaml[/bold]

    Example: [bold]stemcal plot contour configs/smoke.yaml --format pdf --width one[/bold]
    """
    from stemcal.cli.requested import CAPTIONS, is_requested, requestable, write_requested
    from stemcal.files.rows import Column, Table
    from stemcal.report.figures.gallery import write_as

    millimetres = _width(width)
    study = read_study(spec)
    folder = existing_folder(study, out)
    if is_requested(name):
        lines = [str(write_requested(study, folder, name, "mp4" if kind == "mp4" else "gif"))]
    elif name == "list":
        named = {drawing.name: drawing.caption for drawing in plots_of(study, folder)}
        named |= {title: CAPTIONS[title.partition("-")[0]] for title in requestable(study, folder)}
        if not as_json:
            say_tables(Table((Column("name", "Figure"), Column("caption", "What it shows")), tuple(named.items())))
            return
        lines = [f"{title}: {caption}" for title, caption in named.items()]
    else:
        kinds = _kinds(kind)
        found = chosen(plots_of(study, folder), name)
        lines = [str(path) for path in write_as(found, folder.path / "figures", kinds, dpi, millimetres)]
    if as_json:
        say_json({"schema_version": 1, "stage": "plot", "names" if name == "list" else "files": lines})
    else:
        say(*lines)


def _kinds(kind: str | None) -> list[str]:

    if kind in ("gif", "mp4"):
        raise UsageError(f"--format {kind}: only `stemcal plot animation` has it; use svg, png, pdf, eps or tiff")
    return ["svg", "png"] if kind is None else [kind]


def _width(given: str | None) -> float | None:
    """Return a width in mm."""
    if given is None or given in COLUMNS:
        return None if given is None else COLUMNS[given]
    try:
        width = float(given.removesuffix("mm").strip())
    except ValueError:
        width = 0.0
    if not 40.0 <= width <= 400.0:
        raise UsageError(f"--width {given}: write one, two, or a width from 40 to 400 mm")
    return width


def plots_of(study: Study, folder: StudyFolder) -> list[Plot]:
    """Return the figures that the folder allows; warn of stages that are out of date."""
    from stemcal.report.figures.gallery import gallery
    from stemcal.report.records import read_records
    from stemcal.stages.results import fresh_results

    results = fresh_results(study, folder)
    for sentence in results.stale:
        warn(sentence)
    return gallery(study, results, read_records(results, folder))


def chosen(plots: list[Plot], name: str) -> list[Plot]:
    """Return the figures called `name`, or all whose names begin so."""
    found = [p for p in plots if name in ("all", p.name)] or [p for p in plots if p.name.startswith(name)]
    if not found:
        known = ", ".join(p.name for p in plots) or "none yet; run `stemcal run SPEC` first"
        raise UsageError(f"no figure {name!r}; there are {known}")
    return found
