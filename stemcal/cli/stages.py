"""The stage commands: one for each entry of the list of stages."""

from collections.abc import Callable
from inspect import cleandoc

from stemcal.cli.console import warn
from stemcal.cli.options import AsJson, ExecutorName, Out, Quiet, Spec, Workers
from stemcal.cli.session import opened
from stemcal.stages.base import Stage


def command_of(stage: Stage, example: str = "configs/smoke.yaml") -> Callable[..., None]:
    """Return the command that runs a stage."""

    def command(
        spec: Spec,
        out: Out = None,
        workers: Workers = None,
        executor: ExecutorName = "local",
        as_json: AsJson = False,
        quiet: Quiet = False,
    ) -> None:
        _run(stage, spec, out, workers, executor, as_json, quiet)

    command.__name__ = stage.name
    command.__doc__ = f"{cleandoc(stage.help)}\n\nExample: [bold]stemcal {stage.name} {example}[/bold]"
    return command


def _run(stage: Stage, spec: Spec, out: Out, workers: Workers, executor: str, as_json: bool, quiet: bool) -> None:
    """Run one stage of a study and show what it came to."""
    from stemcal.cli.show import show_stage
    from stemcal.stages.fresh import make
    from stemcal.stages.refine.result import RefineResult
    from stemcal.stages.refine.words import shortfall
    from stemcal.stages.verdict.rules import verdict_of

    with opened(spec, out, workers, executor, quiet) as work:
        if stage.simulates:
            work.foresee(stage.name)
        result = make(stage, work.study, work.folder, work.executor, work.watch)
        verdict = verdict_of(work.study, work.folder)
    if isinstance(result, RefineResult) and not result.converged:
        warn(shortfall(result))
    show_stage(result, verdict, work.folder, as_json, quiet)
