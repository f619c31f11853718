"""Errors become exit codes here, and nowhere else; standard output and error that stop no work.

What cannot be written is dropped. A reader that has gone (``stemcal run … | head``) is no error; data that a full disk
or a closed output swallowed are lost, so the command then ends with an error.
"""

import errno
import io
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

import typer

from stemcal.cli.console import envelope, fail, new_envelope
from stemcal.errors import SpecError, StemcalError
from stemcal.interrupts import Terminated, check, heard

RESUMES = "finished runs are kept; the same command resumes"


@contextmanager
def exit_codes() -> Iterator[None]:
    """Run a command; an exception becomes one message on stderr and an exit code."""
    new_envelope()
    with heard():
        try:
            check()
            yield
            envelope.print(0)
            sys.stdout.flush()
            check()
        except KeyboardInterrupt as interrupt:
            _leave_interrupted(interrupt)
        except StemcalError as error:
            _leave(_headed(error), error.exit_code)
        except Exception as error:
            if _is_typers_own(error):
                envelope.print(getattr(error, "exit_code", 1))
                raise
            try:
                check()
            except KeyboardInterrupt as interrupt:  # a library has made another error of it
                _leave_interrupted(interrupt)
            _leave(_unexpected(error), 1)


def _leave_interrupted(interrupt: KeyboardInterrupt) -> NoReturn:
    if isinstance(interrupt, Terminated):
        _leave(f"terminated; {RESUMES}", 143)
    _leave(f"interrupted; {RESUMES}", 130)


def _leave(message: str, code: int) -> NoReturn:
    fail(message)
    envelope.print(code)
    raise typer.Exit(code) from None


def _headed(error: StemcalError) -> str:
    """Return the message; a spec with several problems gets their number as a heading."""
    count = len(error.problems) if isinstance(error, SpecError) else 1
    return str(error) if count == 1 else f"{count} problems in the spec\n{error}"


def _is_typers_own(error: Exception) -> bool:
    """Usage errors know how to show themselves; `Exit` and `Abort` carry a decision already made."""
    return isinstance(error, typer.Exit | typer.Abort) or hasattr(error, "show")


def _unexpected(error: Exception) -> str:
    """Return one line on an unforeseen error; its traceback goes to a file, for developers to stderr."""
    if isinstance(error, MemoryError):
        return f"out of memory; use fewer workers (--workers) or larger elements; {RESUMES}"
    if isinstance(error, OSError) and error.errno is not None:
        place = f"{error.filename}: " if error.filename else ""
        from stemcal.files.durable import what_happened

        return f"{place}{what_happened(error)}"
    line = f"{type(error).__name__}: {error}".splitlines()[0]
    if os.environ.get("STEMCAL_DEBUG", "") not in ("", "0"):
        traceback.print_exception(error)
        return f"internal error: {line}"
    return f"internal error: {line} ({_file_traceback(error)})"


def _file_traceback(error: Exception) -> str:
    """Write the traceback to a new file; return a hint where it is."""
    text = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", encoding="utf-8", prefix="stemcal-traceback-", suffix=".txt", delete=False
        ) as file:
            file.write(text)
    except OSError:
        return "set STEMCAL_DEBUG=1 to see the traceback"
    return f"traceback in {file.name}"


# A reader that has gone, as Windows calls it too.
_GONE = (errno.EPIPE, errno.EINVAL) if sys.platform == "win32" else (errno.EPIPE,)
# How long to wait for the reader of a full pipe that never blocks, s, and the interval of the attempts.
_PATIENCE_S, _POLL_S = 10.0, 0.01


class _Dropping(io.RawIOBase):
    """A file whose writing never fails: after the first failure all output is dropped; `lost` is the reason."""

    def __init__(self, below: Any, lost: str = "") -> None:
        self._below, self._is_open, self.lost = below, below is not None, lost

    def write(self, content: Any) -> int:
        """Write all of it, or drop it."""
        rest = memoryview(content).cast("B")
        whole = len(rest)
        try:
            while rest and self._is_open:
                rest = rest[self._written(rest) :]
        except OSError as error:
            self._is_open = False
            self.lost = "" if error.errno in _GONE else error.strerror or "it cannot be written"
        return whole

    def _written(self, content: Any) -> int:
        """Write as much as possible and return its length; wait for a full pipe that does not block."""
        patient_until = time.monotonic() + _PATIENCE_S
        while not (count := self._below.write(content)):
            if time.monotonic() > patient_until:
                raise OSError(errno.EAGAIN, "the reading program has stopped reading")
            time.sleep(_POLL_S)
        return int(count)

    def writable(self) -> bool:
        """Return true."""
        return True

    def fileno(self) -> int:
        """Return the descriptor of the file below."""
        if self._below is None:
            raise io.UnsupportedOperation("there is no underlying file")
        return int(self._below.fileno())

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return self._below is not None and bool(self._below.isatty())


def stand_in() -> None:
    """Replace standard output and error with such streams, and closed outputs with the null device."""
    for descriptor in (0, 1, 2):  # in order: otherwise the next opened file would become an output
        with suppress(OSError):
            os.fstat(descriptor)
            continue
        os.open(os.devnull, os.O_RDWR)
    sys.stdout, sys.stderr = _over(sys.stdout), _over(sys.stderr)


def _over(stream: Any) -> io.TextIOWrapper:
    """Return a stream over another one that drops the output which that refuses."""
    if stream is None:
        return io.TextIOWrapper(io.BufferedWriter(_Dropping(None, "it is closed")), "utf-8", "replace")
    below = getattr(stream.buffer, "raw", stream.buffer)
    return io.TextIOWrapper(
        io.BufferedWriter(_Dropping(below)), stream.encoding, "replace", line_buffering=stream.line_buffering
    )


def lost_data() -> str:
    """Return why data on standard output were lost; nothing if none were."""
    sys.stdout.flush()
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    return raw.lost if isinstance(raw, _Dropping) else ""
