"""A child computes calls and ends with its parent's wish; it and a program are ended with all they have started."""

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

import stemcal as package
from stemcal.processes.child import Child, ChildDied
from stemcal.processes.limits import RunTimedOut
from stemcal.processes.program import ProgramRun, end_family, run_program

posix = pytest.mark.skipif(os.name == "nt", reason="POSIX signals and sessions")
TREE = """
import subprocess, sys, time
depth = int(sys.argv[1])
if depth:
    subprocess.Popen([sys.executable, __file__, str(depth - 1), sys.argv[2]], start_new_session=depth == 1)
open(sys.argv[2] + str(depth), "w").close()
time.sleep(60)
"""


def blob_of(function: Any, *args: Any) -> bytes:
    return pickle.dumps((function, args, {}))


@pytest.fixture
def child() -> Iterator[Child]:
    child = Child()
    yield child
    child.kill()


def test_it_computes_one_call_after_the_other_in_a_process_of_its_own(child: Child) -> None:
    assert child.call(blob_of(divmod, 7, 2)) == ((3, 1), None)
    assert child.call(blob_of(os.getpid)) == (child.pid, None) and child.pid != os.getpid()
    result, error = child.call(blob_of(divmod, 1, 0))
    assert result is None and isinstance(error, ZeroDivisionError)


def test_it_finds_modules_where_this_process_does_and_not_this_script(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere.py").write_text("import sys\ndef main(): return sys.modules['__main__'].__dict__.get('X')\n")
    script = tmp_path / "script.py"
    script.write_text(
        "X = 1; import pickle, sys; sys.path.append(sys.argv[1]); import elsewhere\n"
        "from stemcal.processes.child import Child; child = Child()\n"
        "print(child.call(pickle.dumps((elsewhere.main, (), {})))); child.dismiss()\n"
    )
    monkeypatch.chdir(tmp_path)
    (tmp_path / "platform.py").write_text("raise SystemExit(3)\n")  # nor what lies in the current folder
    path = str(Path(package.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": path}
    line = [sys.executable, "-P", str(script), str(tmp_path)]
    done = subprocess.run(line, capture_output=True, text=True, env=environment, check=False)
    assert done.stdout == "(None, None)\n", done.stderr


def leave_word(path: Path) -> None:
    import atexit

    atexit.register(path.write_text, "ended")


def test_dismissed_it_ends_normally(child: Child, tmp_path: Path) -> None:
    child.call(blob_of(leave_word, tmp_path / "word"))
    child.dismiss()
    assert not psutil.pid_exists(child.pid) and (tmp_path / "word").read_text() == "ended"


def test_one_that_is_late_or_gone_is_told(child: Child) -> None:
    child.call(blob_of(int))
    begun = time.monotonic()
    with pytest.raises(RunTimedOut):
        child.call(blob_of(time.sleep, 60.0), 0.3)
    child.kill()
    for _ in range(2):
        with pytest.raises(ChildDied, match="SIGKILL" if os.name != "nt" else "code"):
            child.call(blob_of(int))
    assert time.monotonic() - begun < 20.0


def test_a_process_is_ended_with_its_descendants_in_any_session_and_nobody_else(tmp_path: Path) -> None:
    script, mark = tmp_path / "tree.py", tmp_path / "up"
    script.write_text(TREE, encoding="utf-8")
    root = subprocess.Popen([sys.executable, str(script), "2", str(mark)], start_new_session=True)
    bystander = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    try:
        end = time.monotonic() + 20.0
        while not all(Path(f"{mark}{depth}").exists() for depth in range(3)) and time.monotonic() < end:
            time.sleep(0.05)
        family = psutil.Process(root.pid).children(recursive=True)
        assert len(family) == 2
        end_family(root.pid)
        root.wait(timeout=5.0)
        assert psutil.wait_procs(family, timeout=10.0)[1] == []
        assert bystander.poll() is None
    finally:
        bystander.kill()
        bystander.wait()


def test_what_is_gone_is_no_error() -> None:
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    end_family(gone.pid)
    assert gone.returncode == 0 and not psutil.pid_exists(gone.pid)


def left_running(word: str) -> int:
    """Start a program in a group of its own, as runs do, and die over it; return only if that fails."""
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], process_group=0)
    Path(word).write_text(str(process.pid))
    os.kill(os.getpid(), signal.SIGKILL)
    return process.pid


@posix
def test_what_a_killed_child_had_started_is_ended_with_it(child: Child, tmp_path: Path) -> None:
    with pytest.raises(ChildDied):
        child.call(blob_of(left_running, str(tmp_path / "pid")))
    child.kill()
    assert ended(int((tmp_path / "pid").read_text()))


def leaving_behind(word: str) -> None:
    """Start a process in a session of its own that ignores to be asked, as a class may do in `solve`."""
    code = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(60)"
    process = subprocess.Popen([sys.executable, "-c", code], start_new_session=True)
    Path(word).write_text(str(process.pid))


def computing_without_end(word: str) -> None:
    """Stay in native code that keeps Python's lock, so that no thread of the process runs."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    leaving_behind(word)
    sum(range(10**13))


def wait_for(condition: Callable[[], bool], seconds: float = 20.0) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@posix
def test_what_a_call_has_started_is_ended_at_a_normal_end(child: Child, tmp_path: Path) -> None:
    child.call(blob_of(leaving_behind, str(tmp_path / "pid")))
    child.dismiss()
    assert ended(int((tmp_path / "pid").read_text())) and ended(child.pid)


@posix
@pytest.mark.parametrize("call", ["computing_without_end", "leaving_behind"])
def test_nothing_is_left_of_a_caller_that_is_killed(tmp_path: Path, call: str) -> None:
    """The worker in native code, and a process in another session that it has started."""
    word = tmp_path / "pid"
    script = (
        "import pickle, sys, time; sys.path.insert(0, sys.argv[1]); import test_processes as tests\n"
        "child = tests.Child(); print(child.pid, flush=True)\n"
        f"child.call(pickle.dumps((tests.{call}, (sys.argv[2],), {{}})))\n"
        "open(sys.argv[2] + '.done', 'w').close(); time.sleep(60)"
    )
    line = [sys.executable, "-c", script, str(Path(__file__).parent), str(word)]
    caller = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
    assert caller.stdout is not None
    worker = int(caller.stdout.readline())
    assert wait_for(lambda: word.exists() and word.read_text().isdigit())
    if call == "leaving_behind":
        assert wait_for(Path(f"{word}.done").exists)
    caller.kill()
    caller.wait()
    assert wait_for(lambda: ended(worker) and ended(int(word.read_text())))


# ---- programs


def run(folder: Path, program: str, limit: float = 0.5) -> ProgramRun:
    return run_program([sys.executable, "-c", program], folder, {}, limit)


def ended(pid: int) -> bool:
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


@posix
def test_program_that_stops_itself_is_ended_at_its_limit(tmp_path: Path) -> None:
    found = run(tmp_path, "import os, signal\nos.kill(os.getpid(), signal.SIGSTOP)")
    assert found.timed_out
    assert found.code < 0


@posix
def test_what_leaves_the_group_is_ended_too(tmp_path: Path) -> None:
    program = (
        "import subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'], start_new_session=True)\n"
        "print(child.pid, flush=True)\n"
        "time.sleep(600)"
    )
    found = run(tmp_path, program, limit=3.0)
    assert found.timed_out
    assert ended(int(found.output))
