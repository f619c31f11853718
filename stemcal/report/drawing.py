"""Page and figures of a study, drawn where something they are made from has changed."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.files.durable import digest
from stemcal.files.typed import to_json
from stemcal.folder.store import StudyFolder
from stemcal.outputs import write_output
from stemcal.version import __version__

if TYPE_CHECKING:
    from stemcal.report.figures.beside import Drawers
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
    drawers: Drawers | None = None,
) -> Path:
    """Write page and figures unless they are there for the same inputs; returns the page.

    With `again` the page is written anyway. `drawers` may have begun some of the figures, see `begin_early`.
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
    if old_figures and drawers is not None:
        drawers.draw(plots)
    if old_page:
        write_page(study, folder, what)
    if old_figures:
        write_figures(plots, mark.parent)
    if figures:
        write_output(mark, f"{made_for}\n{_sum(page)}\n")
    return page


def begin_early(study: Study, folder: StudyFolder, stage: str, drawers: Drawers) -> None:
    """Have drawn, while nothing is to be simulated, the figures of which all is known now that a stage is done."""
    if not drawers.at_work:
        return
    from stemcal.report.figures.gallery import gallery
    from stemcal.stages.base import stages_of
    from stemcal.stages.results import fresh_results

    # the scatter over meshes widens the intervals of the inversion
    known_with = {"invert": "mesh"} if any(one.name == "mesh" for one in stages_of(study)) else {}
    plots = [plot for plot in gallery(study, fresh_results(study, folder), {}) if plot.on_page]
    drawers.begin([plot for plot in plots if known_with.get(plot.known_with, plot.known_with) == stage])


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
