"""What an executor of runs must offer beyond `concurrent.futures.Executor`, what may go wrong, and the simplest one."""

import os
from abc import abstractmethod
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import ParamSpec, TypeVar

from stemcal.errors import StemcalError

P = ParamSpec("P")
T = TypeVar("T")


class RunExecutor(Executor):
    """Computes runs; `ahead` is how many it may be given before one of them is done."""

    ahead: float = inf

    @property
    @abstractmethod
    def workers(self) -> int:
        """How many runs it computes at a time."""


class WorkerDied(StemcalError):
    """The process that computed a run ended without an answer."""


class ClusterLost(StemcalError):
    """The connection to the cluster broke: no run failed, but none can be computed now."""


class InlineExecutor(RunExecutor):
    """Computes in the calling thread while `submit` runs; for tables, tests and debuggers.

    >>> with InlineExecutor() as executor:
    ...     executor.submit(pow, 2, 10).result()
    1024
    """

    ahead = 1

    @property
    def workers(self) -> int:
        """The caller alone."""
        return 1

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Call `fn` now and return its finished future."""
        future: Future[T] = Future()
        future.set_running_or_notify_cancel()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


# ---- the machine that this process runs on


_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_memory() -> float:
    """Return the memory limit of this process in bytes: that of the machine or of its container."""
    import psutil

    limits = [float(psutil.virtual_memory().total)]
    for place in _LIMITS:  # those of a container, where there is one
        with suppress(OSError, ValueError):
            text = Path(place).read_text(encoding="ascii").strip()
            limits += [float(text)] if text.isdigit() and int(text) > 0 else []
    return min(limits)
