"""The compiled kernels' cache: kept apart per state of the sources, recovered when it is damaged."""

import _thread
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

import stemcal.fem.warm as module
from stemcal.fem.kernels.compile import CACHE
from stemcal.fem.warm import is_compiled, sweep, warm
from stemcal.interrupts import heard
from stemcal.processes import Child

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


def test_caches_of_older_sources_are_swept_after_a_month(tmp_path: Path) -> None:
    """The cache in use and one used 29 days ago stay, one of 31 days goes, and nothing else is touched."""
    now = time.time()
    for name, days in (("kernels-a-numba-1", 90), ("kernels-b-numba-1", 29), ("kernels-c-numba-1", 31), ("other", 90)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "entry.nbi").write_bytes(b"")
        os.utime(tmp_path / name, (now - 86400 * days,) * 2)
    sweep(tmp_path / "kernels-a-numba-1")
    assert sorted(folder.name for folder in tmp_path.iterdir()) == ["kernels-a-numba-1", "kernels-b-numba-1", "other"]


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
    with pytest.raises(KeyboardInterrupt), heard():
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
    monkeypatch.setattr(module, "_smallest_simulation", lambda *_: pytest.fail("goes on"))
    with pytest.raises(KeyboardInterrupt), heard():
        module.warm()
    assert [psutil.pid_exists(child.pid) for child in started] == [False]
    assert not module.is_compiled()


def test_what_cannot_be_compiled_elsewhere_is_compiled_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    here: list[bool] = []
    monkeypatch.setattr(module, "CACHE", tmp_path)
    monkeypatch.setattr(module, "_smallest_simulation", lambda: here.append(True))
    for executable in (str(tmp_path / "nowhere"), sys.executable):
        monkeypatch.setattr(sys, "executable", executable)
        monkeypatch.setattr(module, "compile_all", die)  # the second child dies over it
        module.compile_once()
        module._mark().unlink()
    assert here == [True, True]


def die() -> None:
    os._exit(3)


def test_a_compilation_that_fails_is_tried_again_without_what_an_earlier_one_left(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Such as entries damaged by a crash, before anything was marked as complete. The lock stays."""
    (tmp_path / "fem").mkdir()
    (tmp_path / "fem" / "damaged.nbi").write_bytes(b"")
    found: list[bool] = []

    def compiling(*_: object) -> bool:
        found.append((tmp_path / "fem").exists())
        return len(found) > 1

    monkeypatch.setattr(module, "CACHE", tmp_path)
    monkeypatch.setattr(module, "_compiled_elsewhere", compiling)
    module.compile_once()
    assert found == [True, False] and module.is_compiled()
