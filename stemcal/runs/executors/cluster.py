"""The executor for a cluster: runs are computed by the workers of a Dask scheduler.

The user starts the cluster, by hand or with dask-jobqueue on Slurm or PBS. On a worker, each run has a separate
process, as in `LocalExecutor`, so that a run that hangs or crashes does not affect the worker. If a worker is lost,
Dask passes its runs to other workers. The processes end with the command, if the connection to them is not lost.
"""

import functools
import logging
import pickle
import threading
import uuid
import warnings
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from typing import Any, ParamSpec, TypeVar

from stemcal.errors import UsageError
from stemcal.runs.executors import ClusterLost, RunExecutor, WorkerDied
from stemcal.runs.executors.local import LocalExecutor
from stemcal.version import __version__, code_version

logger = logging.getLogger(__name__)

P = ParamSpec("P")
T = TypeVar("T")

CONNECT_S = 10.0
_DISCONNECT_S = 5.0  # time limit for notifying the workers that a command ends
_LOUD = ("distributed", "tornado", "asyncio", "bokeh")
_MOST_PROCESSES = 256
_KILLED, _OF_DASK = ("KilledWorker", "NoValidWorkerError"), ("distributed", "tornado")
_making = threading.Lock()


class DaskExecutor(RunExecutor):
    """Computes calls on the workers of the Dask scheduler at ``HOST:PORT``, each within a time limit in s.

    The limit starts when a call begins on a worker. Raises `UsageError` if Dask is not installed, no scheduler
    responds, or stemcal on a worker is missing or differs from that of this process.
    """

    def __init__(self, address: str, time_limit: float | None = None) -> None:
        self.address, self.time_limit = address, time_limit
        self._session = uuid.uuid4().hex
        self._client = _connected(address)
        self._tasks = self._client.get_executor(pure=False)
        try:
            self._check_versions()
        except BaseException:
            self._client.close()
            raise

    @property
    def workers(self) -> int:
        """Number of runs that the cluster can compute at the same time at present."""
        try:
            return max(1, sum(map(int, self._client.nthreads().values())))
        except Exception:
            raise self._lost() from None

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Pass a call to the cluster; function, arguments and result must be picklable."""
        call = pickle.dumps((fn, args, kwargs)), self.time_limit, code_version(), self._session
        try:
            task = self._tasks.submit(_supervised, *call)
        except Exception:
            raise self._lost() from None
        future: Future[T] = Future()
        future.add_done_callback(lambda done: task.cancel() if done.cancelled() else None)
        task.add_done_callback(functools.partial(self._hand_over, future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait for the running calls, or end them on the workers; then disconnect. The cluster keeps running."""
        with suppress(Exception):  # the cluster may be lost
            self._tasks.shutdown(wait=wait and not cancel_futures)
        _at_most(_DISCONNECT_S, lambda: self._client.run(_end_session, self._session))
        _at_most(_DISCONNECT_S, self._client.close)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.shutdown(wait=kind is None)

    def _hand_over(self, future: Future[Any], task: Future[Any]) -> None:
        """Copy the outcome of a Dask task to a future; if Dask has cancelled the task, the scheduler was lost."""
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(task.result())
        except BaseException as error:
            if type(error).__name__ in _KILLED:  # several workers died during the run
                future.set_exception(WorkerDied(f"the Dask workers of this run were lost: {error}"))
            elif isinstance(error, CancelledError) or type(error).__module__.partition(".")[0] in _OF_DASK:
                future.set_exception(self._lost())
            else:
                future.set_exception(error)

    def _lost(self) -> ClusterLost:
        return ClusterLost(
            f"the connection to the Dask scheduler at {self.address} was lost; repeat the command to resume (finished "
            "runs are kept)"
        )

    def _check_versions(self) -> None:
        try:
            versions: dict[str, str] = self._client.run(code_version)
        except Exception as error:
            raise UsageError(
                f"--executor dask://{self.address}: a worker cannot import stemcal ({error}); install stemcal "
                f"{__version__} on its machine"
            ) from None
        if not versions:
            logger.warning("the Dask scheduler at %s has no workers yet; the runs are waiting", self.address)
        for worker, version in versions.items():
            if version != code_version():
                raise UsageError(_mismatch(worker, version, code_version()))


def _supervised(blob: bytes, time_limit: float | None, version: str, session: str) -> Any:
    """Compute a pickled call in a separate process; called in a thread of a Dask worker."""
    if version != code_version():
        raise WorkerDied(_mismatch("this worker", code_version(), version))
    from distributed import get_worker

    with _making:
        if session in _ended:
            raise WorkerDied("the command that requested this run has ended")
        if session not in _sessions:
            _sessions[session] = LocalExecutor(min(int(get_worker().state.nthreads), _MOST_PROCESSES))
        crew = _sessions[session]
    return crew.submit_pickled(blob, time_limit).result()


# On a Dask worker: the processes of each command (session), one for each thread of the worker.
_sessions: dict[str, LocalExecutor] = {}
_ended: set[str] = set()


def _end_session(session: str) -> None:
    """End the processes of a command (session) on this Dask worker, in a background thread."""
    with _making:
        _ended.add(session)
        crew = _sessions.pop(session, None)
    if crew is not None:
        threading.Thread(target=crew.stop, name="end of session", daemon=True).start()


def _mismatch(worker: str, version: str, wanted: str) -> str:
    advice = "install the same version of stemcal on both machines"
    return f"{worker} uses stemcal {version}, but the study uses {wanted}; {advice}"


def _at_most(seconds: float, function: Callable[[], object]) -> None:
    """Call a function in a thread and wait at most `seconds` for its end, since the cluster may not respond."""

    def try_it() -> None:
        with suppress(Exception):
            function()

    thread = threading.Thread(target=try_it, name="disconnect", daemon=True)
    thread.start()
    thread.join(seconds)


def _connected(address: str) -> Any:
    try:
        import dask
        from distributed import Client
    except ImportError:
        message = '--executor dask:// requires Dask; run `pip install ".[dask]"` in the repository folder'
        raise UsageError(message) from None
    for name in [*_LOUD, *logging.root.manager.loggerDict]:  # silence Dask, whose errors stemcal itself reports
        if name.partition(".")[0] in _LOUD:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    warnings.filterwarnings("ignore", module="distributed")
    # the connection is encrypted if Dask's configuration requires it or contains a certificate
    encrypted = dask.config.get("distributed.comm.require-encryption", False)
    scheme = "tls" if encrypted or dask.config.get("distributed.comm.tls.client.cert", None) else "tcp"
    url, clients = f"{scheme}://{address}", list[Any]()
    # the client of Dask waits for minutes if the port does not respond or uses another protocol
    _at_most(CONNECT_S, lambda: clients.append(Client(url, timeout=CONNECT_S, set_as_default=False)))
    if not clients:
        raise UsageError(
            f"--executor dask://{address}: no Dask scheduler responds at this address; start a scheduler with "
            "`dask scheduler` (default port 8786)"
        )
    return clients[0]
