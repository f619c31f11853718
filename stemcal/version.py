"""The version of stemcal, and a hash of its sources."""

from functools import cache
from pathlib import Path

from stemcal.registry import hash_of

__version__ = "0.3.0"


@cache
def code_version() -> str:
    """Return the version and a hash of the source files, ``0.3.0+…``; the same on every operating system."""
    return f"{__version__}+{hash_of(Path(__file__).parent)}"
