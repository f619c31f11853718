"""Where compiled kernels are kept: in a folder that no one else can write, because its content is executed.

It is a private folder per user (`STEMCAL_CACHE_DIR` moves it), per installation and per state of the kernels' sources:
numba by itself looks only at the file of the function that it caches, and would go on using a loop whose inlined parts
have changed. A folder of another user, or one that others may write, is not used; nor can one on a read-only home
be. One among the temporary files then serves.
"""

from __future__ import annotations

import hashlib
import os
import stat
import tempfile
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


def _spare_folder() -> Path:
    """Return a folder among the temporary files: the same for this user's later commands, else for this process."""
    user = os.geteuid() if hasattr(os, "geteuid") else "user"
    found = Path(tempfile.gettempdir()) / f"stemcal-{user}-{_name()}"
    return Path(tempfile.mkdtemp(prefix="stemcal-kernels-")) if unusable(found) else found


def _name() -> str:
    """Return a name by all kernels' sources and by their place, by which numba finds what it has compiled."""
    place = Path(__file__).parent
    digest = hashlib.sha256(str(place).encode("utf-8", "surrogateescape"))
    for source in sorted(place.glob("*.py")):
        digest.update(source.read_bytes())
    return f"kernels-{digest.hexdigest()[:12]}-numba-{numba.__version__}"
