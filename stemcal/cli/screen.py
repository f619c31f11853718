"""`stemcal screen`: which factors move the cutting force."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers


def screen(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate the screening design and find the factors that matter.

    Example: [bold]stemcal screen configs/smoke.yaml[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_stage

    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow

        stage = workflow.screen(work.study, work.folder, work.executor, work.watch)
    show_stage(stage, work.folder, as_json, quiet)
