"""`stemcal audit`: a paper's printed tables and claims, computed again."""

from __future__ import annotations

from stemcal.cli.options import AsJson, Out, Quiet, Spec


def audit(spec: Spec, out: Out = None, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Recompute a paper's printed tables and claims and list what does not agree, cell by cell.

    The spec has a solver of kind table with the paper's runs, and under published what it printed.

    Example: [bold]stemcal audit configs/paper-replay.yaml[/bold]
    """
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_stage

    with opened(spec, out, 1, "local", quiet) as work:
        from stemcal import workflow

        stage = workflow.audit(work.study, work.folder, work.executor, work.watch)
    show_stage(stage, work.folder, as_json, quiet)
