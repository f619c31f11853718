"""`stemcal run`: the whole study."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers

STAGES = ("screen", "climb", "rsm", "invert", "refine", "validate")


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
        from stemcal.report.page import write_page

        workflow.calibrate(work.study, work.folder, work.executor, work.watch)
        page = write_page(work.study, work.folder)
        draw_all(work.study, work.folder)
        asked = {"climb": work.study.climb, "refine": work.study.refine}
        stages = {name: work.folder.read_stage(name) for name in STAGES if asked.get(name, True) is not None}
    show_run(stages, page, as_json, quiet)
    warn_of_runs(stages.values(), work.folder)
    leave_if_failed(*stages.values())
