"""Programs outside stemcal, run so that nothing of them is left behind.

A program gets a process group of its own (on Windows, its process tree is taken). When it ends, runs past its time
limit, or stemcal itself dies, the whole group is ended: first asked, then killed. A process that leaves its group on
purpose is out of reach. What it prints is kept up to a cap.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from stemcal.files.decoding import lenient
from stemcal.interrupts import wait_until

__all__ = ["KEEPER", "Ended", "run_program"]

GRACE_S = 2.0  # between asking a group to end and killing it
_POLL_S = 0.005
KEPT_BYTES = 64 * 1024  # the last of what a program prints


@dataclass(frozen=True)
class Ended:
    """How a program ended: its exit code, whether it was stopped at its time limit, the last it printed."""

    code: int
    timed_out: bool
    output: str
    seconds: float


def run_program(command: Sequence[str], folder: Path, environment: Mapping[str, str], time_limit: float) -> Ended:
    """Run a program in `folder` until it ends or `time_limit` seconds have passed.

    Raises
    ------
    OSError
        If it cannot be started.
    """
    started = time.monotonic()
    KEEPER.wake()
    process = subprocess.Popen(
        list(command),
        cwd=folder,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
        creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
    )
    KEEPER.watch(process.pid)
    tail = _Tail(process.stdout)
    try:
        timed_out = _wait(process, time_limit)
    finally:
        _end_group(process)
        KEEPER.forget(process.pid)
    return Ended(process.returncode, timed_out, tail.text(), time.monotonic() - started)


def _wait(process: subprocess.Popen[bytes], time_limit: float) -> bool:
    """Wait for the program; return whether it ran past its limit."""
    return not wait_until(time_limit, lambda seconds: _has_ended(process, seconds))


def _has_ended(process: subprocess.Popen[bytes], seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """Ask what is left of the group to end, then kill it."""
    if process.poll() is None:
        _signal_group(process.pid, kill=False)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_S)
    _signal_group(process.pid, kill=True)
    process.wait()
    deadline = time.monotonic() + GRACE_S
    while _group_is_there(process.pid) and time.monotonic() < deadline:
        time.sleep(_POLL_S)


def _group_is_there(pid: int) -> bool:
    """Return whether a process of the group still lives; the system may take a moment to end the last."""
    if sys.platform == "win32":
        return False
    try:
        os.killpg(pid, 0)
    except (ProcessLookupError, PermissionError):
        return False
    return True


def _signal_group(pid: int, kill: bool) -> None:
    if sys.platform == "win32":
        subprocess.run(["taskkill", "/T", "/F", "/PID", str(pid)], capture_output=True, check=False)
    else:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(pid, signal.SIGKILL if kill else signal.SIGTERM)


class _Tail:
    """Reads a pipe to its end in a thread and keeps the last of it."""

    def __init__(self, pipe: IO[bytes] | None) -> None:
        self._kept = bytearray()
        self._dropped = False
        self._thread = threading.Thread(target=self._read, args=(pipe,), name="output", daemon=True)
        self._thread.start()

    def _read(self, pipe: IO[bytes]) -> None:
        with pipe, contextlib.suppress(OSError, ValueError):
            while chunk := pipe.read1(65536):  # type: ignore[attr-defined]
                self._kept += chunk
                if len(self._kept) > KEPT_BYTES:
                    self._dropped = True
                    del self._kept[:-KEPT_BYTES]

    def text(self) -> str:
        """Return what was kept; a process that left its group may still hold the pipe, so the wait is short."""
        self._thread.join(GRACE_S)
        text = lenient(bytes(self._kept)).replace("\0", "\N{REPLACEMENT CHARACTER}")
        return f"[…]{text}" if self._dropped else text


# Ends the groups it was told of when its standard input closes: when the process that told it is no more.
_KEEPING = """
import os, signal, subprocess, sys
watched = set()
for line in sys.stdin:
    sign, pid = line[0], int(line[1:])
    (watched.add if sign == "+" else watched.discard)(pid)
for pid in watched:
    if os.name == "nt":
        subprocess.run(["taskkill", "/T", "/F", "/PID", str(pid)], capture_output=True)
    else:
        try:
            os.killpg(pid, signal.SIGKILL)
        except OSError:
            pass
"""


class _Keeper:
    """A small process that outlives this one just long enough to end the programs it has started."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def wake(self) -> None:
        """Start the process unless it runs; before the program, so that the two are never apart for long."""
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._process = subprocess.Popen(
                    [sys.executable, "-I", "-S", "-c", _KEEPING],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,
                )

    def watch(self, pid: int) -> None:
        """End the group of `pid` if this process dies."""
        self._tell(f"+{pid}\n")

    def forget(self, pid: int) -> None:
        """The group of `pid` is gone."""
        self._tell(f"-{pid}\n")

    def _tell(self, line: str) -> None:
        with self._lock, contextlib.suppress(OSError):
            if self._process is not None and self._process.stdin is not None:
                self._process.stdin.write(line.encode())
                self._process.stdin.flush()


KEEPER = _Keeper()
