"""A process with all that it has started, and its end."""

import os
import subprocess
import sys
import time
from contextlib import suppress

import psutil

GRACE_S = 2.0  # for a process to end by itself
_POLL_S = 0.01
# On Windows Ctrl-C reaches all processes of a console but those of other groups.
APART = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)


def end_family(pid: int, politely: bool = False) -> None:
    """Kill a process, its descendants, group and session, even if it is gone itself; `politely` after a while."""
    asked: set[psutil.Process] = set()
    deadline = time.monotonic() + GRACE_S
    while (left := {one for one in asked | _family(pid) if _runs(one)}) and time.monotonic() < deadline:
        for process in left - asked:
            with suppress(psutil.Error):
                process.terminate() if politely else process.kill()
        asked |= left
        time.sleep(_POLL_S)


def _family(pid: int) -> set[psutil.Process]:
    """Return a process, its descendants, and the members of the group or session that it leads, without this one."""
    members = set()
    for process in psutil.process_iter():
        with suppress(OSError, psutil.Error):
            leaders = process.ppid(), process.pid
            if sys.platform != "win32":
                leaders = os.getpgid(process.pid), os.getsid(process.pid)
            if pid in leaders and process.pid != os.getpid():
                members.add(process)
    for leader in {pid, *(process.pid for process in members)}:  # also of this process, which is not among those found
        with suppress(psutil.Error):
            members.update(psutil.Process(leader).children(recursive=True))
    return {process for process in members if process.pid != os.getpid()}


def _runs(process: psutil.Process) -> bool:
    with suppress(psutil.Error):
        return process.status() != psutil.STATUS_ZOMBIE
    return False
