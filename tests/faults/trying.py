"""How a fault is tried: a few times in every run of the tests, many times among the slow ones."""

import os
import random
import shutil
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
import workflow
from fakes import FakeSolver, make_study
from typer.testing import CliRunner, Result

from stemcal.cli.app import app
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder

CONFIGS = Path(__file__).parents[2] / "configs"
POINTS = "rsm: {centre_points: 3}\n"
POSIX = pytest.mark.skipif(os.name == "nt", reason="needs POSIX signals, links and rights")
Trial = Callable[[Path, int, random.Random], None]


def trials(quick: int, long: int) -> Callable[[Trial], Callable[[Path, int], None]]:
    """Make a test of `trial(folder, number, random)`, tried `quick` times or, as a slow test, `long` times."""
    counts = [*([quick] if quick else []), pytest.param(long, marks=pytest.mark.slow)]

    def test_of(trial: Trial) -> Callable[[Path, int], None]:
        @pytest.mark.parametrize("times", counts)
        def test(tmp_path: Path, times: int) -> None:
            for number in range(times):
                folder = tmp_path / f"trial-{number}"
                folder.mkdir()
                trial(folder, number, random.Random(f"{trial.__name__} {number}"))
                shutil.rmtree(folder, ignore_errors=True)

        test.__doc__ = trial.__doc__
        return test

    return test_of


def command(*arguments: object) -> Result:
    """Give a command of stemcal in this process."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def finished(folder: Path, name: str = "out", witness: Path | None = None) -> StudyFolder:
    """Take the known study through all stages."""
    found = StudyFolder(folder / name)
    workflow.calibrate(make_study(folder, POINTS), found, InlineExecutor(), solver=FakeSolver(witness))
    return found


def results(folder: Path) -> dict[str, bytes]:
    """Return the bytes of all stage files and tables."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".json", ".csv")}


def heeding() -> None:
    """Let a child hear Ctrl-C, also where a shell has begun these trials in the background and ignores it for all."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
