"""Outputs that cannot be written, such as a pipe that is closed or a full device."""

import io
import os
import sys
from contextlib import suppress
from typing import IO


class _Lossy(io.TextIOWrapper):
    """An output whose text is dropped from the first time on that it cannot be written."""

    def write(self, text: str) -> int:
        """Write or drop a text."""
        try:
            return super().write(text)
        except OSError:
            drop(self)
            return len(text)

    def flush(self) -> None:
        """Flush or drop what has been written."""
        try:
            super().flush()
        except OSError:
            drop(self)


def drop(stream: IO[str]) -> None:
    """Have all that is written to a stream from now on go nowhere."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def lossy_stderr() -> None:
    """Replace standard error by an output that never stops the work."""
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = _Lossy(sys.stderr.buffer, sys.stderr.encoding, "replace", line_buffering=True)
