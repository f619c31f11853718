"""Outputs that cannot be written stop no work, and data that are lost are told of."""

import io
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, ROOT

from stemcal.cli import guard

posix = pytest.mark.skipif(sys.platform == "win32", reason="shells differ")
full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device")
STEMCAL = f"'{sys.executable}' -m stemcal"
SCREEN = f"{STEMCAL} screen '{REPLAY}' --out out"


def first_of(*cases: str) -> list[Any]:
    """Try the first two cases in every run of the tests, the others among the slow ones."""
    return [*cases[:2], *(pytest.param(case, marks=pytest.mark.slow) for case in cases[2:])]


def shell(folder: Path, line: str) -> subprocess.CompletedProcess[str]:
    """Run a line of the shell; a pipe ends with the code of stemcal."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "STEMCAL_CACHE_DIR": str(folder / "cache")}
    line = f"set -o pipefail; {line}"
    return subprocess.run(
        ["bash", "-c", line], cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )


@posix
@pytest.mark.parametrize("reader", first_of("2>&1 | head -1", "2>&1 | true", "| head -c 1", "2>&1 >/dev/null | true"))
def test_work_goes_on_when_the_reader_has_gone(tmp_path: Path, reader: str) -> None:
    done = shell(tmp_path, f"{SCREEN} {reader}")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "screen.json").is_file()
    assert "Traceback" not in done.stderr and "Exception" not in done.stderr


@full
@pytest.mark.parametrize(
    "where", first_of(">/dev/full", "2>&-", ">&-", ">/dev/full 2>&1", ">&- 2>&- <&-", "2>/dev/full")
)
def test_study_is_finished_whatever_becomes_of_its_output(tmp_path: Path, where: str) -> None:
    code = 0 if where.startswith("2>") else 1
    done = shell(tmp_path, f"{SCREEN} {where}")
    assert done.returncode == code
    assert (tmp_path / "out" / "screen.json").is_file()
    assert "Traceback" not in done.stderr
    if code and "2>" not in where:
        assert "standard output: " in done.stderr and "files are complete" in done.stderr


@full
@pytest.mark.parametrize(
    "asked", first_of("--help", "check --nonsense", "screen --help", f"check '{REPLAY}'", "--version")
)
def test_texts_that_cannot_be_written(tmp_path: Path, asked: str) -> None:
    for where in (">/dev/full", ">&-", ">/dev/full 2>/dev/full", ">&- 2>&-"):
        done = shell(tmp_path, f"{STEMCAL} {asked} {where}")
        assert done.returncode == (2 if "nonsense" in asked else 1), (asked, where)
        assert "Traceback" not in done.stderr
        assert "Exception ignored" not in done.stderr
    assert shell(tmp_path, f"{STEMCAL} {asked} 2>&1 | true").returncode == (2 if "nonsense" in asked else 0)


@posix
@pytest.mark.parametrize("is_read", [True, False])
def test_a_full_pipe_that_does_not_block_is_waited_for(monkeypatch: pytest.MonkeyPatch, is_read: bool) -> None:
    """Its reader gets all; where nobody reads, writing is given up."""
    monkeypatch.setattr(guard, "_PATIENCE_S", 20.0 if is_read else 0.05)
    source, target = os.pipe()
    os.set_blocking(target, False)
    size, found = 10**6, bytearray()

    def read() -> None:
        while len(found) < size:
            found.extend(os.read(source, 4096))

    reader = threading.Thread(target=read)
    with io.FileIO(target, "wb") as below:
        stream = guard._Dropping(below)
        if is_read:
            reader.start()
        assert stream.write(bytes(size)) == size
        if is_read:
            reader.join()
    os.close(source)
    assert (len(found), stream.lost) == ((size, "") if is_read else (0, "the reading program has stopped reading"))
