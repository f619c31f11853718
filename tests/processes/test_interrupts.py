"""Ctrl-C and SIGTERM are heard wherever they come, and only by commands."""

import importlib
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import typer
from fakes import ENVIRONMENT

import stemcal
from stemcal.cli.exit_codes import exit_codes
from stemcal.processes.interrupts import Terminated, put_off, raise_noted, raising_interrupts
from stemcal.processes.limits import next_of, wait_until

BOTH = pytest.mark.parametrize(("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)])


class Losing:
    """Something that is interrupted at its end, where no exception can pass."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)


@BOTH
def test_a_signal_is_raised_at_once_and_the_handler_of_before_is_back_afterwards(
    number: signal.Signals, kind: type[KeyboardInterrupt]
) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt) as caught, raising_interrupts():
        signal.raise_signal(number)
        pytest.fail("not raised")
    assert caught.type is kind and signal.getsignal(number) is before
    raise_noted()  # it is over


@BOTH
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_lost_one_is_raised_by_the_next_wait(number: signal.Signals, kind: type[KeyboardInterrupt]) -> None:
    going_on = False
    with pytest.raises(kind), raising_interrupts():
        Losing(number)
        going_on = True
        next_of(queue.SimpleQueue())
    assert going_on


@pytest.mark.parametrize("falls_back", [False, True])
def test_while_a_module_loads_one_is_only_noted(
    falls_back: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would be lost in the import system, or taken for the sign that something is missing."""
    text = "import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\nexcept BaseException:\n    broken = True\n"
    (tmp_path / "interrupted_module.py").write_text(text if falls_back else RAISING)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "interrupted_module", raising=False)
    with raising_interrupts():
        module = importlib.import_module("interrupted_module")
        with pytest.raises(KeyboardInterrupt):
            raise_noted()
    assert not hasattr(module, "broken")


RAISING = "import signal\nsignal.raise_signal(signal.SIGINT)\n"


def test_put_off_to_the_end_of_a_block() -> None:
    gone_on: list[int] = []
    with pytest.raises(Terminated), raising_interrupts():
        with put_off(), put_off():
            signal.raise_signal(signal.SIGTERM)
            gone_on.append(1)
        gone_on.append(2)
    assert gone_on == [1]


def test_the_second_of_a_user_is_raised_too() -> None:
    with pytest.raises(KeyboardInterrupt), raising_interrupts():
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            signal.raise_signal(signal.SIGINT)
            pytest.fail("not raised")


def test_one_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with raising_interrupts():
            signal.raise_signal(signal.SIGINT)
            raise_noted()
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_set_no_handlers_and_are_not_interrupted() -> None:
    before, found = signal.getsignal(signal.SIGINT), []

    def work() -> None:
        with raising_interrupts(), put_off():
            found.append(signal.getsignal(signal.SIGINT))
            signal.raise_signal(signal.SIGINT)
            wait_until(0.3, lambda seconds: bool(time.sleep(seconds)))
            found.append("done")

    with pytest.raises(KeyboardInterrupt), raising_interrupts():
        inside = signal.getsignal(signal.SIGINT)
        thread = threading.Thread(target=work)
        thread.start()
        wait_until(None, lambda seconds: bool(time.sleep(seconds)))
    thread.join()
    assert found == [inside, "done"] and signal.getsignal(signal.SIGINT) is before


def test_waiting_counts_each_slice_once_however_long_it_took() -> None:
    """As where the process is stopped for a while: of 1 s only the slices are counted, not the 0.6 s of sleep each."""
    slept: list[float] = []

    def oversleeping(seconds: float) -> bool:
        slept.append(seconds)
        time.sleep(0.6 if seconds else 0.0)
        return len(slept) == 3

    assert wait_until(1.0, oversleeping) and slept == [0.25] * 3
    assert not wait_until(0.6, lambda seconds: slept.append(seconds) or False)  # type: ignore[func-returns-value]
    assert slept[3:] == pytest.approx([0.25, 0.25, 0.1, 0.0])


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_error_that_a_library_has_made_of_one_is_none_of_the_program(
    number: signal.Signals, code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """As class creation does, and pydantic."""
    with pytest.raises(typer.Exit) as left, exit_codes():
        try:
            signal.raise_signal(number)
        except KeyboardInterrupt as interrupt:
            raise RuntimeError("something went wrong here") from interrupt
    assert left.value.exit_code == code and "internal" not in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="exit codes of signals")
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_the_command_is_interrupted_while_it_loads_and_ends_normally(tmp_path: Path, name: str, code: int) -> None:
    """What is registered to be done at exit is done."""
    (tmp_path / "interrupted.py").write_text(f"import signal\nsignal.raise_signal(signal.{name})\n", encoding="utf-8")
    script = (
        "import atexit, sys; atexit.register(print, 'at exit')\n"
        f"sys.path.insert(0, {str(tmp_path)!r}); sys.argv[1:] = ['check', 'no.yaml']\n"
        "from stemcal.cli import app; command = app.main\n"
        "def loading(): import interrupted; command()\n"
        "app.main = loading\n"
        "from stemcal.__main__ import main; main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert (done.returncode, done.stdout) == (code, "at exit\n"), done.stderr
    assert "Traceback" not in done.stderr


def test_calling_the_python_face_starts_no_thread_and_sets_no_handler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def state() -> tuple[object, ...]:
        return signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM), threading.active_count()

    before, started, start = state(), [], threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", lambda thread: (started.append(thread.name), start(thread)))
    study = stemcal.load_study(Path(__file__).parents[2] / "configs" / "paper-replay.yaml")
    results = stemcal.calibrate(study, out=tmp_path / "out", workers=1, progress=False)
    assert results.figure("contour") and results.verdict and stemcal.open_results(tmp_path / "out")
    assert (state(), started) == (before, [])


@pytest.mark.skipif(os.name == "nt", reason="shells differ")
def test_these_tests_end_where_interrupts_are_ignored() -> None:
    """As in a job that a shell has put in the background."""
    line = f"trap '' INT; exec '{sys.executable}' -m pytest -q -p no:cacheprovider '{__file__}' -k lost_one"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0 and "2 passed" in done.stdout, done.stdout
