"""A process is ended with all its descendants, and nobody else."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from stemcal.executors.family import _parents, descendants, end_family

TREE = """
import subprocess, sys, time
depth = int(sys.argv[1])
if depth:
    subprocess.Popen([sys.executable, __file__, str(depth - 1), sys.argv[2]], start_new_session=depth == 1)
open(sys.argv[2] + str(depth), "w").close()
time.sleep(60)
"""


def test_children_and_grandchildren_in_any_session(tmp_path: Path) -> None:
    script, mark = tmp_path / "tree.py", tmp_path / "up"
    script.write_text(TREE, encoding="utf-8")
    root = subprocess.Popen([sys.executable, str(script), "2", str(mark)])
    bystander = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    try:
        end = time.monotonic() + 20.0
        while not all(Path(f"{mark}{depth}").exists() for depth in range(3)) and time.monotonic() < end:
            time.sleep(0.05)
        family = descendants(root.pid, _parents()) if os.name != "nt" else set()
        assert len(family) == 2 or os.name == "nt"
        end_family(root.pid)
        root.wait(timeout=5.0)
        while (left := family & set(_parents()) - {_zombie(pid) for pid in family}) and time.monotonic() < end:
            time.sleep(0.05)
        assert not left
        assert bystander.poll() is None
    finally:
        bystander.kill()
        bystander.wait()


def _zombie(pid: int) -> int | None:
    """Return the process if it is dead and only waits to be noticed."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return pid
    return pid if state == "Z" else None


def test_what_is_gone_is_no_error() -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    end_family(gone.pid)


@pytest.mark.skipif(os.name == "nt", reason="POSIX only")
def test_every_process_has_a_parent(monkeypatch: pytest.MonkeyPatch) -> None:
    """From /proc, and where there is none from ps."""
    assert _parents()[os.getpid()] == os.getppid()
    monkeypatch.setattr("stemcal.executors.family.Path.exists", lambda _path: False)
    listed = _parents()
    assert not listed or listed[os.getpid()] == os.getppid()  # a system without either finds nothing
