"""`stemcal run`: the whole study."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers, Yes
from stemcal.errors import TargetUnreachable


def run(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
    yes: Yes = False,
) -> None:
    """Take a study through all stages: screen, rsm, invert, validate, report; climb and refine if the spec has them.

    Stopped or failed? The same command goes on where it stopped; finished runs are never done twice.

    Example: [bold]stemcal run configs/smoke.yaml --out runs/first --workers 2[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_run

    unreachable: TargetUnreachable | None = None
    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow
        from stemcal.cli.plot import draw_all
        from stemcal.report.page.render import write_page
        from stemcal.stages.results import fresh_results
        from stemcal.stages.verdict.rules import verdict_of

        work.require_sense(yes)
        try:
            workflow.calibrate(work.study, work.folder, work.executor, work.watch)
        except TargetUnreachable as error:
            unreachable = error
        work.folder.remember_spec(work.study.source)
        page = write_page(work.study, work.folder)
        draw_all(work.study, work.folder)
        results = fresh_results(work.study, work.folder)
        verdict = verdict_of(work.study, work.folder, results)
    show_run(results, verdict, page, work.folder, as_json, quiet)
    if unreachable is not None:
        raise unreachable
