"""Ending a process with everything it has started, on every system, without another package.

A worker that runs an external solver has children, often in groups of their own; killed alone, it would leave
them computing.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

_TOOL_PATIENCE_S = 10.0


def end_family(pid: int) -> None:
    """Kill a process, its descendants and the process groups that these lead; what is gone already is no error."""
    if sys.platform == "win32":
        _run(["taskkill", "/F", "/T", "/PID", str(pid)])
        return
    parents = _parents()
    heirs = descendants(pid, parents)
    _kill(pid)
    heirs |= descendants(pid, _parents())  # what it started meanwhile
    for heir in heirs:
        _kill_led_group(heir)
        _kill(heir)


def descendants(pid: int, parents: dict[int, int]) -> set[int]:
    """Return the children of a process, their children and so on.

    >>> sorted(descendants(1, {2: 1, 3: 2, 4: 3, 5: 9}))
    [2, 3, 4]
    """
    found: set[int] = set()
    front = {pid}
    while front:
        front = {child for child, parent in parents.items() if parent in front} - found
        found |= front
    return found


def _parents() -> dict[int, int]:
    """Return the parent of every process of the machine."""
    if Path("/proc/self/stat").exists():
        return dict(filter(None, map(_stat, Path("/proc").glob("[0-9]*/stat"))))
    pairs = (line.split() for line in _run(["ps", "-A", "-o", "pid=,ppid="]).splitlines())
    return {int(pid): int(parent) for pid, parent in pairs}


def _stat(path: Path) -> tuple[int, int] | None:
    """Read Linux's ``pid (name) state ppid …``; the name may hold anything, brackets too."""
    try:
        return int(path.parent.name), int(path.read_bytes().rpartition(b")")[2].split()[1])
    except (OSError, ValueError, IndexError):
        return None


def _kill(pid: int) -> None:
    with contextlib.suppress(OSError):
        os.kill(pid, signal.SIGKILL)


def _kill_led_group(pid: int) -> None:
    if sys.platform == "win32":
        return
    with contextlib.suppress(OSError):
        if os.getpgid(pid) == pid:
            os.killpg(pid, signal.SIGKILL)


def _run(command: list[str]) -> str:
    try:
        return subprocess.run(
            command, capture_output=True, text=True, errors="replace", timeout=_TOOL_PATIENCE_S, check=False
        ).stdout
    except (OSError, subprocess.SubprocessError):
        return ""
