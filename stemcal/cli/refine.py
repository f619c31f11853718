"""`stemcal refine`: simulate at the solution and correct it."""

from __future__ import annotations

from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers


def refine(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate at the solution, add the point, refit and step, until the simulated force is right.

    It ends within refine.tolerance_percent of the measured force, or after refine.budget simulations. A joint fit
    (invert.diameters) is simulated at each of its diameters; it also ends when the fit no longer moves. With a
    section refine in the spec it is part of `stemcal run`, and the validation takes the refined parameters.

    Example: [bold]stemcal refine configs/wild-chrysanthemum.yaml[/bold]
    """
    from stemcal.cli.console import warn
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_stage

    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow

        stage = workflow.refine(work.study, work.folder, work.executor, work.watch)
    if not stage["converged"]:
        warn(f"refine: {abs(stage['error_percent']):.2f} % from the target after {len(stage['rows'])} runs")
    show_stage(stage, work.folder, as_json, quiet)
