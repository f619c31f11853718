"""Files from outside: only plain ones are opened, up to a limit, and their encoding is detected."""

import codecs
import errno
import stat
from collections.abc import Iterable, Iterator
from io import BufferedReader
from pathlib import Path

MIB = 2**20


def open_plain(path: Path) -> BufferedReader:
    """Open a plain file for reading; a link to one is one.

    Raises
    ------
    OSError
        If there is none, or it is a folder, a device, a pipe or a socket.
    """
    mode = path.stat().st_mode  # before it is opened: a pipe without a writer would wait for one
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "is a folder", str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is a device, a pipe or a socket, not a file", str(path))
    return path.open("rb")


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
    """Return whether a plain file is there that holds just this."""
    try:
        return read_plain(path, len(content)) == content
    except OSError:
        return False


# ---- text


def decode(content: bytes) -> str | None:
    """Return the text of UTF-8, UTF-16 or GBK bytes, with or without a byte order mark; None if none fits.

    >>> decode("力/N".encode("gbk")), decode("力/N".encode("utf-16-le")), decode(b"\\xff\\xff\\xff")
    ('力/N', '力/N', None)
    """
    found = decoded(content, [*unicodes(content), "gbk"])
    return None if found is None else found[0]


def decoded(content: bytes, encodings: Iterable[str]) -> tuple[str, str] | None:
    """Return the text in the first of the encodings that fits, and that encoding; None if none does."""
    for encoding in encodings:
        try:
            return content.decode(encoding).removeprefix("\ufeff"), encoding
        except UnicodeDecodeError:
            continue
    return None


def unicodes(content: bytes) -> Iterator[str]:
    """Yield the encoding of Unicode that a text may be in: by its byte order mark, its zeros, or else UTF-8."""
    begin = content[:4000]
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        yield "utf-16"
    elif 0 in begin[:2] or begin.count(0) > len(begin) // 4:
        yield "utf-16-le" if begin[1::2].count(0) >= begin[::2].count(0) else "utf-16-be"
    else:
        yield "utf-8"


def lenient(content: bytes) -> str:
    """Return the text of a program, which should be UTF-8; what is not becomes the replacement character."""
    return content.decode("utf-8", "replace").removeprefix("\ufeff")
