"""The executor beyond one machine: runs go to the workers of a Dask scheduler.

The cluster is the user's own, started by hand or by dask-jobqueue on Slurm and PBS. On a worker each run has a
process of its own, as on one machine, so that time limits and crashes are handled alike: a run that hangs or
crashes costs itself, not the worker with all that it holds. A worker that is lost hands its runs to the others.
"""

from __future__ import annotations

import functools
import logging
import pickle
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from types import TracebackType
from typing import Any, ParamSpec, TypeVar

from stemcal import __version__
from stemcal.errors import UsageError
from stemcal.executors.base import RunExecutor
from stemcal.executors.failures import ClusterLost, WorkerDied
from stemcal.executors.local import LocalExecutor

logger = logging.getLogger(__name__)

P = ParamSpec("P")
T = TypeVar("T")

CONNECT_S = 10.0
_MOST_PROCESSES = 256
_KILLED = ("KilledWorker", "NoValidWorkerError")
_making = threading.Lock()


class DaskExecutor(RunExecutor):
    """Computes calls on the workers of the Dask scheduler at ``HOST:PORT``.

    Parameters
    ----------
    address : str
        Of the scheduler.
    time_limit : float, optional
        How long a call may take, s, counted from the moment it begins on a worker.

    Raises
    ------
    UsageError
        If Dask is not installed, nobody answers, or a worker has no stemcal or another version of it.
    """

    def __init__(self, address: str, time_limit: float | None = None) -> None:
        self.address, self.time_limit = address, time_limit
        self._client = _connected(address)
        self._tasks = self._client.get_executor(pure=False)
        try:
            self._check_versions()
        except BaseException:
            self._client.close()
            raise

    @property
    def workers(self) -> int:
        """How many runs the cluster can compute at a time, now."""
        return max(1, sum(map(int, self._client.nthreads().values())))

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Give a call to the cluster; function, arguments and result must be picklable."""
        task = self._tasks.submit(supervised, pickle.dumps((fn, args, kwargs)), self.time_limit, __version__)
        future: Future[T] = Future()
        future.add_done_callback(lambda done: task.cancel() if done.cancelled() else None)
        task.add_done_callback(functools.partial(self._hand_over, future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait for what is under way, or take it back, and leave the cluster as it was."""
        self._tasks.shutdown(wait=wait and not cancel_futures)
        self._client.close()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.shutdown(wait=kind is None)

    def _hand_over(self, future: Future[Any], task: Future[Any]) -> None:
        """Pass a task's outcome on; cancelled without our doing, it means that the scheduler is gone."""
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(task.result())
        except CancelledError:
            future.set_exception(
                ClusterLost(f"the Dask scheduler at {self.address} is gone; finished runs are kept, run again to go on")
            )
        except BaseException as error:
            future.set_exception(_translated(error))

    def _check_versions(self) -> None:
        try:
            found: dict[str, str] = self._client.run(_version)
        except Exception as error:
            raise UsageError(
                f"--executor dask://{self.address}: a worker cannot use stemcal ({error}); "
                f"install stemcal {__version__} where the workers run"
            ) from None
        if not found:
            logger.warning("the Dask scheduler at %s has no workers yet; runs wait for them", self.address)
        for worker, version in found.items():
            if version != __version__:
                raise UsageError(_mismatch(worker, version, __version__))


def supervised(blob: bytes, time_limit: float | None, version: str) -> Any:
    """Let a process of this machine compute a pickled call. Runs in a thread of a Dask worker."""
    if version != __version__:
        raise WorkerDied(_mismatch("this worker", __version__, version))
    return _processes().submit_pickled(blob, time_limit).result()


def _processes() -> LocalExecutor:
    """Return the processes of this Dask worker, one for each of its threads."""
    with _making:
        return _started_processes()


@functools.cache
def _started_processes() -> LocalExecutor:
    from distributed import get_worker

    from stemcal.fem.kernels.cache import cache_folder

    cache_folder()  # where the user's cannot be used, one temporary folder serves all processes of this worker
    return LocalExecutor(min(int(get_worker().state.nthreads), _MOST_PROCESSES))


def _version() -> str:
    return __version__


def _mismatch(worker: str, version: str, wanted: str) -> str:
    return f"{worker} has stemcal {version}, the study stemcal {wanted}; install the same version on both"


def _translated(error: BaseException) -> BaseException:
    """Return Dask's word for a run that outlived too many workers as ours."""
    if type(error).__name__ in _KILLED:
        return WorkerDied(f"the Dask workers that had it were lost: {error}")
    return error


def _connected(address: str) -> Any:
    """Return a client of the scheduler at an address."""
    try:
        from distributed import Client
    except ImportError:
        raise UsageError('--executor dask:// needs Dask; install it with `pip install "stemcal[dask]"`') from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is said by us
    try:
        return Client(f"tcp://{address}", timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"--executor dask://{address}: no Dask scheduler answers there ({error or type(error).__name__}); "
            "start one with `dask scheduler` and give its address"
        ) from None
