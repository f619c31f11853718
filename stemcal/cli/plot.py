"""`stemcal plot`: the figures of a study as files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from stemcal.cli.options import AsJson, Out, Spec

if TYPE_CHECKING:
    from pathlib import Path

    from stemcal.folder.store import StudyFolder
    from stemcal.report.figures.gallery import Plot
    from stemcal.study.model import Study

Name = Annotated[str, typer.Argument(metavar="NAME", help="A figure, the beginning of some names, all, or list.")]


Format = Annotated[Literal["gif", "mp4"], typer.Option("--format", help="Of an animation; mp4 needs ffmpeg.")]


def plot(name: Name, spec: Spec, out: Out = None, film: Format = "gif", as_json: AsJson = False) -> None:
    """Draw figures of a study as SVG and PNG into the folder figures of the study folder.

    NAME may be the beginning of several names: contour draws all contour plots, fracture all fractured stems. list
    shows the names there are, all draws everything. animation shows the cut at the calibration diameter as a short
    film, animation-7mm at another; view shows the cut stem in space, by pyvista with the extra view.

    Example: [bold]stemcal plot list configs/smoke.yaml[/bold]
    """
    from stemcal.cli.console import say, say_json
    from stemcal.cli.requested import CAPTIONS, is_requested, requestable, write_requested
    from stemcal.cli.session import existing_folder, read_study
    from stemcal.report.figures.gallery import write_figures

    study = read_study(spec)
    folder = existing_folder(study, out)
    if is_requested(name):
        lines = [str(write_requested(study, folder, name, film))]
    elif name == "list":
        lines = [f"{drawing.name}: {drawing.caption}" for drawing in plots_of(study, folder)]
        lines += [f"{title}: {CAPTIONS[title.partition('-')[0]]}" for title in requestable(study, folder)]
    else:
        found = chosen(plots_of(study, folder), name)
        lines = [str(path) for path in write_figures(found, folder.path / "figures")]
    if as_json:
        say_json({"schema_version": 1, "stage": "plot", "names" if name == "list" else "files": lines})
    else:
        say(*lines)


def plots_of(study: Study, folder: StudyFolder) -> list[Plot]:
    """Return the figures that the folder allows; warn of stages that are out of date."""
    from stemcal.cli.console import warn
    from stemcal.report.figures.gallery import gallery
    from stemcal.report.records import read_records
    from stemcal.stages.results import fresh_results

    results = fresh_results(study, folder)
    for sentence in results.stale:
        warn(sentence)
    return gallery(study, results, read_records(results, folder))


def chosen(plots: list[Plot], name: str) -> list[Plot]:
    """Return the figures called `name`, or all whose names begin so."""
    from stemcal.errors import UsageError

    found = [p for p in plots if name in ("all", p.name)] or [p for p in plots if p.name.startswith(name)]
    if not found:
        known = ", ".join(p.name for p in plots) or "none yet; run `stemcal run SPEC` first"
        raise UsageError(f"no figure {name!r}; there are {known}")
    return found


def draw_all(study: Study, folder: StudyFolder, plots: list[Plot]) -> Path:
    """Write these figures of a report unless they are there for the same stages; returns their folder."""
    from stemcal import __version__
    from stemcal.files.durable import digest
    from stemcal.outputs import write_output
    from stemcal.report.figures.gallery import write_figures

    where = folder.path / "figures"
    mark = where / "drawn-for.txt"
    stages = [path.read_text("utf-8") for path in sorted(folder.path.glob("*.json"))]
    made_for = digest([__version__, str(study.targets), stages])
    if not mark.is_file() or mark.read_text("utf-8") != made_for:
        write_figures([found for found in plots if not found.on_request], where)
        write_output(mark, made_for)
    return where
