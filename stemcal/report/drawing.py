"""Page and figures of a study, drawn where something they are made from has changed."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.files.durable import digest
from stemcal.files.typed import to_json
from stemcal.folder.store import StudyFolder
from stemcal.outputs import write_output
from stemcal.version import __version__

if TYPE_CHECKING:
    from stemcal.executors.base import RunExecutor
    from stemcal.report.figures.gallery import Plot
    from stemcal.stages.results import Results
    from stemcal.stages.verdict.result import Verdict
    from stemcal.study.model import Study

MARK = "drawn-for.txt"


def draw(
    study: Study,
    folder: StudyFolder,
    results: Results,
    verdict: Verdict,
    figures: bool = True,
    again: bool = False,
    executor: RunExecutor | None = None,
) -> Path:
    """Write page and figures unless they are there for the same inputs; returns the page.

    With `again` the page is written anyway. Workers of this machine that the `executor` has share the figures out.
    """
    page, mark = folder.path / "report.html", folder.path / "figures" / MARK
    made_for = inputs_of(study, folder, results, verdict)
    drawn = mark.read_text("utf-8").split() if mark.is_file() else []
    old_page, old_figures = again or drawn != [made_for, _sum(page)], figures and drawn[:1] != [made_for]
    if not (old_page or old_figures):
        return page
    from stemcal.report.figures.gallery import write_figures
    from stemcal.report.page.render import shown, write_page

    what = shown(study, folder, results, verdict)
    plots = [plot for plot in what.plots if plot.on_page]
    if old_figures and executor is not None:
        draw_by_workers(plots, executor)
    if old_page:
        write_page(study, folder, what)
    if old_figures:
        write_figures(plots, mark.parent)
    if figures:
        write_output(mark, f"{made_for}\n{_sum(page)}\n")
    return page


def draw_by_workers(plots: Sequence[Plot], executor: RunExecutor) -> None:
    """Have figures drawn by workers that run already; one whose worker dies over it is left to be drawn here."""
    from stemcal.executors.failures import WorkerDied
    from stemcal.executors.local import LocalExecutor

    if not isinstance(executor, LocalExecutor) or executor.started < 2:
        return
    drawn = [executor.submit_pickled(pickle.dumps((_drawn, (plot,), {})), time_limit=None) for plot in plots]
    for plot, future in zip(plots, drawn, strict=True):
        with suppress(WorkerDied):
            plot.take(*future.result())


def _drawn(plot: Plot) -> tuple[str, bytes]:
    """Return a figure as SVG and PNG. Runs in a worker."""
    return plot.document, plot.pixels


def inputs_of(study: Study, folder: StudyFolder, results: Results, verdict: Verdict) -> str:
    """Return a digest of all that page and figures are made from: spec, stage files, records, the code that draws."""
    stages = [path.read_text("utf-8") for path in sorted(folder.path.glob("*.json"))]
    spec = [study.model_dump_json(), study.source.name, list(study.warnings)]
    told = [list(results.stale), to_json(verdict)]
    code = _state(Path(__file__).parent, "*.*")
    return digest([__version__, code, spec, told, stages, _state(folder.path / "runs", "*.json")])


def _state(folder: Path, pattern: str) -> list[list[object]]:
    """Return name, size and time of the files below a folder."""
    found = [(path, path.stat()) for path in sorted(folder.rglob(pattern)) if path.suffix != ".pyc"]
    return [[path.name, state.st_size, state.st_mtime_ns] for path, state in found]


def _sum(page: Path) -> str:
    return hashlib.sha256(page.read_bytes()).hexdigest() if page.is_file() else "none"
