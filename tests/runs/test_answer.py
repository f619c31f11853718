"""What is done while workers compute holds no record up."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from fakes import FakeSolver, make_study

from stemcal.executors.inline import InlineExecutor
from stemcal.executors.local import LocalExecutor
from stemcal.folder.store import StudyFolder
from stemcal.runs.answer import Progress, answer_all
from stemcal.solvers.protocol import Answer, Request


def answered(
    folder: StudyFolder, executor: LocalExecutor | InlineExecutor, meanwhile: Callable[[], object], watch: object
) -> list[Answer]:
    levels = make_study(folder.path.parent).midlevels()
    requests = [Request("screen", row, levels, 7.0 + row) for row in range(3)]
    with folder, executor:
        return answer_all(requests, FakeSolver(), folder, executor, watch, meanwhile=meanwhile)


def test_records_are_written_while_something_else_is_done(tmp_path: Path) -> None:
    """It ends only once all is recorded, and no answer is given before it has ended."""
    folder, recorded, ended = StudyFolder(tmp_path / "out"), threading.Event(), threading.Event()

    def watch(progress: Progress) -> None:
        if progress.done == progress.total:
            recorded.set()

    def meanwhile() -> None:
        assert recorded.wait(60.0)
        ended.set()

    answers = answered(folder, LocalExecutor(2), meanwhile, watch)
    assert ended.is_set() and [answer.ok for answer in answers] == [True] * 3


def test_its_failure_is_no_matter(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    answers = answered(StudyFolder(tmp_path / "out"), LocalExecutor(2), lambda: 1 / 0, lambda _: None)
    assert all(answer.ok for answer in answers)
    assert "ZeroDivisionError" not in capfd.readouterr().err


def test_who_computes_himself_does_nothing_beside(tmp_path: Path) -> None:
    done: list[int] = []
    answered(StudyFolder(tmp_path / "out"), InlineExecutor(), lambda: done.append(1), lambda _: None)
    assert done == []
