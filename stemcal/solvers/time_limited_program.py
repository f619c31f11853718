"""Programs outside stemcal, run within a time limit and so that nothing of them is left behind.

A program gets a process group of its own. When it ends or runs past its time limit, its group and all it has started
are ended: first asked, then killed; when stemcal itself dies, the group (on Windows, the process tree). A process
whose parent is gone and that has left the group is out of reach. What a program prints is kept up to a cap.
"""

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

import psutil

from stemcal.files.encodings import lenient
from stemcal.interrupts import wait_until

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
        timed_out = not wait_until(time_limit, lambda seconds: _has_ended(process, seconds))  # not while stopped itself
    finally:
        _end_all(process)
        KEEPER.forget(process.pid)
    return Ended(process.returncode, timed_out, tail.text(), time.monotonic() - started)


def _has_ended(process: subprocess.Popen[bytes], seconds: float) -> bool:
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def _end_all(process: subprocess.Popen[bytes]) -> None:
    """Ask the program and what it has started to end, then kill what is left."""
    started = _descendants(process.pid)
    if process.poll() is None:
        _end(process.pid, started, kill=False)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_S)
        started += _descendants(process.pid)
    _end(process.pid, started, kill=True)
    process.wait()
    psutil.wait_procs(started, GRACE_S)
    deadline = time.monotonic() + GRACE_S
    while _group_is_there(process.pid) and time.monotonic() < deadline:
        time.sleep(_POLL_S)


def _descendants(pid: int) -> list[psutil.Process]:
    """Return what a process has started, and these in turn."""
    try:
        return psutil.Process(pid).children(recursive=True)
    except psutil.Error:
        return []


def _end(pid: int, started: Sequence[psutil.Process], kill: bool) -> None:
    """End a process, the group that it leads and what it has started."""
    if sys.platform != "win32":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(pid, signal.SIGKILL if kill else signal.SIGTERM)
    with contextlib.suppress(psutil.Error):
        started = [*started, psutil.Process(pid)]
    for process in started:
        with contextlib.suppress(psutil.Error):
            process.kill() if kill else process.terminate()


def _group_is_there(pid: int) -> bool:
    """Return whether a process of the group still lives; the system may take a moment to end the last."""
    if sys.platform == "win32":
        return False
    try:
        os.killpg(pid, 0)
    except (ProcessLookupError, PermissionError):
        return False
    return True


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
