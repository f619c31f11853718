"""Workers compute, die, are replaced and leave no orphans."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, wait
from pathlib import Path

import pytest
from fakes import ENVIRONMENT

from stemcal.processes.limits import RunTimedOut
from stemcal.runs.executors import InlineExecutor, WorkerDied, available_cores
from stemcal.runs.executors.local import LocalExecutor

POSIX = pytest.mark.skipif(os.name == "nt", reason="POSIX signals")


def square(x: float) -> float:
    return x * x


def whoami(seconds: float = 0.0) -> int:
    time.sleep(seconds)
    return os.getpid()


def die(how: str, mark: Path | None = None) -> str:
    """End this process; with a mark, only the first time."""
    if mark is not None and mark.exists():
        return "alive"
    if mark is not None:
        mark.touch()
    if how == "exit":
        os._exit(3)
    if how == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    import ctypes

    return str(ctypes.string_at(0))


def compute_with_gil(seconds: int) -> int:
    """Hold the interpreter's lock as a compiled kernel may: no other thread of the process runs meanwhile."""
    import ctypes

    return int(ctypes.PyDLL(None).sleep(seconds))


class Stubborn(Exception):
    """Pickles, but does not come back."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(first)


def fail(kind: str) -> None:
    if kind == "stubborn":
        raise Stubborn("first", "second")
    if kind == "exit":
        sys.exit(7)
    raise KeyError("which")


def unpicklable() -> object:
    return threading.Lock()


def chatter() -> None:
    print("noise")


def environment(name: str) -> str | None:
    return os.environ.get(name)


@pytest.fixture(scope="module")
def executor() -> LocalExecutor:
    with LocalExecutor(2) as executor:
        yield executor


def test_computes(executor: LocalExecutor) -> None:
    assert list(executor.map(square, range(20))) == [x * x for x in range(20)]


def test_two_workers_work_at_the_same_time(executor: LocalExecutor) -> None:
    futures = [executor.submit(whoami, 0.3) for _ in range(4)]
    assert len({future.result() for future in futures} - {os.getpid()}) == 2


def test_one_thread_each(executor: LocalExecutor) -> None:
    assert executor.submit(environment, "OMP_NUM_THREADS").result() == "1"
    assert executor.submit(environment, "NUMBA_NUM_THREADS").result() == "1"


@pytest.mark.parametrize(
    ("kind", "error", "text"),
    [("key", KeyError, "which"), ("stubborn", RuntimeError, "Stubborn: first"), ("exit", RuntimeError, "7")],
)
def test_exceptions_come_back(executor: LocalExecutor, kind: str, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        executor.submit(fail, kind).result()


def test_results_that_cannot_travel(executor: LocalExecutor) -> None:
    with pytest.raises(TypeError, match="pickle"):
        executor.submit(unpicklable).result()


def test_stdout_stays_clean(executor: LocalExecutor, capfd: pytest.CaptureFixture[str]) -> None:
    executor.submit(chatter).result()
    assert "noise" not in capfd.readouterr().out


@pytest.mark.parametrize("how", ["exit", pytest.param("kill", marks=POSIX), "segfault"])
def test_a_dying_worker_costs_only_its_run(executor: LocalExecutor, how: str) -> None:
    deadly = executor.submit(die, how)
    others = [executor.submit(square, x) for x in range(10)]
    assert [future.result() for future in others] == [x * x for x in range(10)]
    ending = {"exit": "exit code 3", "kill": "SIGKILL", "segfault": "SIGSEGV" if os.name != "nt" else "code"}
    with pytest.raises(WorkerDied, match=f"process terminated unexpectedly: .*{ending[how]}"):
        deadly.result()


# ---- time limit


def hang(mark: Path, way: str) -> None:
    """Hang for a minute: asleep, deaf to SIGTERM with the lock held, or waiting for a deaf grandchild of a shell."""
    if way == "family":
        script = "trap '' TERM; sleep 60 & echo $! > \"$0.grandchild\"; sleep 60"
        child = subprocess.Popen(["sh", "-c", script, str(mark)], start_new_session=True)
        mark.write_text(str(child.pid), encoding="utf-8")
        child.wait()
    elif way == "deaf":
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        compute_with_gil(60)
    time.sleep(60.0)


@pytest.mark.parametrize("way", [pytest.param("deaf", marks=POSIX), pytest.param("family", marks=POSIX)])
def test_a_hung_run_is_ended_with_its_family(way: str, tmp_path: Path) -> None:
    mark = tmp_path / "child"
    with LocalExecutor(1, time_limit=1.0) as executor:
        executor.submit(square, 1).result()  # the worker has started
        begun = time.monotonic()
        hung, after = executor.submit(hang, mark, way), executor.submit(square, 3)
        with pytest.raises(RunTimedOut, match=r"time limit of 1 s") as caught:
            hung.result()
        assert 0.9 < time.monotonic() - begun < 5.0
        assert caught.value.limit == 1.0
        assert after.result() == 9
    for path in (mark, tmp_path / "child.grandchild") if way == "family" else ():
        assert eventually(lambda pid=int(path.read_text(encoding="utf-8")): not alive(pid), 5.0)


def test_the_clock_of_a_run_starts_with_the_run() -> None:
    """Six runs of 0.4 s one after the other, each allowed 1 s: waiting in the queue is not counted."""
    with LocalExecutor(1, time_limit=1.0) as executor:
        assert len({future.result() for future in [executor.submit(whoami, 0.4) for _ in range(6)]}) == 1


class Prepared:
    """A run that needs something loaded into its process first."""

    def __init__(self, loading: float, computing: float) -> None:
        self.loading, self.computing = loading, computing

    def get_ready(self) -> None:
        if self.loading < 0.0:
            os._exit(3)
        time.sleep(self.loading)

    def __call__(self) -> str:
        time.sleep(self.computing)
        return "done"


def test_what_a_run_needs_loaded_does_not_count() -> None:
    """A cold cache on a cluster's worker: compiling takes minutes, the limit is one of the simulation."""
    with LocalExecutor(1, time_limit=1.0) as executor:
        assert executor.submit(Prepared(1.5, 0.1)).result() == "done"
        with pytest.raises(RunTimedOut, match="1 s"):
            executor.submit(Prepared(0.1, 9.0)).result()
        with pytest.raises(WorkerDied, match="exit code 3"):
            executor.submit(Prepared(-1.0, 0.1)).result()


