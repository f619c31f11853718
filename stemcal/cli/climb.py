"""`stemcal climb`: from the middle of the ranges towards the measured force."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers


def climb(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Step the active factors together towards the measured force; the best step centres the surface's design.

    It walks along the slope that the screening found, climb.steps at most, until the force has passed the target.
    With a section climb in the spec it is part of `stemcal run`.

    Example: [bold]stemcal climb configs/smoke.yaml[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_stage

    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow

        stage = workflow.climb(work.study, work.folder, work.executor, work.watch)
    show_stage(stage, work.folder, as_json, quiet)
