"""Ctrl-C and SIGTERM are heard wherever they come."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
import typer
from fakes import ENVIRONMENT

from stemcal.cli.guard import exit_codes
from stemcal.interrupts import QuietHook, Terminated, heard


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
    time.sleep(6.0)


@pytest.fixture
def quiet() -> Iterator[QuietHook]:
    report = sys.unraisablehook
    sys.unraisablehook = found = QuietHook(sys.__unraisablehook__)
    yield found
    sys.unraisablehook = report


@pytest.mark.parametrize(("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)])
def test_a_lost_interrupt_is_raised_again_and_nothing_said(
    quiet: QuietHook, number: signal.Signals, kind: type[BaseException], capfd: pytest.CaptureFixture[str]
) -> None:
    begun, before = time.monotonic(), signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt) as caught, heard(number) as came:
        lose(number)
    assert caught.type is kind and time.monotonic() - begun < 4.0
    assert came == [number, number] and signal.getsignal(number) is before
    Complaining()
    assert quiet.interrupted and capfd.readouterr().err == ""


def test_whatever_else_is_lost_is_told(quiet: QuietHook, capfd: pytest.CaptureFixture[str]) -> None:
    Complaining()
    assert "half made" in capfd.readouterr().err and not quiet.interrupted


def generating() -> Iterator[int]:
    try:
        yield 1
        time.sleep(5.0)
    finally:
        time.sleep(0.2)


def test_who_deals_with_one_is_not_disturbed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not in ``finally`` nor in the end of a ``with``, of a generator that is closed, or in ``except``."""
    monkeypatch.setattr("stemcal.interrupts._PATIENCE", 0.03)
    monkeypatch.setattr("stemcal.interrupts._LOOK", 0.01)
    done: list[str] = []
    with heard(signal.SIGINT) as came:
        try:
            with closing(generating()) as numbers:
                for _ in numbers:
                    try:
                        signal.raise_signal(signal.SIGINT)
                    finally:
                        time.sleep(0.2)
                        done.append("finally")
        except KeyboardInterrupt:
            time.sleep(0.2)
            done.append("except")
    assert done == ["finally", "except"] and came == [signal.SIGINT]
    time.sleep(0.1)


def test_the_second_of_a_user_disturbs() -> None:
    with pytest.raises(KeyboardInterrupt), heard(signal.SIGINT) as came:
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            signal.raise_signal(signal.SIGINT)
            pytest.fail("not heard")
    assert came == [signal.SIGINT] * 2


def test_one_that_an_import_takes_for_something_else_is_raised_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "falls_back.py").write_text(
        "import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\nexcept:\n    pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(KeyboardInterrupt), heard(signal.SIGINT):
        importlib.import_module("falls_back")
        time.sleep(5.0)
    sys.modules.pop("falls_back")


def test_one_that_is_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with heard(signal.SIGINT) as came:
            signal.raise_signal(signal.SIGINT)
        assert came == []
    finally:
        signal.signal(signal.SIGINT, before)


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
