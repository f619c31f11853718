"""`stemcal run`: the whole study."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from stemcal.cli.console import open_page
from stemcal.cli.options import AsJson, ExecutorName, OpenPage, Out, Quiet, Spec, Workers, Yes
from stemcal.cli.session import Session, opened
from stemcal.errors import TargetUnreachable

if TYPE_CHECKING:
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
    with opened(spec, out, workers, executor, quiet) as work:
        work.foresee(yes)
        show = go_through(work, not as_json)
    show(as_json, quiet, open_it)


def go_through(work: Session, tell: bool) -> Callable[..., None]:
    """Take an open study through all stages and draw its page; return what shows it once the study is closed."""
    from stemcal.cli.show import show_run
    from stemcal.report.drawing import draw
    from stemcal.stages.fresh import make_all
    from stemcal.stages.results import fresh_results
    from stemcal.stages.verdict.rules import verdict_of

    unreachable: TargetUnreachable | None = None
    made: list[StageResult] = []
    try:
        made = make_all(work.study, work.folder, work.executor, work.watch, done=_showing(work, tell))
    except TargetUnreachable as error:
        unreachable = error
    work.folder.remember_spec(work.study.source)
    work.watch.busy("drawing the report")
    results = fresh_results(work.study, work.folder, made)
    verdict = verdict_of(work.study, work.folder, results)
    page = draw(work.study, work.folder, results, verdict)

    def show(as_json: bool, quiet: bool, open_it: bool = False) -> None:
        if open_it:
            open_page(page)
        show_run(work.study, results, verdict, page, work.folder, as_json, quiet)
        if unreachable is not None:
            raise unreachable

    return show


def _showing(work: Session, tell: bool) -> Callable[[StageResult], None]:
    """Return what prints the table of the screening as soon as that is done, the progress bar aside."""
    from stemcal.cli.show import show_known

    def show(result: StageResult) -> None:
        if tell and result.name == "screen":
            with work.watch.aside():
                show_known(result)

    return show
