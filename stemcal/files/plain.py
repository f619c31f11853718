"""The one way to open a file that others may have put there: it must be a plain file, and so much is read of it."""

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path

MIB = 2**20
# A pipe without a writer must not wait for one, a terminal must not become ours. Windows has neither flag.
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)


def open_plain(path: Path) -> BufferedReader:
    """Open a plain file for reading; a link to one is one.

    Raises
    ------
    OSError
        If there is none, or it is a folder, a device, a pipe or a socket.
    """
    _refuse_others(path.stat(), path)  # before it is opened: opening a device may do something
    descriptor = os.open(path, _FLAGS)
    try:
        _refuse_others(os.fstat(descriptor), path)
        return os.fdopen(descriptor, "rb")
    except OSError:
        os.close(descriptor)
        raise


def read_plain(path: Path, most: int) -> bytes:
    """Return the content of a plain file of at most `most` bytes.

    Raises
    ------
    OSError
        As `open_plain` does, or if the file is larger.
    """
    with open_plain(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"is larger than {most / MIB:.3g} MiB", str(path))
    return content


def holds(path: Path, content: bytes) -> bool:
    """Tell whether a plain file is there that holds just this."""
    try:
        return read_plain(path, len(content)) == content
    except OSError:
        return False


def _refuse_others(found: os.stat_result, path: Path) -> None:
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, "is a folder", str(path))
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "is not a plain file but a device, a pipe or a socket", str(path))
