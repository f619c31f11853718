"""What an executor of runs must offer beyond `concurrent.futures.Executor`, what may go wrong, and the simplest one."""

from abc import abstractmethod
from collections.abc import Callable
from concurrent.futures import Executor, Future
from math import inf
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


class RunTimedOut(StemcalError):
    """A run took longer than its time limit and was ended."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"it exceeded its time limit of {limit:g} s and was terminated")


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
