"""Where compiled kernels are kept: in a folder that nobody else can write, for what lies there is executed.

It is a private folder per user (`STEMCAL_CACHE_DIR` moves it), per installation and per state of the kernels' sources:
numba by itself looks only at the file of the function that it caches, and would go on using a loop whose inlined parts
have changed.
One that belongs to somebody else, or that others may write, is not used; nor can one on a read-only home be. A
temporary folder then serves the whole command, its worker processes too, and goes with it.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

import numba
import platformdirs

SPARE = "STEMCAL_SPARE_CACHE"  # tells worker processes of the command's temporary folder
_ROOM = 2**20  # bytes that must go in
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_OTHERS_ENTER = stat.S_IXGRP | stat.S_IXOTH


def cache_folder() -> Path:
    """Return the folder for compiled kernels: the user's own, or the command's temporary one."""
    spare = os.environ.get(SPARE)
    if spare and not mistrust(Path(spare)):
        return Path(spare)
    return own_folder() if not unusable(own_folder()) else _spare_folder()


def own_folder() -> Path:
    """Return the folder that the user has configured, or that of his cache, be it usable or not."""
    configured = os.environ.get("STEMCAL_CACHE_DIR")
    root = Path(configured) if configured else Path(platformdirs.user_cache_dir("stemcal", appauthor=False))
    return root / f"kernels-{_sources()}-numba-{numba.__version__}"


def unusable(folder: Path) -> str:
    """Return why a folder cannot serve as cache, nothing if it can; it is made if it is not there."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        reason = mistrust(folder)
        if not reason:
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(bytes(_ROOM))
    except OSError as error:
        return f"{folder} cannot be written ({error.strerror})"
    return reason


def mistrust(folder: Path) -> str:
    """Return why what lies in a folder must not be executed, nothing if it may.

    On POSIX the folder and all in it must be this user's, no link, and not for others to write. Neither all the world
    nor another user than root may be able to put another in its place. A folder that others can look into is closed to
    them. Windows keeps the user's cache in his profile, which is his.
    """
    if os.name == "nt":
        return ""
    try:
        around, top = folder.parent.stat(), folder.lstat()
        if around.st_mode & stat.S_IWOTH and not around.st_mode & stat.S_ISVTX:
            return f"every user may write to {folder.parent}"
        if around.st_uid not in (os.geteuid(), 0):
            return f"{folder.parent} is owned by another user"
        reason = _strange(folder, top, open_to_others=True)
        if reason:
            return reason
        open_to_others = bool(top.st_mode & _OTHERS_ENTER)
        reasons = (_strange(entry, entry.lstat(), open_to_others) for entry in folder.rglob("*"))
        reason = next(filter(None, reasons), "")
        if not reason and top.st_mode & 0o077:
            folder.chmod(0o700)
    except OSError as error:
        return f"{error.filename or folder}: {error.strerror}"
    return reason


def _strange(path: Path, status: os.stat_result, open_to_others: bool) -> str:
    """Return why a file or folder is not to be trusted; behind a closed door its own rights do not matter."""
    if stat.S_ISLNK(status.st_mode):
        return f"{path} is a link"
    if status.st_uid != os.geteuid():
        return f"{path} is owned by another user"
    if open_to_others and status.st_mode & _OTHERS_WRITE:
        return f"other users may write to {path}"
    return ""


def _spare_folder() -> Path:
    """Make a temporary folder for this command; it is removed when this process ends."""
    folder = Path(tempfile.mkdtemp(prefix="stemcal-kernels-"))
    os.environ[SPARE] = str(folder)
    atexit.register(_remove, folder, os.getpid())
    return folder


def _remove(folder: Path, owner: int) -> None:
    if os.getpid() == owner:  # not a copy of the process
        shutil.rmtree(folder, ignore_errors=True)


def _sources() -> str:
    """Return a short hash of all kernels' sources and of their place, by which numba finds what it has compiled."""
    place = Path(__file__).parent
    digest = hashlib.sha256(str(place).encode("utf-8", "surrogateescape"))
    for source in sorted(place.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]
