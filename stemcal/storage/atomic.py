"""Files that are written whole or not at all, in folders of stemcal's own."""

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
    """Replace `path` by a content: temporary file next to it, flush to disk, rename, flush the folder.

    A link in its place, which somebody else may have laid there, is replaced; what it leads to stays as it is.
    If the file must be `new` but exists, the result is False, and the existing file stays unchanged. Raises
    `StemcalError` if it cannot be written; a file that was there before is then unchanged.
    """
    temporary = path.with_name(f"{_PREFIX}{os.getpid()}-{next(_counter)}.tmp")
    try:
        with temporary.open("xb") as file:
            # names of files that are not UTF-8 come with surrogates
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
            temporary.unlink()  # gone already unless something failed


def make_folder(path: Path) -> Path:
    """Make a folder of stemcal's own, with those above it, unless it is there."""
    refuse_link(path)
    path.mkdir(parents=True, exist_ok=True)
    return path


def refuse_link(path: Path) -> None:
    """Raise `StemcalError` if there is a link in the place of an output that is not replaced as a whole.

    In a folder that several people can write, it could turn what is written onto any file of the user. The folder that
    a user names with ``--out`` may be a link; what stemcal makes in it may not.
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
    """Return the message of the system, and the remedy."""
    remedy = _REMEDIES.get(error.errno or 0, "fix the problem, then repeat the command; finished runs are kept")
    return f"{error.strerror or error}; {remedy}"


def remove_leftovers(*folders: Path) -> None:
    """Delete temporary files of writers that were killed. Call with the folder locked."""
    for folder in folders:
        for path in folder.glob(f"{_PREFIX}*.tmp"):
            with suppress(OSError):
                path.unlink()


def _replace(temporary: Path, path: Path) -> bool:
    """Rename; on Windows wait out a scanner or an indexer that has the file open for a moment."""
    for pause in (0.02, 0.1, 0.5, 1.0) if os.name == "nt" else ():
        try:
            temporary.replace(path)
            return True
        except PermissionError:
            time.sleep(pause)
    temporary.replace(path)
    return True


def move_new(source: Path, path: Path) -> bool:
    """Rename a file unless `path` exists, even if another process creates it at this moment; return whether it did."""
    try:
        if os.name == "nt":  # a rename never replaces a file there
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
    """Make a rename survive a power cut; Windows and some network disks cannot."""
    if os.name == "nt":
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
