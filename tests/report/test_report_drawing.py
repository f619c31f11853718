"""Page and figures are drawn again where something they are made from has changed, and only there."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from stemcal.executors.local import LocalExecutor
from stemcal.folder.store import StudyFolder
from stemcal.report import drawing
from stemcal.report.figures import gallery
from stemcal.report.page import render
from stemcal.report.page.render import Shown, shown


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Count what is drawn in place of drawing it."""
    drawn: list[str] = []

    def page(_study: Any, folder: StudyFolder, _what: Shown, last_line: str) -> Path:
        drawn.append("page")
        (folder.path / "report.html").write_text(f"page {len(drawn)}\n{last_line}", "utf-8")
        return folder.path / "report.html"

    def figures(_plots: Any, folder: Path) -> list[Path]:
        drawn.append("figures")
        folder.mkdir(exist_ok=True)
        return []

    monkeypatch.setattr(render, "write_page", page)
    monkeypatch.setattr(gallery, "write_figures", figures)
    return drawn


def test_only_what_changed_is_drawn_again(
    replayed: tuple[Any, Any], tmp_path: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    study, original = replayed
    for path in original.path.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    folder = StudyFolder(tmp_path)
    what = shown(study, folder)
    results, verdict = what.results, what.verdict

    def drawn(study: Any = study, **choice: bool) -> list[str]:
        counted.clear()
        drawing.draw(study, folder, results, verdict, **choice)
        return list(counted)

    assert drawn() == ["figures", "page"]
    assert drawn() == []
    assert drawn(again=True, figures=False) == ["page"]
    assert drawn(figures=False) == []
    assert drawn() == ["figures", "page"]
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


@pytest.mark.parametrize("count", [0, 1, 2])
def test_workers_that_run_already_draw_the_same(replayed: tuple[Any, Any], results: Any, count: int) -> None:
    here, there = (gallery.gallery(replayed[0], results, {})[:4] for _ in range(2))
    with LocalExecutor(2) as executor:
        for future in [executor.submit(time.sleep, 0.5) for _ in range(count)]:
            future.result()
        drawing.draw_by_workers(there, executor)
    assert [has_drawn(plot) for plot in there] == [count == 2] * 4
    for mine, theirs in zip(here, there if count == 2 else [], strict=count == 2):
        assert (mine.document, mine.pixels) == (theirs.document, theirs.pixels), mine.name


def test_what_a_worker_dies_over_is_left_and_what_raises_raises() -> None:
    deadly, wrong = (gallery.Plot("plot", "runs", "", partial(how, 3)) for how in (os._exit, int.bit_length))
    with LocalExecutor(2) as executor:
        for future in [executor.submit(time.sleep, 0.5) for _ in range(2)]:
            future.result()
        drawing.draw_by_workers([deadly], executor)
        assert not has_drawn(deadly)
        with pytest.raises(AttributeError):
            drawing.draw_by_workers([wrong], executor)


def has_drawn(plot: gallery.Plot) -> bool:
    return {"document", "pixels"} <= plot.__dict__.keys()


def test_what_the_page_does_not_show_is_left_to_plot(
    replayed: tuple[Any, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, original = replayed
    for path in original.path.glob("*.json"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    what = shown(study, StudyFolder(tmp_path))
    hidden = replace(what.plots[0], name="hidden", on_page=False)
    written: list[str] = []
    monkeypatch.setattr(render, "shown", lambda *_: replace(what, plots=[*what.plots, hidden]))
    monkeypatch.setattr(gallery, "write_figures", lambda plots, folder: written.extend(plot.name for plot in plots))
    monkeypatch.setattr(render, "write_page", lambda *_: None)
    (tmp_path / "figures").mkdir()
    drawing.draw(study, StudyFolder(tmp_path), what.results, what.verdict)
    assert written == [plot.name for plot in what.plots]
