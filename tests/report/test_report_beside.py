"""Figures drawn by workers are those drawn here, to the byte."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from stemcal.executors.inline import InlineExecutor
from stemcal.executors.local import LocalExecutor
from stemcal.folder.store import StudyFolder
from stemcal.report.drawing import begin_early
from stemcal.report.figures.beside import Drawers
from stemcal.report.figures.gallery import Plot, gallery
from stemcal.report.figures.loading import load
from stemcal.report.figures.style import new_figure
from stemcal.report.page.render import shown


def has_drawn(plot: Plot) -> bool:
    return {"document", "pixels"} <= plot.__dict__.keys()


@pytest.fixture
def executor() -> Any:
    with LocalExecutor(2) as executor:
        executor.start(load, load, most=2)
        yield executor


def test_workers_draw_the_same(replayed: tuple[Any, Any], results: Any, executor: LocalExecutor) -> None:
    here, there = (gallery(replayed[0], results, {}) for _ in range(2))
    Drawers(executor).draw(there)
    assert all(map(has_drawn, there))
    assert "figure" not in there[0].__dict__
    for mine, theirs in zip(here, there, strict=True):
        assert (mine.document, mine.pixels) == (theirs.document, theirs.pixels), mine.name


def test_what_a_worker_dies_over_is_left_and_what_raises_raises(executor: LocalExecutor) -> None:
    deadly, wrong = (Plot("plot", "runs", "", partial(how, 3)) for how in (os._exit, int.bit_length))
    Drawers(executor).draw([deadly])
    assert not has_drawn(deadly)
    with pytest.raises(AttributeError):
        Drawers(executor).draw([wrong])


@pytest.mark.parametrize("executor", [None, InlineExecutor(), LocalExecutor(1), LocalExecutor(2)])
def test_without_workers_nothing_is_drawn_beside(replayed: tuple[Any, Any], results: Any, executor: Any) -> None:
    plots = gallery(replayed[0], results, {})[:10]  # too few to start workers for
    Drawers(executor).draw(plots)
    assert not any(map(has_drawn, plots))


# ---- figures begun early


def test_what_was_begun_early_is_drawn_once(executor: LocalExecutor, tmp_path: Path) -> None:
    with Drawers(executor) as drawers:
        drawers.begin([counted(tmp_path, "kept"), counted(tmp_path, "early")])
        plots = [counted(tmp_path, "kept"), counted(tmp_path, "late")]
        drawers.draw(plots)
        assert all(map(has_drawn, plots))
    assert sorted(path.name.split()[0] for path in tmp_path.iterdir()) in (["early", "kept", "late"], ["kept", "late"])


def test_nothing_is_begun_where_no_worker_has_started() -> None:
    with LocalExecutor(2) as executor, Drawers(executor) as drawers:
        drawers.begin([Plot("plot", "runs", "", partial(os._exit, 3))])
        assert not executor.started


def counted(folder: Path, name: str) -> Plot:
    return Plot(name, "runs", "", partial(empty, folder, name))


def empty(folder: Path, name: str) -> Any:
    """Return a figure and leave a file for each time it is made."""
    (folder / f"{name} {time.monotonic_ns()}").touch()
    return new_figure()


def test_each_figure_is_begun_with_the_stage_that_settles_it_and_stays_what_it_was(
    replayed: tuple[Any, Any], tmp_path: Path
) -> None:
    """The stages of a finished study one after the other: what was begun early is made of the same as in the end."""
    study, original = replayed
    folder, begun = StudyFolder(tmp_path), Noting()
    for stage in ("screen", "rsm", "invert", "validate"):
        (tmp_path / f"{stage}.json").write_bytes((original.path / f"{stage}.json").read_bytes())
        begin_early(study, folder, stage, begun)
    last = [plot for plot in shown(study, folder).plots if plot.on_page and plot.section != "runs"]
    assert [name for name, _ in begun.noted] == [plot.name for plot in sorted(last, key=lambda p: ORDER[p.known_with])]
    in_the_end = {plot.name: pickle.dumps(plot) for plot in last}
    assert dict(begun.noted) == in_the_end


ORDER = {"screen": 0, "rsm": 1, "invert": 2, "validate": 3}


class Noting(Drawers):
    """Notes what is to be drawn, and with what."""

    def __init__(self) -> None:
        super().__init__(None)
        self.noted: list[tuple[str, bytes]] = []

    @property
    def at_work(self) -> bool:
        return True

    def begin(self, plots: Sequence[Plot]) -> None:
        self.noted += [(plot.name, pickle.dumps(plot)) for plot in plots]