def test_a_worker_that_is_never_ready_is_no_time_out_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.processes.child.LOADING_S", 0.5)
    with LocalExecutor(1, time_limit=60.0) as executor, pytest.raises(WorkerDied, match=r"not ready within 0\.5 s"):
        executor.submit(Prepared(30.0, 0.1)).result()


def started(folder: Path, text: str) -> subprocess.Popen[str]:
    """Start a script that imports this module."""
    script, pipe = folder / "script.py", subprocess.PIPE
    script.write_text(text, encoding="utf-8")
    line = [sys.executable, str(script), str(Path(__file__).parent)]
    return subprocess.Popen(line, stdout=pipe, stderr=pipe, text=True, env=ENVIRONMENT, start_new_session=True)


STOPPED = """
import sys, time
sys.path.insert(0, sys.argv[1])
from test_local import whoami
from stemcal.runs.executors.local import LocalExecutor
if __name__ == "__main__":
    with LocalExecutor(1, time_limit=2.0) as executor:
        executor.submit(whoami).result()
        busy = executor.submit(whoami, 1.0)
        print("busy", flush=True)
        print("done" if busy.result() else "", flush=True)
"""


@POSIX
def test_time_while_the_whole_command_is_stopped_does_not_count(tmp_path: Path) -> None:
    """Ctrl-Z stops the command and its workers; `fg` lets them go on."""
    study = started(tmp_path, STOPPED)
    assert study.stdout is not None and study.stdout.readline() == "busy\n"
    time.sleep(0.3)
    os.killpg(study.pid, signal.SIGSTOP)
    time.sleep(2.5)
    os.killpg(study.pid, signal.SIGCONT)
    out, errors = study.communicate(timeout=20)
    assert (study.returncode, out) == (0, "done\n"), errors


def test_an_exception_in_the_block_stops_the_workers() -> None:
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt), LocalExecutor(1) as executor:
        running = executor.submit(whoami, 60.0)
        queued = executor.submit(square, 2)
        while not running.running():
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert time.monotonic() - begun < 10.0
    with pytest.raises(CancelledError):
        queued.result(timeout=0)
    with pytest.raises(WorkerDied, match="stopped"):
        running.result(timeout=0)


def test_shutdown_finishes_the_queue() -> None:
    executor = LocalExecutor(1)
    futures = [executor.submit(square, x) for x in range(5)]
    executor.shutdown()
    assert [future.result(timeout=0) for future in futures] == [0, 1, 4, 9, 16]
    with pytest.raises(RuntimeError, match="shutdown"):
        executor.submit(square, 1)


def test_idle_executors_start_nothing() -> None:
    with LocalExecutor(4) as executor:
        assert not executor._children


def test_cores() -> None:
    assert LocalExecutor().workers == available_cores() >= 1


def test_inline() -> None:
    with InlineExecutor() as executor:
        assert executor.submit(square, 3).result() == 9
        with pytest.raises(KeyError):
            executor.submit(fail, "key").result()


# ---- the parent dies

PARENT = """
import sys, time
sys.path.insert(0, sys.argv[1])
from test_local import whoami
from stemcal.runs.executors.local import LocalExecutor
if __name__ == "__main__":
    with LocalExecutor(2) as executor:
        print(*[f.result() for f in [executor.submit(whoami, 0.5) for _ in range(2)]], flush=True)
        busy = executor.submit(whoami, 60.0)
        while not busy.running():
            time.sleep(0.01)
        time.sleep(0.3)
        print("busy", flush=True)
        busy.result()
"""


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return not Path("/proc").exists()


def eventually(condition: Callable[[], bool], seconds: float = 10.0) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@POSIX
@pytest.mark.parametrize(
    "name", ["SIGKILL", *(pytest.param(name, marks=pytest.mark.slow) for name in ("SIGTERM", "SIGINT"))]
)
def test_no_orphans(name: str, tmp_path: Path) -> None:
    parent = started(tmp_path, PARENT)
    assert parent.stdout is not None and parent.stderr is not None
    workers = [int(pid) for pid in parent.stdout.readline().split()]
    assert parent.stdout.readline() == "busy\n"
    assert all(alive(pid) for pid in workers)
    parent.send_signal(signal.Signals[name])
    parent.wait(timeout=10)
    parent.stdout.close()
    parent.stderr.close()
    assert eventually(lambda: not any(alive(pid) for pid in workers))


def test_cancelled_calls_are_not_run(executor: LocalExecutor) -> None:
    blocking = [executor.submit(whoami, 0.5) for _ in range(2)]
    cancelled = executor.submit(square, 2)
    assert cancelled.cancel()
    wait(blocking)
    assert executor.submit(square, 3).result() == 9


@pytest.mark.parametrize("cores", [1, 3])
def test_cores_are_those_that_this_process_may_use(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: set(range(cores)), raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    assert available_cores() == cores
    monkeypatch.delattr(os, "sched_getaffinity")
    assert available_cores() == 64
