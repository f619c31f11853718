"""Which code this is: the version's number, and a hash of the sources, which tells what the number does not."""

import functools
from pathlib import Path

from stemcal.registry import hash_of
from stemcal.version import __version__


@functools.cache
def code_version() -> str:
    """Return version and hash of the sources, alike on every system.

    >>> code_version().startswith(f"{__version__}+")
    True
    """
    return f"{__version__}+{hash_of(Path(__file__).parents[1])}"
