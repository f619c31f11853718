"""Run a program in a folder with a time limit, and terminate a process together with all that it started."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psutil

from stemcal.processes.limits import wait_until

GRACE_S = 2.0  # time that a process has to end by itself
_POLL_S = 0.01
# On Windows, Ctrl-C reaches all processes of a console except those created with this flag.
APART = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
_KEPT_BYTES = 64 * 1024  # only the end of the output, of this length, is kept


@dataclass(frozen=True)
class ProgramRun:
    """Exit code of a program, whether it exceeded its time limit, the end of its output, and its duration (s)."""

    code: int
    timed_out: bool
    output: str
    seconds: float


def run_program(command: Sequence[str], folder: Path, environment: Mapping[str, str], time_limit: float) -> ProgramRun:
    """Run a program in `folder` until it ends or `time_limit` (s) has passed; raise `OSError` if it cannot start."""
    started = time.monotonic()
    with tempfile.TemporaryFile() as printed:
        process = subprocess.Popen(
            list(command),
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=subprocess.STDOUT,
            process_group=None if os.name == "nt" else 0,
            creationflags=APART,
        )
        try:
            timed_out = not wait_until(time_limit, partial(_has_ended, process))
            if timed_out:
                end_family(process.pid, politely=True)
        finally:
            end_family(process.pid)
            process.wait()
        printed.seek(max(0, printed.seek(0, os.SEEK_END) - _KEPT_BYTES))
        output = printed.read(_KEPT_BYTES).decode("utf-8", "replace").removeprefix("\ufeff")
    output = output.replace("\0", "\N{REPLACEMENT CHARACTER}")
    return ProgramRun(process.returncode, timed_out, output, time.monotonic() - started)


def _has_ended(process: subprocess.Popen[bytes], seconds: float) -> bool:
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)
    return process.returncode is not None


def end_family(pid: int, politely: bool = False) -> None:
    """Kill a process, its descendants, and its process group and session, even if the process itself has ended.

    With `politely`, the processes are only asked to terminate (SIGTERM), and have `GRACE_S` seconds to do so.
    """
    signalled: set[psutil.Process] = set()
    deadline = time.monotonic() + GRACE_S
    while (alive := set(filter(_runs, signalled | _family(pid)))) and time.monotonic() < deadline:
        for process in alive - signalled:
            with suppress(psutil.Error):
                process.terminate() if politely else process.kill()
        signalled |= alive
        time.sleep(_POLL_S)


def _family(pid: int) -> set[psutil.Process]:
    """Return the process `pid`, its descendants and the members of its group and session, except this process."""
    members = set()
    for process in psutil.process_iter():
        with suppress(OSError, psutil.Error):
            leaders = process.ppid(), process.pid
            if sys.platform != "win32":
                leaders = os.getpgid(process.pid), os.getsid(process.pid)
            if pid in leaders and process.pid != os.getpid():
                members.add(process)
    for leader in {pid, *(process.pid for process in members)}:  # `pid` may be this process, which is not in `members`
        with suppress(psutil.Error):
            members.update(psutil.Process(leader).children(recursive=True))
    return {process for process in members if process.pid != os.getpid()}


def _runs(process: psutil.Process) -> bool:
    with suppress(psutil.Error):
        return process.status() != psutil.STATUS_ZOMBIE
    return False
