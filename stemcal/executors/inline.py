"""The executor without processes: everything happens in the caller, at once."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import ParamSpec, TypeVar

from stemcal.executors.base import RunExecutor

P = ParamSpec("P")
T = TypeVar("T")


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
