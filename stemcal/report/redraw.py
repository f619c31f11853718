"""Write the page and the figures of a study if their inputs changed; drawing code is imported only if needed."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from stemcal.report.records import spec_hash
from stemcal.runs.study_folder import StudyFolder
from stemcal.storage.canonical import digest
from stemcal.storage.plain import open_plain, read_plain
from stemcal.storage.sealed import MAX_BYTES
from stemcal.storage.typed import to_json
from stemcal.version import code_version

if TYPE_CHECKING:
    from stemcal.stages.results import Results
    from stemcal.stages.verdict.result import Verdict
    from stemcal.study.model.study import Study

PAGE = "report.html"
_MOST = 200  # bytes at the end of the page, which contain its last line


def draw(study: Study, folder: StudyFolder, results: Results, verdict: Verdict, again: bool = False) -> Path:
    """Write page and figures if `again` or if the inputs differ from the hash in the page; return the page's path."""
    stages = [read_plain(path, MAX_BYTES).decode() for path in sorted(folder.path.glob("*.json"))]
    records = [(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in sorted(folder.runs.glob("*.json"))]
    spec = [study.model_dump_json(), study.source.name, spec_hash(study), list(study.warnings)]
    inputs = digest([code_version(), spec, [list(results.stale), to_json(verdict)], stages, records])
    page, made_of = folder.path / PAGE, f"<!-- inputs: {inputs}"
    if not again and _last_line(page).startswith(made_of):
        return page
    from stemcal.report.gallery import write_figures
    from stemcal.report.page.page import page_content, write_page

    content = page_content(study, folder, results, verdict)
    if plots := [plot for plot in content.plots if plot.on_page]:
        write_figures(plots, folder.path / "figures")
    write_page(page, content, f"{made_of} -->\n")
    return page


def draw_words(study: Study, folder: StudyFolder) -> None:
    """Write the page of the finished stages without figures, which is fast enough to do after each stage."""
    from stemcal.report.page.page import page_content, write_page

    write_page(folder.path / PAGE, replace(page_content(study, folder), plots=[]))


def _last_line(page: Path) -> str:
    try:
        with open_plain(page) as file:
            file.seek(-min(page.stat().st_size, _MOST), os.SEEK_END)
            return file.read().decode("utf-8", "replace").rstrip("\n").rpartition("\n")[2]
    except OSError:
        return ""
