"""Page and figures are drawn again where something they are made from has changed, and only there."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stemcal.report import gallery
from stemcal.report import redraw as drawing
from stemcal.report.page import page as pages
from stemcal.report.page.page import PageContent, page_content
from stemcal.report.redraw import draw
from stemcal.runs.study_folder import StudyFolder


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Count what is drawn in place of drawing it."""
    drawn: list[str] = []

    def page(path: Path, _content: PageContent, last_line: str) -> None:
        drawn.append("page")
        path.write_text(f"page {len(drawn)}\n{last_line}", "utf-8")

    def figures(_plots: Any, folder: Path) -> list[Path]:
        drawn.append("figures")
        folder.mkdir(exist_ok=True)
        return []

    monkeypatch.setattr(pages, "write_page", page)
    monkeypatch.setattr(gallery, "write_figures", figures)
    return drawn


def test_only_what_changed_is_drawn_again(
    replayed: tuple[Any, Any], tmp_path: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, original = replayed
    for path in original.path.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    folder = StudyFolder(tmp_path)
    what = page_content(study, folder)
    results, verdict = what.results, what.verdict

    def drawn(study: Any = study, **choice: bool) -> list[str]:
        counted.clear()
        draw(study, folder, results, verdict, **choice)
        return list(counted)

    assert drawn() == ["figures", "page"]
    assert drawn() == []
    assert drawn(again=True) == ["figures", "page"]
    assert drawn(study.model_copy(update={"title": "Another"})) == ["figures", "page"]
    assert drawn() == ["figures", "page"]
    stage = tmp_path / "validate.json"
    stage.write_text(stage.read_text("utf-8") + "\n", "utf-8")
    assert drawn() == ["figures", "page"]
    assert drawn() == []
    monkeypatch.setattr(drawing, "code_version", lambda: "other")
    assert drawn() == ["figures", "page"]
    (tmp_path / "report.html").unlink()
    assert drawn() == ["figures", "page"]


def test_what_the_page_does_not_show_is_left_to_plot(
    replayed: tuple[Any, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, original = replayed
    for path in original.path.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    what = page_content(study, StudyFolder(tmp_path))
    hidden = replace(what.plots[0], name="hidden", on_page=False)
    written: list[str] = []
    monkeypatch.setattr(pages, "page_content", lambda *_: replace(what, plots=[*what.plots, hidden]))
    monkeypatch.setattr(gallery, "write_figures", lambda plots, folder: written.extend(plot.name for plot in plots))
    monkeypatch.setattr(pages, "write_page", lambda *_: None)
    (tmp_path / "figures").mkdir()
    draw(study, StudyFolder(tmp_path), what.results, what.verdict)
    assert written == [plot.name for plot in what.plots]


def test_a_finished_study_is_shown_without_what_draws_it() -> None:
    code = """import sys, stemcal.cli.run, stemcal.report.redraw
from stemcal.stages.stage import STAGES
shown = [stage.showing() for stage in STAGES.built_in]
print(*sys.modules)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"numba", "matplotlib", "jinja2"} & set(done.stdout.split())
