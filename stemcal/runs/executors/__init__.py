"""The interface of executors, their exceptions, the simplest executor, and the cores and memory of this machine."""

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
    """An executor of runs; `ahead` is the number of runs that may be submitted before one of them has finished."""

    ahead: float = inf

    @property
    @abstractmethod
    def workers(self) -> int:
        """Number of runs computed at the same time."""


class WorkerDied(StemcalError):
    """Raised if the process that computes a run ends without an answer."""


class ClusterLost(StemcalError):
    """Raised if the connection to the cluster is lost: no run has failed, but none can be computed."""


class InlineExecutor(RunExecutor):
    """Computes each call within `submit`, in the calling thread; for fast solvers, tests and debuggers.

    >>> with InlineExecutor() as executor:
    ...     executor.submit(pow, 2, 10).result()
    1024
    """

    ahead = 1

    @property
    def workers(self) -> int:
        return 1

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        future: Future[T] = Future()
        future.set_running_or_notify_cancel()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_memory() -> float:
    """Return the memory that this process may use, bytes: that of the machine, or less in a container with a limit."""
    import psutil

    limits = [float(psutil.virtual_memory().total)]
    for place in _LIMITS:  # the files with the limits of a container
        with suppress(OSError, ValueError):
            text = Path(place).read_text(encoding="ascii").strip()
            limits += [float(text)] if text.isdigit() and int(text) > 0 else []
    return min(limits)
