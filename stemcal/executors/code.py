"""Which code this is: the version's number, and a hash of the sources, which tells what the number does not."""

import functools
import hashlib
from pathlib import Path

from stemcal.version import __version__

_SHORT = 12


@functools.cache
def code_version() -> str:
    """Return version and hash of the sources, alike on every system.

    >>> code_version().startswith(f"{__version__}+")
    True
    """
    root = Path(__file__).parents[1]
    found = hashlib.sha256()
    for path in sorted(root.rglob("*.py"), key=lambda path: path.relative_to(root).as_posix()):
        found.update(path.relative_to(root).as_posix().encode())
        found.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return f"{__version__}+{found.hexdigest()[:_SHORT]}"
