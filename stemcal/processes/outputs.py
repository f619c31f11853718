"""Output streams that discard text instead of failing, for example when a pipe is closed or a device is full."""

import io
import os
import sys
from contextlib import suppress
from typing import IO


class _Lossy(io.TextIOWrapper):
    """A text stream that discards all text after the first failed write."""

    def write(self, text: str) -> int:
        try:
            return super().write(text)
        except OSError:
            drop(self)
            return len(text)

    def flush(self) -> None:
        try:
            super().flush()
        except OSError:
            drop(self)


def drop(stream: IO[str]) -> None:
    """Discard everything that is written to a stream from now on."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def lossy_stderr() -> None:
    """Replace standard error by a stream that raises no exception if a write fails."""
    if isinstance(sys.stderr, io.TextIOWrapper):
        sys.stderr = _Lossy(sys.stderr.buffer, sys.stderr.encoding, "replace", line_buffering=True)
