"""Files and folders that stemcal writes: never through a link, which somebody else may have laid there.

In a folder that several people can write, a link called as an output will be could turn what is written onto any
file of the user. The folder that a user names with ``--out`` may be a link; what stemcal makes in it may not.
"""

import errno
import os
from pathlib import Path
from typing import BinaryIO

from stemcal.errors import StemcalError

_NEW = os.O_WRONLY | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
_NEW |= getattr(os, "O_NONBLOCK", 0)  # a pipe that nobody reads must not wait for a reader
_NO_LINKS = (errno.ELOOP, getattr(errno, "EMLINK", errno.ELOOP))  # as Linux and BSD call it


def open_output(path: Path, append: bool = False) -> BinaryIO:
    """Open a file to write it anew, or with `append` at its end.

    Raises
    ------
    StemcalError
        If there is a link in its place.
    OSError
        If it cannot be opened for another reason.
    """
    refuse_link(path)
    try:
        descriptor = os.open(path, _NEW | (os.O_APPEND if append else os.O_TRUNC), 0o666)
    except OSError as error:
        if error.errno in _NO_LINKS:
            raise _link(path) from None
        raise
    return os.fdopen(descriptor, "ab" if append else "wb")


def write_output(path: Path, content: str | bytes) -> None:
    """Write a file anew; texts in UTF-8, their lines as they are."""
    with open_output(path) as file:
        file.write(content.encode("utf-8") if isinstance(content, str) else content)


def make_folder(path: Path) -> Path:
    """Make a folder of stemcal's own, with those above it, unless it is there."""
    refuse_link(path)
    path.mkdir(parents=True, exist_ok=True)
    return path


def refuse_link(path: Path) -> None:
    """Raise `StemcalError` if there is a link in the place of an output."""
    if path.is_symlink():
        raise _link(path)


def _link(path: Path) -> StemcalError:
    return StemcalError(
        f"{path} is a link, and outputs are not written through links; remove it, or name another place"
    )
