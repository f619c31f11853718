"""The executor for one machine: a fixed number of worker processes, which are replaced if they die.

`ProcessPoolExecutor` gives up all pending runs if one worker dies. Here, each worker is controlled by a thread. If the
worker dies, only its current run fails, with `WorkerDied`, and the next run starts a new process. If a run exceeds its
time limit, it is terminated with all its child processes and fails with `RunTimedOut`.
"""

import pickle
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar

from stemcal.processes.child import Child, ChildDied
from stemcal.processes.limits import RunTimedOut
from stemcal.runs.executors import RunExecutor, WorkerDied, available_cores

P = ParamSpec("P")
T = TypeVar("T")

# Each run uses one thread, since the runs share the cores.
_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


class LocalExecutor(RunExecutor):
    """Computes calls in `workers` processes (by default one per core), each call within `time_limit` (s).

    Processes are started when they are needed; the time limit starts when a worker begins a call. If a ``with`` block
    is left by an exception (Ctrl-C), the workers are terminated at once and the pending calls are cancelled.
    """

    def __init__(self, workers: int | None = None, time_limit: float | None = None) -> None:
        self._workers = max(1, workers if workers is not None else available_cores())
        self.time_limit = time_limit
        self._threads = ThreadPoolExecutor(self._workers, "worker")
        self._own = threading.local()  # its attribute `child` is the worker process of each thread
        self._children: set[Child] = set()
        self._stopping = threading.Event()

    @property
    def workers(self) -> int:
        return self._workers

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Queue a call; function, arguments and result must be picklable."""
        return self.submit_pickled(pickle.dumps((fn, args, kwargs)), self.time_limit)

    def submit_pickled(self, blob: bytes, time_limit: float | None) -> Future[Any]:
        """Queue a pickled (function, args, kwargs) with a time limit in s."""
        return self._threads.submit(self._computed, blob, time_limit)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Accept no more calls, finish or cancel the queued ones, then end the workers."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        if wait and self._children:
            with ThreadPoolExecutor(len(self._children)) as dismissing:
                dismissing.map(Child.dismiss, self._children)
            self._children.clear()

    def stop(self) -> None:
        """Terminate the workers at once, even during a run, and cancel the queued calls."""
        self._stopping.set()
        self._threads.shutdown(wait=False, cancel_futures=True)
        for child in list(self._children):
            child.kill()
        self.shutdown()

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.shutdown()
        else:
            self.stop()

    def _computed(self, blob: bytes, limit: float | None) -> Any:
        """Compute a call in the worker of this thread; a worker that dies or exceeds the time limit is discarded."""
        try:
            if getattr(self._own, "child", None) is None:
                self._own.child = Child(_ONE_THREAD)
                self._children.add(self._own.child)
            if self._stopping.is_set():  # `stop` may have been called while the worker started
                raise ChildDied("stopped")
            result, error = self._own.child.call(blob, limit)
        except (ChildDied, RunTimedOut) as problem:
            self._own.child.kill()
            self._children.discard(self._own.child)
            self._own.child = None
            if self._stopping.is_set():
                raise WorkerDied("the run was stopped before it finished") from None
            if isinstance(problem, RunTimedOut):
                raise
            raise WorkerDied(f"the worker process terminated unexpectedly: {problem}") from None
        if error is not None:
            raise error
        return result
