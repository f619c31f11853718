"""`stemcal report`: the study as one HTML page."""

from __future__ import annotations

from stemcal.cli.options import AsJson, Out, Quiet, Spec


def report(spec: Spec, out: Out = None, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Write report.html, one self-contained page, from the stages that are done.

    It may be written while the study still runs.

    Example: [bold]stemcal report configs/smoke.yaml[/bold]
    """
    from stemcal.cli.console import say, say_json
    from stemcal.cli.session import existing_folder, read_study
    from stemcal.report.page import write_page

    study = read_study(spec)
    page = write_page(study, existing_folder(study, out))
    if as_json:
        say_json({"schema_version": 1, "stage": "report", "page": str(page)})
    else:
        say(f"Report: {page}")
