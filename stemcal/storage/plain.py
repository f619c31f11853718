"""Reading: only plain files, up to a limit."""

import errno
import stat
from io import BufferedReader
from pathlib import Path

MIB = 2**20


class NotPlain(OSError):
    """A path at which there is no plain file, or one that is too large."""


def unreadable(error: OSError | ValueError) -> str:
    """Return the reason for which a file cannot be read, to be put after its name."""
    reason = str(getattr(error, "strerror", None) or error)
    return reason if isinstance(error, NotPlain) else f"cannot be read: {reason}"


def open_plain(path: Path) -> BufferedReader:
    """Open a plain file, or a link to one; `NotPlain` for a folder, device, pipe or socket, else `OSError`."""
    mode = path.stat().st_mode  # before it is opened: a pipe without a writer would wait for one
    if stat.S_ISDIR(mode):
        raise NotPlain(errno.EISDIR, "is a folder", str(path))
    if not stat.S_ISREG(mode):
        raise NotPlain(errno.EINVAL, "is a device, a pipe or a socket, not a file", str(path))
    return path.open("rb")


def read_plain(path: Path, most: int) -> bytes:
    """Return the content of a plain file of at most `most` bytes; raise as `open_plain`, or `NotPlain` if larger."""
    with open_plain(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise NotPlain(errno.EFBIG, f"is larger than {most / MIB:.3g} MiB", str(path))
    return content


def holds(path: Path, content: bytes) -> bool:
    """Check for a plain file with exactly this content."""
    try:
        return read_plain(path, len(content)) == content
    except OSError:
        return False
