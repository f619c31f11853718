"""Terminate a process together with all processes that it started."""

import os
import subprocess
import sys
import time
from contextlib import suppress

import psutil

GRACE_S = 2.0  # time that a process has to end by itself
_POLL_S = 0.01
# On Windows, Ctrl-C reaches all processes of a console except those created with this flag.
APART = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


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
