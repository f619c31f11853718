"""`stemcal invert`: from measured force to parameters."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers


def invert(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Solve the surface for the measured force: calibrated parameters and how well they are known.

    Example: [bold]stemcal invert configs/smoke.yaml[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_stage

    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow

        stage = workflow.invert(work.study, work.folder)
    show_stage(stage, work.folder, as_json, quiet)
