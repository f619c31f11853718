"""The exit codes of the command, and the conversion of errors to messages and exit codes.

A closed pipe is not an error, but a full disk is.
"""

import io
import os
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from typing import NoReturn

import typer

from stemcal.cli.console import envelope, fail
from stemcal.errors import SpecError, StemcalError
from stemcal.processes.interrupts import Terminated, raise_noted, raising_interrupts
from stemcal.processes.outputs import drop, lossy_stderr
from stemcal.registry import described

EXIT_CODES = {
    0: ("done", "success"),
    1: ("fault", "system error (disk, memory), damaged file or internal error"),
    2: ("wrong", "invalid spec or command line"),
    3: ("runs_failed", "runs failed"),
    4: ("unreachable", "the target is out of reach"),
    5: ("in_use", "another process is using the study folder"),
    6: ("waiting", "results of manual runs are pending"),
    130: ("interrupted", "interrupted by Ctrl-C"),
    143: ("terminated", "terminated by SIGTERM"),
}
"""The exit codes, each with its `status` in the JSON envelope and its meaning."""

_RESUMES = "finished runs are kept; run the same command again to resume"


@contextmanager
def exit_codes() -> Iterator[None]:
    """Run a command; convert an exception to a message on stderr and an exit code."""
    envelope.command, envelope.result, envelope.notes = "", None, []  # removes data of an earlier command in tests
    with raising_interrupts():
        try:
            raise_noted()
            yield
            envelope.print(EXIT_CODES[0][0])
            raise_noted()
        except KeyboardInterrupt as interrupt:
            _leave_interrupted(interrupt)
        except StemcalError as error:
            count = len(error.problems) if isinstance(error, SpecError) else 1
            _leave(f"the spec has {count} problems\n{error}" if count > 1 else str(error), error.exit_code)
        except BaseException as error:  # includes SystemExit from a plug-in or a library
            if isinstance(error, typer.Exit | typer.Abort) or hasattr(error, "show"):  # typer prints usage errors
                envelope.print(_status_of(getattr(error, "exit_code", 1)))
                raise
            try:
                raise_noted()
            except KeyboardInterrupt as interrupt:  # a library has turned Ctrl-C into another exception
                _leave_interrupted(interrupt)
            _leave(_unexpected(error), 1)


def _leave_interrupted(interrupt: KeyboardInterrupt) -> NoReturn:
    if isinstance(interrupt, Terminated):
        _leave(f"terminated; {_RESUMES}", 143)
    _leave(f"interrupted; {_RESUMES}", 130)


def _leave(message: str, code: int) -> NoReturn:
    fail(message)
    envelope.print(_status_of(code))
    raise typer.Exit(code) from None


def _status_of(code: int) -> str:
    return EXIT_CODES.get(code, EXIT_CODES[1])[0]


def _unexpected(error: BaseException) -> str:
    """Return the message for an unexpected error; write the traceback of an internal error to a file."""
    if isinstance(error, MemoryError):
        return f"not enough memory; use fewer workers (`--workers`) or larger elements; {_RESUMES}"
    if isinstance(error, OSError) and error.errno is not None:
        place = f"{error.filename}: " if error.filename else ""
        from stemcal.storage.atomic import what_happened

        return f"{place}{what_happened(error)}"
    line = f"internal error: {described(error)}"
    with suppress(OSError):
        descriptor, name = tempfile.mkstemp(".txt", "stemcal-traceback-")
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            traceback.print_exception(error, file=file)
        line += f" (traceback in {name})"
    return line


def prepare_process() -> None:
    """Correct environment variables, and make outputs usable that are closed or cannot encode all characters."""
    os.environ["MPLBACKEND"] = "agg"  # needs no display, since figures are only written to files
    try:
        datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), UTC)
    except (ValueError, OverflowError, OSError):
        del os.environ["SOURCE_DATE_EPOCH"]
    for descriptor in (0, 1, 2):  # a file opened later would get the number of a closed one, and receive the output
        with suppress(OSError):
            os.fstat(descriptor)
            continue
        os.open(os.devnull, os.O_RDWR)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")
    lossy_stderr()


def flush_all() -> None:
    """Flush the outputs; discard text that cannot be written, because Python would try again and fail when it exits."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            drop(stream)
