"""`stemcal report`: the study as one HTML page."""

from typing import Annotated

import typer

from stemcal.cli.console import open_page, say_json, say_whole, warn
from stemcal.cli.options import AsJson, OpenPage, Out, Quiet, Spec
from stemcal.cli.session import existing_folder, read_study

Figures = Annotated[bool, typer.Option("--figures/--no-figures", help="Also write the page's figures as SVG and PNG.")]


def report(
    spec: Spec,
    out: Out = None,
    figures: Figures = True,
    open_it: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write report.html, one self-contained page, from the stages that are done.

    It may be written while the study still runs.

    Example: [bold]stemcal report configs/smoke.yaml[/bold]
    """
    from stemcal.report.drawing import draw
    from stemcal.stages.results import fresh_results
    from stemcal.stages.verdict.rules import verdict_of

    study = read_study(spec)
    folder = existing_folder(study, out)
    results = fresh_results(study, folder)
    if not quiet:
        for sentence in results.stale:
            warn(sentence)
    verdict = verdict_of(study, folder, results)
    page = draw(study, folder, results, verdict, figures, again=True)
    drawn = folder.path / "figures" if figures else None
    if open_it:
        open_page(page)
    if as_json:
        say_json({"schema_version": 1, "stage": "report", "page": str(page), "figures": drawn and str(drawn)})
    else:
        say_whole(f"Report: {page}", *([f"Figures: {drawn}"] if drawn else []))
