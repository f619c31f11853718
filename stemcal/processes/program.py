"""Run a program in a folder with a time limit."""

import os
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stemcal.processes.family import APART, end_family
from stemcal.processes.limits import wait_until

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
