"""`stemcal report`: the study as one HTML page."""

from stemcal.cli.console import say_json, say_whole, warn
from stemcal.cli.options import AsJson, Out, Quiet, Spec
from stemcal.cli.session import existing_folder, read_study


def report(
    spec: Spec,
    out: Out = None,
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
    page = draw(study, folder, results, verdict, again=True)
    drawn = folder.path / "figures"
    if as_json:
        say_json({"page": str(page), "figures": str(drawn)})
    else:
        say_whole(f"Report: {page}", f"Figures: {drawn}")
