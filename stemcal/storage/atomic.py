"""Atomic writing: a reader finds the complete new file or the unchanged old one, even if the program is killed."""

import errno
import itertools
import os
import time
from contextlib import suppress
from pathlib import Path

from stemcal.errors import StemcalError

_PREFIX = ".writing-"
_counter = itertools.count()


def write_atomic(path: Path, content: str | bytes, *, new: bool = False) -> bool:
    """Write `content` to `path` atomically; return True if the file was written.

    A temporary file in the same folder is written, flushed to disk and renamed. A symbolic link at `path` is replaced;
    the file it refers to stays unchanged. With `new`, an existing file is kept and the result is False. Raises
    `StemcalError` if writing fails; an existing file is then unchanged.
    """
    temporary = path.with_name(f"{_PREFIX}{os.getpid()}-{next(_counter)}.tmp")
    try:
        with temporary.open("xb") as file:
            # a file name in `content` may contain surrogates, by which Python represents bytes that are not UTF-8
            file.write(content.encode("utf-8", "surrogateescape") if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        written = move_new(temporary, path) if new else _replace(temporary, path)
        _flush_folder(path.parent)
        return written
    except OSError as error:
        raise StemcalError(f"{path}: {what_happened(error)}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()  # exists only if something failed


def make_folder(path: Path) -> Path:
    """Create an output folder and its parents unless they exist; return its path."""
    refuse_link(path)
    path.mkdir(parents=True, exist_ok=True)
    return path


def refuse_link(path: Path) -> None:
    """Raise `StemcalError` if an output path is a symbolic link.

    In a folder that several people can write to, such a link could redirect the output into any file of the user. The
    folder named with ``--out`` may be a link, but no file or folder that stemcal creates in it.
    """
    if path.is_symlink():
        raise StemcalError(
            f"{path} is a symbolic link, and stemcal writes only to regular files; remove the link or choose another "
            "path"
        )


_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}
_REMEDIES = {
    **dict.fromkeys(_FULL, "free some disk space, then repeat the command; finished runs are kept"),
    errno.EROFS: "make the folder writable or choose another folder with `--out`",
    errno.EACCES: "make the folder writable or choose another folder with `--out`",
    errno.ENOENT: "the folder was deleted or moved; repeat the command to create the folder again",
}


def what_happened(error: OSError) -> str:
    """Return the message of the operating system, followed by a remedy."""
    remedy = _REMEDIES.get(error.errno or 0, "fix the problem, then repeat the command; finished runs are kept")
    return f"{error.strerror or error}; {remedy}"


def remove_leftovers(*folders: Path) -> None:
    """Delete temporary files of killed processes. The caller must hold the lock of the study folder."""
    for folder in folders:
        for path in folder.glob(f"{_PREFIX}*.tmp"):
            with suppress(OSError):
                path.unlink()


def _replace(temporary: Path, path: Path) -> bool:
    # on Windows a virus scanner or an indexer can have the file open for a moment
    for pause in (0.02, 0.1, 0.5, 1.0) if os.name == "nt" else ():
        try:
            temporary.replace(path)
            return True
        except PermissionError:
            time.sleep(pause)
    temporary.replace(path)
    return True


def move_new(source: Path, path: Path) -> bool:
    """Rename `source` to `path` unless `path` exists, even with concurrent writers; return True if it was renamed."""
    try:
        if os.name == "nt":  # on Windows a rename never replaces an existing file
            source.rename(path)
        else:
            os.link(source, path)
            source.unlink()
    except FileExistsError:
        return False
    except OSError:  # a file system without hard links
        if path.exists():
            return False
        source.replace(path)
    return True


def _flush_folder(folder: Path) -> None:
    if os.name == "nt":  # Windows cannot flush a folder
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as error:
        if error.errno in (errno.EIO, errno.ENOSPC):
            raise
