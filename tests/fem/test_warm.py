"""The compiled kernels' cache: kept apart per state of the sources, recovered when it is damaged."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

import stemcal.fem.warm as module
from stemcal.fem.kernels.cache import SPARE, cache_folder
from stemcal.fem.warm import sweep, warm

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


def test_warm_is_quick_once_compiled() -> None:
    warm()
    warm()


def test_cache_folder_is_ours_and_names_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same sources give the same folder below the configured place; what cannot be made gives a temporary one."""
    monkeypatch.setenv("STEMCAL_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv(SPARE, "")
    folder = cache_folder()
    assert folder.parent == tmp_path
    assert folder == cache_folder()
    occupied = tmp_path / "a-file"
    occupied.write_text("", encoding="utf-8")
    monkeypatch.setenv("STEMCAL_CACHE_DIR", str(occupied))
    spare = cache_folder()
    assert spare.is_dir()
    assert tmp_path not in spare.parents


@pytest.mark.slow
def test_a_damaged_cache_is_recovered(tmp_path: Path) -> None:
    """Every file cut off in the middle, then emptied: warm() compiles again, and the next run loads what it left."""
    assert run(tmp_path).stdout.strip() == "warm"
    files = entries(tmp_path)
    assert files
    for keep in (0.5, 0.0):
        for file in entries(tmp_path):
            data = file.read_bytes()
            file.write_bytes(data[: int(keep * len(data))])
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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_that_compiling_loses_is_raised_in_the_end(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    def losing(*_: object) -> None:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(number)

    def heeding(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(number, heeding)
    monkeypatch.setattr(module, "_smallest_simulation", losing)
    module.warm.cache_clear()
    try:
        with pytest.raises(KeyboardInterrupt):
            module.warm()
        assert signal.getsignal(number) is heeding
    finally:
        signal.signal(number, before)
        module.warm.cache_clear()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_lost_in_a_call_back_from_native_code_is_raised_at_once_and_quietly(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """As it befalls LLVM's notice of a compiled object: ctypes prints the exception and goes on."""
    gone_on: list[float] = []

    def losing(*_: object) -> None:
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(number))()
        gone_on.append(time.monotonic())
        for _ in range(500):  # bytecode between native calls, as in a compilation
            time.sleep(0.01)

    def heeding(_number: int, _frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(number, heeding)
    hook = sys.unraisablehook
    monkeypatch.setattr(module, "_smallest_simulation", losing)
    module.warm.cache_clear()
    try:
        with pytest.raises(KeyboardInterrupt):
            module.warm()
        assert time.monotonic() - gone_on[0] < 4.0
        assert signal.getsignal(number) is heeding
        assert sys.unraisablehook is hook
    finally:
        signal.signal(number, before)
        module.warm.cache_clear()
    assert capfd.readouterr().err == ""
