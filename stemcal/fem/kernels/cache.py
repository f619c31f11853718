"""Where compiled kernels are kept: in a folder that no one else can write, because its content is executed.

It is a private folder per user (`STEMCAL_CACHE_DIR` moves it), per installation and per state of the kernels' sources:
numba by itself looks only at the file of the function that it caches, and would go on using a loop whose inlined parts
have changed.
A folder of another user, or one that others may write, is not used; nor can one on a read-only home be. A
temporary folder then serves the whole command, its worker processes too, and goes with it.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import stat
import tempfile
from pathlib import Path

import numba
import platformdirs

logger = logging.getLogger(__name__)
SPARE = "STEMCAL_SPARE_CACHE"  # passes the command's temporary folder to worker processes
_ROOM = 2**20  # bytes that must go in


def cache_folder() -> Path:
    """Return the folder for compiled kernels: the user's own, or the command's temporary one."""
    if spare := os.environ.get(SPARE):
        return Path(spare)
    folder = own_folder()
    return folder if not (reason := unusable(folder)) else _spare_folder(reason)


def own_folder() -> Path:
    """Return the folder that the user has configured, or that of his cache, be it usable or not."""
    configured = os.environ.get("STEMCAL_CACHE_DIR")
    root = Path(configured) if configured else Path(platformdirs.user_cache_dir("stemcal", appauthor=False))
    return root / f"kernels-{_sources()}-numba-{numba.__version__}"


def unusable(folder: Path) -> str:
    """Return why a folder cannot serve as cache, nothing if it can; it is made if it is not there.

    It must be this user's and no one else's to write; Windows keeps the user's cache in his profile, which is his.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.lstat()
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(_ROOM))
    except OSError as error:
        return f"{folder} cannot be written ({error.strerror})"
    if os.name != "nt" and (found.st_uid != os.geteuid() or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
        return f"other users may write to {folder}"
    return ""


def _spare_folder(reason: str) -> Path:
    """Make a temporary folder for this command and its workers; it is removed when this process ends."""
    logger.warning(
        "%s: the cache of compiled kernels is not used; this command compiles them again into a temporary folder, "
        "which takes minutes; set STEMCAL_CACHE_DIR to a folder of yours",
        reason,
    )
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
