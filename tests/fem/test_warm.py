"""The compiled kernels' cache: kept apart per state of the sources, recovered when it is damaged."""

import _thread
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

import stemcal.fem.warm as module
from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.warm import is_compiled, warm
from stemcal.processes.child import Child
from stemcal.processes.interrupts import raising_interrupts

WARM = "from stemcal.fem.warm import warm; warm(); print('warm')"


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    root = Path(__file__).parents[2]
    path = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "STEMCAL_CACHE_DIR": str(folder), "PYTHONPATH": path}
    return subprocess.run(
        [sys.executable, "-c", WARM], env=environment, capture_output=True, text=True, encoding="utf-8", check=False
    )


def entries(folder: Path) -> list[Path]:
    return sorted(p for p in folder.rglob("*") if p.suffix in {".nbi", ".nbc"})


def test_nothing_is_compiled_again_once_it_is() -> None:
    warm()
    assert is_compiled()
    before = {path: path.stat().st_mtime_ns for path in entries(CACHE)}
    warm()
    assert before and {path: path.stat().st_mtime_ns for path in entries(CACHE)} == before


@pytest.mark.slow
def test_a_damaged_cache_is_recovered(tmp_path: Path) -> None:
    """Every file cut off in the middle, then emptied: warm() compiles again, and the next run loads what it left."""
    assert run(tmp_path).stdout.strip() == "warm"
    files = entries(tmp_path)
    assert files
    for keep, marked in ((0.5, True), (0.0, True), (0.5, False)):
        for file in entries(tmp_path):
            data = file.read_bytes()
            file.write_bytes(data[: int(keep * len(data))])
        if not marked:
            for mark in tmp_path.rglob("complete-*"):
                mark.unlink()
        again = run(tmp_path)
        assert again.returncode == 0, again.stderr
        assert again.stdout.strip() == "warm"
    after = {file: file.stat().st_mtime_ns for file in entries(tmp_path)}
    assert after
    assert run(tmp_path).returncode == 0
    assert {file: file.stat().st_mtime_ns for file in entries(tmp_path)} == after


@pytest.fixture(params=[signal.SIGINT, signal.SIGTERM])
def number(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[signal.Signals]:
    """A signal, while nothing is compiled yet."""
    monkeypatch.setattr(module, "CACHE", tmp_path)
    module.warm.cache_clear()
    yield request.param
    module.warm.cache_clear()


def test_interrupts_while_kernels_load_wait_for_the_end(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone_on: list[int] = []

    def loading(*_: object) -> None:
        for turn in range(2):
            signal.raise_signal(number)
            gone_on.append(turn)

    monkeypatch.setattr(module, "_compiled_elsewhere", lambda *_: True)
    monkeypatch.setattr(module, "_smallest_simulation", loading)
    with pytest.raises(KeyboardInterrupt), raising_interrupts():
        module.warm()
    assert gone_on == [0, 1]


def test_an_interrupt_while_kernels_are_compiled_is_heard_at_once(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What compiles is a process of its own, and is gone."""
    started: list[Child] = []

    def noting() -> Child:
        started.append(Child())
        threading.Timer(0.3, _thread.interrupt_main, [number]).start()
        return started[-1]

    monkeypatch.setattr(module, "Child", noting)
    monkeypatch.setattr(module, "_load", lambda _layered: pytest.fail("goes on"))
    with pytest.raises(KeyboardInterrupt), raising_interrupts():
        module.warm()
    assert [psutil.pid_exists(child.pid) for child in started] == [False]
    assert not module.is_compiled()


def test_what_cannot_be_compiled_elsewhere_is_compiled_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    here: list[bool] = []
    monkeypatch.setattr(module, "CACHE", tmp_path)
    monkeypatch.setattr(module, "_smallest_simulation", lambda _layered: here.append(True))
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nowhere"))
    module.compile_once()
    assert here == [True] and module.is_compiled()


def test_nothing_is_left_of_a_compilation_that_was_broken_off(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Such as entries damaged by a crash, before anything was marked as complete. The lock stays."""
    (tmp_path / "fem").mkdir()
    (tmp_path / "fem" / "damaged.nbi").write_bytes(b"")
    found: list[bool] = []
    monkeypatch.setattr(module, "CACHE", tmp_path)
    monkeypatch.setattr(module, "_compiled_elsewhere", lambda _layered: not found.append((tmp_path / "fem").exists()))
    module.compile_once()
    module.compile_once()
    assert found == [False] and module.is_compiled()
