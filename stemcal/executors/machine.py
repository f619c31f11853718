"""The machine that this process runs on: its cores and its memory."""

import os
import sys
from pathlib import Path

from stemcal.errors import UsageError

LEAST_SPACE = 3 * 2**29  # bytes: with 1 GiB a study breaks off; most is reserved by LLVM and OpenBLAS, never touched
_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def available_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_memory() -> float:
    """Return how many bytes of memory this process may use at most: those of the machine, or of its container."""
    import psutil

    return min([float(psutil.virtual_memory().total), *(limit for place in _LIMITS if (limit := _limit(place)))])


def require_address_space() -> None:
    """Refuse to begin under a limit of address space (``ulimit -v``) that the libraries cannot live with.

    OpenBLAS asks for memory for ever where it gets none, and hears no signal meanwhile.
    """
    if sys.platform == "win32":
        return
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_SPACE:
        had, needed = (bound / 2**20 for bound in (limit, LEAST_SPACE))
        raise UsageError(
            f"this process may use {had:.0f} MiB of address space, but {needed:.0f} MiB are needed; raise the limit "
            "(ulimit -v unlimited)"
        )


def _limit(place: str) -> float | None:
    """Return the limit of a container, None where there is none."""
    try:
        text = Path(place).read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return None
    return float(text) if text.isdigit() else None
