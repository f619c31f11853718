"""Files that are there whole or not at all, and their JSON; only plain files are read."""

import errno
import hashlib
import itertools
import json
import math
import os
import stat
import time
from collections.abc import Mapping
from contextlib import suppress
from io import BufferedReader
from pathlib import Path
from typing import Any

from stemcal.errors import StemcalError

MIB = 2**20
_PREFIX = ".writing-"
_counter = itertools.count()


def write_atomic(path: Path, content: str | bytes, *, new: bool = False) -> bool:
    """Replace `path` by a content: temporary file next to it, flush to disk, rename, flush the folder.

    A link in its place, which somebody else may have laid there, is replaced; what it leads to stays as it is.
    If the file must be `new` but exists, the result is False, and the existing file stays unchanged.

    Raises
    ------
    StemcalError
        If it cannot be written; a file that was there before is then unchanged.
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
    """Return what the system reports, and what to do.

    >>> what_happened(OSError(errno.EROFS, "Read-only file system"))
    'Read-only file system; make the folder writable or choose another folder with `--out`'
    """
    remedy = _REMEDIES.get(error.errno or 0, "fix the problem, then repeat the command; finished runs are kept")
    return f"{error.strerror or error}; {remedy}"


def remove_leftovers(*folders: Path) -> None:
    """Delete temporary files of writers that were killed. Call with the folder locked."""
    for folder in folders:
        for path in folder.glob(f"{_PREFIX}*.tmp"):
            with suppress(OSError):
                path.unlink()


def as_json(content: Any) -> str:
    """Return JSON for files: keys in the order given, two spaces, a newline at the end.

    >>> print(as_json({"b": 0.1, "a": float("nan")}), end="")
    {
      "b": 0.1,
      "a": null
    }
    """
    return json.dumps(plain(content), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def canonical(content: Any) -> str:
    """Return the JSON text of a content, which does not depend on the order of its keys.

    >>> canonical({"b": 1.0, "a": [1, None]})
    '{"a":[1,null],"b":1.0}'
    """
    return json.dumps(plain(content), ensure_ascii=True, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(content: Any) -> str:
    """Return the SHA-256 of a content's canonical JSON."""
    return hashlib.sha256(canonical(content).encode("ascii")).hexdigest()


def key_of(identity: Mapping[str, Any]) -> str:
    """Return the name of the record of a run: a hash of what determines the answer."""
    return digest(identity)[:32]


def plain(content: Any) -> Any:
    """Return a content in types of JSON: numpy numbers and arrays unpacked, NaN and infinity as None."""
    if isinstance(content, float):  # numpy's float64 too
        return float(content) if math.isfinite(content) else None
    if isinstance(content, str):  # what UTF-8 cannot hold is spelled out
        return content.encode("utf-8", "backslashreplace").decode("utf-8")
    if content is None or isinstance(content, bool | int):
        return content
    if isinstance(content, Mapping):
        return {str(key): plain(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [plain(value) for value in content]
    if isinstance(content, Path):
        return content.as_posix()
    if hasattr(content, "tolist"):  # numpy
        return plain(content.tolist())
    raise TypeError(f"{type(content).__name__} cannot be written as JSON")


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


# ---- read: only plain files, up to a limit


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
