"""Read regular files only (no folder, device, pipe or socket), up to a size limit."""

import errno
import stat
from io import BufferedReader
from pathlib import Path

MIB = 2**20


class NotPlain(OSError):
    """Raised for a path that is not a regular file, or for a file that is too large."""


def unreadable(error: OSError | ValueError) -> str:
    """Return the reason that a file cannot be read, as the rest of a sentence that begins with its name."""
    reason = str(getattr(error, "strerror", None) or error)
    return reason if isinstance(error, NotPlain) else f"cannot be read: {reason}"


def open_plain(path: Path) -> BufferedReader:
    """Open a regular file, or a link to one; raise `NotPlain` for a folder, device, pipe or socket."""
    mode = path.stat().st_mode  # before opening, because opening a pipe waits until some process writes to it
    if stat.S_ISDIR(mode):
        raise NotPlain(errno.EISDIR, "is a folder", str(path))
    if not stat.S_ISREG(mode):
        raise NotPlain(errno.EINVAL, "is a device, a pipe or a socket, not a file", str(path))
    return path.open("rb")


def read_plain(path: Path, most: int) -> bytes:
    """Return the content of a regular file; raise `NotPlain` for another kind of file or more than `most` bytes."""
    with open_plain(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise NotPlain(errno.EFBIG, f"is larger than {most / MIB:.3g} MiB", str(path))
    return content


def holds(path: Path, content: bytes) -> bool:
    """Check that `path` is a regular file with exactly this content."""
    try:
        return read_plain(path, len(content)) == content
    except OSError:
        return False
