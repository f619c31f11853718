"""Standard output and error that stop no work: what cannot be written is dropped, and of data it is told at the end.

A reader that has gone (``stemcal run … | head``) wants no more, which is no error; the study is finished all the same.
Data that a full disk or a closed output swallowed are lost, so the command then ends with an error.
"""

import errno
import io
import os
import sys
import time
from contextlib import suppress
from typing import Any

# A reader that has gone, as Windows calls it too.
_GONE = (errno.EPIPE, errno.EINVAL) if sys.platform == "win32" else (errno.EPIPE,)
# How long a reader of a pipe that never blocks may read nothing, s, and how often it is looked at.
_PATIENCE_S, _POLL_S = 10.0, 0.01


class _Dropping(io.RawIOBase):
    """A file whose writing never fails: from the first failure on, all is dropped. `lost` is why data were lost."""

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
        """Write what there is room for, and return how much; a full pipe that does not block is waited for."""
        patient_until = time.monotonic() + _PATIENCE_S
        while not (count := self._below.write(content)):
            if time.monotonic() > patient_until:
                raise OSError(errno.EAGAIN, "its reader reads nothing")
            time.sleep(_POLL_S)
        return int(count)

    def writable(self) -> bool:
        """Return true."""
        return True

    def fileno(self) -> int:
        """Return the descriptor of the file below."""
        if self._below is None:
            raise io.UnsupportedOperation("there is no file below")
        return int(self._below.fileno())

    def isatty(self) -> bool:
        """Return whether it is a terminal."""
        return self._below is not None and bool(self._below.isatty())


def stand_in() -> None:
    """Put such streams in the place of standard output and error; outputs that are closed become the null device."""
    for descriptor in (0, 1, 2):  # in order: else the next file to be opened would be taken for an output
        with suppress(OSError):
            os.fstat(descriptor)
            continue
        os.open(os.devnull, os.O_RDWR)
    sys.stdout, sys.stderr = _over(sys.stdout), _over(sys.stderr)


def _over(stream: Any) -> io.TextIOWrapper:
    """Return a stream that does as another does, and drops what that refuses."""
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
