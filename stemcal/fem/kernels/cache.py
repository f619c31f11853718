"""Where compiled kernels are kept: in a folder that nobody else can write, for what lies there is executed.

It is a private folder per user (`STEMCAL_CACHE_DIR` moves it), per installation and per state of the kernels' sources:
numba by itself looks only at the file of the function that it caches, and would go on using a loop whose inlined parts
have changed. Where it cannot be used, as on a read-only home, one among the temporary files serves.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path

import numba
import platformdirs

_ROOM = 2**20  # bytes that must go in


def cache_folder() -> Path:
    """Return the folder for compiled kernels: the user's own, or, where that is unusable, one that is temporary."""
    return own_folder() if not unusable(own_folder()) else _spare_folder()


def own_folder() -> Path:
    """Return the folder that the user has configured, or that of his cache, be it usable or not."""
    configured = os.environ.get("STEMCAL_CACHE_DIR")
    root = Path(configured) if configured else Path(platformdirs.user_cache_dir("stemcal", appauthor=False))
    return root / _name()


def unusable(folder: Path) -> str:
    """Return why a folder cannot serve as cache, nothing if it can; it is made if it is not there."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        reason = _mistrust(folder)
        if not reason:
            with tempfile.TemporaryFile(dir=folder) as file:
                file.write(bytes(_ROOM))
    except OSError as error:
        return f"{folder} cannot be written ({error.strerror})"
    return reason


def _mistrust(folder: Path) -> str:
    """Return why what lies in a folder must not be executed, nothing if it may.

    On POSIX the folder must be this user's, no link, and not for others to write; nor may others be able to put another
    in its place. One that others can look into is closed to them. Windows keeps the user's cache in his profile.
    """
    if os.name == "nt":
        return ""
    around, top = folder.parent.stat(), folder.lstat()
    if around.st_mode & stat.S_IWOTH and not around.st_mode & stat.S_ISVTX:
        return f"{folder.parent} may be written by everyone"
    if around.st_uid not in (os.geteuid(), 0) or top.st_uid != os.geteuid():
        return f"{folder} is owned by another user, or lies in a folder of one"
    if stat.S_ISLNK(top.st_mode):
        return f"{folder} is a link"
    if top.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"{folder} may be written by others"
    if top.st_mode & 0o077:
        folder.chmod(0o700)
    return ""


def _spare_folder() -> Path:
    """Return a folder among the temporary files, the same for this user's later commands; else one for this process."""
    user = os.geteuid() if hasattr(os, "geteuid") else "all"
    found = Path(tempfile.gettempdir()) / f"stemcal-cache-{user}" / _name()
    return Path(tempfile.mkdtemp(prefix="stemcal-kernels-")) if unusable(found) else found


def _name() -> str:
    """Return a name by all kernels' sources and by their place, by which numba finds what it has compiled."""
    place = Path(__file__).parent
    digest = hashlib.sha256(str(place).encode("utf-8", "surrogateescape"))
    for source in sorted(place.glob("*.py")):
        digest.update(source.read_bytes())
    return f"kernels-{digest.hexdigest()[:12]}-numba-{numba.__version__}"
