"""`stemcal run`: the whole study."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers


def run(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Take a study through all stages: screen, rsm, invert, validate, report; climb and refine if the spec has them.

    Stopped or failed? The same command goes on where it stopped; finished runs are never done twice.

    Example: [bold]stemcal run configs/smoke.yaml --out runs/first --workers 2[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import leave_if_failed, show_run, warn_of_runs

    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow
        from stemcal.cli.plot import draw_all
        from stemcal.report.page.render import write_page
        from stemcal.stages.results import fresh_results

        workflow.calibrate(work.study, work.folder, work.executor, work.watch)
        work.folder.remember_spec(work.study.source)
        page = write_page(work.study, work.folder)
        draw_all(work.study, work.folder)
        results = fresh_results(work.study, work.folder)
    show_run(results, page, as_json, quiet)
    warn_of_runs(results, work.folder)
    leave_if_failed(*results.done())
