"""Ctrl-C and SIGTERM are heard wherever they come."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from fakes import ENVIRONMENT

from stemcal.interrupts import Hearing, Terminated


class Losing:
    """Something that is interrupted at its end, where no exception can pass."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def __del__(self) -> None:
        signal.raise_signal(self.number)


class Complaining:
    """Something that was left half made."""

    def __del__(self) -> None:
        raise AttributeError("half made")


def lose(number: signal.Signals) -> None:
    Losing(number)
    for _ in range(500):
        time.sleep(0.01)


@pytest.fixture
def hearing() -> Iterator[Hearing]:
    def terminate(*_: object) -> None:
        raise Terminated

    report, handler = sys.unraisablehook, signal.signal(signal.SIGTERM, terminate)
    sys.unraisablehook = found = Hearing(sys.__unraisablehook__)
    yield found
    sys.unraisablehook = report
    signal.signal(signal.SIGTERM, handler)


@pytest.mark.parametrize(("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)])
def test_a_lost_interrupt_is_raised_again_and_nothing_said(
    hearing: Hearing, number: signal.Signals, kind: type[BaseException], capfd: pytest.CaptureFixture[str]
) -> None:
    begun = time.monotonic()
    with pytest.raises(KeyboardInterrupt) as caught:
        lose(number)
    assert caught.type is kind and time.monotonic() - begun < 4.0
    Complaining()
    assert hearing.interrupted and capfd.readouterr().err == ""


def test_whatever_else_is_lost_is_told(hearing: Hearing, capfd: pytest.CaptureFixture[str]) -> None:
    Complaining()
    assert "half made" in capfd.readouterr().err and not hearing.interrupted


def test_one_that_is_no_longer_wanted_stays_lost(hearing: Hearing, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.interrupts._MOMENT", 0.5)
    Losing(signal.SIGINT)
    hearing.rest()
    time.sleep(0.6)
    assert hearing.interrupted


@pytest.mark.skipif(os.name == "nt", reason="exit codes of signals")
def test_the_command_hears_one_that_is_lost_while_it_loads() -> None:
    """As it befalls the import system's callbacks."""
    code = (
        "import signal, sys, types, test_interrupts; app = types.ModuleType('app')\n"
        "app.main = lambda: test_interrupts.lose(signal.SIGINT)\n"
        "sys.modules['stemcal.cli.app'] = app\n"
        "from stemcal.__main__ import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert (done.returncode, done.stderr) == (130, "")
