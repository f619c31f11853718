"""`stemcal validate`: every measured diameter against the calibrated model."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers


def validate(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate every measured diameter with the calibrated parameters.

    Example: [bold]stemcal validate configs/smoke.yaml[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_stage

    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow

        stage = workflow.validate(work.study, work.folder, work.executor, work.watch)
    show_stage(stage, work.folder, as_json, quiet)
