"""`stemcal run`: the whole study."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.cli.options import AsJson, ExecutorName, OpenPage, Out, Quiet, Spec, Workers, Yes
from stemcal.errors import TargetUnreachable

if TYPE_CHECKING:
    from stemcal.cli.session import Session
    from stemcal.stages.result import StageResult


def run(
    spec: Spec,
    out: Out = None,
    workers: Workers = None,
    executor: ExecutorName = "local",
    open_it: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    yes: Yes = False,
) -> None:
    """Take a study through all stages: screen, rsm, invert, validate, report; climb and refine if the spec has them.

    Stopped or failed? The same command goes on where it stopped; finished runs are never done twice.

    Example: [bold]stemcal run configs/smoke.yaml --out runs/first --workers 2[/bold]
    """
    from stemcal.cli.console import open_page
    from stemcal.cli.session import opened
    from stemcal.cli.show import show_run

    unreachable: TargetUnreachable | None = None
    with opened(spec, out, workers, executor, quiet) as work:
        from stemcal import workflow
        from stemcal.report.drawing import draw
        from stemcal.report.page.render import shown

        work.require_sense(yes)
        _foretell(work)
        try:
            done = _telling(work) if not as_json else lambda _result: None
            workflow.calibrate(work.study, work.folder, work.executor, work.watch, done=done)
        except TargetUnreachable as error:
            unreachable = error
        work.folder.remember_spec(work.study.source)
        work.watch.busy("drawing the report")
        what = shown(work.study, work.folder)
        page = draw(work.study, work.folder, what)
    if open_it:
        open_page(page)
    show_run(work.study, what.results, what.verdict, page, work.folder, as_json, quiet)
    if unreachable is not None:
        raise unreachable


def _foretell(work: Session) -> None:
    """Tell the progress bar how many runs there will be."""
    from stemcal.overview.plan import foreseen

    work.watch.expect(foreseen(work.study, work.folder))


def _telling(work: Session) -> Callable[[StageResult], None]:
    """Return what prints a stage's table as soon as it is known, the progress bar put aside."""
    from stemcal.cli.show import show_known

    def told(result: StageResult) -> None:
        if result.name == "screen":
            with work.watch.aside():
                show_known(result)

    return told
