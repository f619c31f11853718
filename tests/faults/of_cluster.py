"""What may happen on a Dask cluster: its scheduler is lost, the command is interrupted, other code runs there."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

from fakes import ENVIRONMENT
from of_processes import SLOW_SPEC, heeding, posix
from tally import Fault, Missing, each

EXECUTORS = Path(__file__).parents[1] / "executors"


def _cluster(folder: Path, workers: int = 1) -> object:
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise Missing("needs Dask") from None
    sys.path[:0] = [str(EXECUTORS)] if str(EXECUTORS) not in sys.path else []
    from test_cluster import Cluster

    folder.mkdir(parents=True, exist_ok=True)
    return Cluster(folder, workers)


def _screening(folder: Path, address: str) -> subprocess.Popen[str]:
    """Begin a screening of twelve runs of a program that takes 0.3 s, and tells its process."""
    text = SLOW_SPEC.format(python=json.dumps(sys.executable))
    assert "time.sleep(0.3)" in text
    told = "open(r'{}', 'a').write(str(os.getpid()) + chr(10))".format(folder / "pids")
    text = text.replace("time.sleep(0.3)", f"import os; {told}; time.sleep(1.0)")
    (folder / "slow.yaml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "stemcal", "screen", str(folder / "slow.yaml"), "--out", str(folder / "out")]
    return subprocess.Popen(
        [*command, "--executor", f"dask://{address}", "--quiet"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        start_new_session=True,
        preexec_fn=heeding,
    )


def _lines(said: str) -> list[str]:
    """Return what was said, but that there were no workers yet when the command began."""
    return [line for line in said.strip().splitlines() if "has no workers yet" not in line]


def _pids(folder: Path) -> list[int]:
    place = folder / "pids"
    return list(map(int, place.read_text("utf-8").split())) if place.exists() else []


def _wait_for_runs(folder: Path, child: subprocess.Popen[str], count: int) -> None:
    end = time.monotonic() + 60.0
    while len(_pids(folder)) < count and child.poll() is None and time.monotonic() < end:
        time.sleep(0.02)
    assert len(_pids(folder)) >= count, child.communicate(timeout=5) if child.poll() is not None else "no run began"


def lost_scheduler(folder: Path, _number: int, rng: random.Random) -> None:
    """The command says so in our words and nothing else, and keeps what is finished."""
    posix()
    cluster = _cluster(folder)
    try:
        child = _screening(folder, cluster.address)  # type: ignore[attr-defined]
        _wait_for_runs(folder, child, rng.randint(1, 4))
        time.sleep(rng.uniform(0.0, 1.0))
        sys.modules["test_cluster"].kill_group(cluster.scheduler)  # type: ignore[attr-defined]
        _, said = child.communicate(timeout=90)
        assert child.returncode == 1, f"exit {child.returncode}: {said[-500:]}"
        assert len(_lines(said)) == 1 and _lines(said)[0].startswith("error: the Dask scheduler at "), said[-800:]
    finally:
        cluster.close()  # type: ignore[attr-defined]


def interrupted(folder: Path, number: int, rng: random.Random) -> None:
    """Ctrl-C or SIGTERM: exit 130 or 143, and soon no run of the command is left on the workers."""
    posix()
    cluster, number_of = _cluster(folder), (signal.SIGINT, signal.SIGTERM)[number % 2]
    try:
        child = _screening(folder, cluster.address)  # type: ignore[attr-defined]
        _wait_for_runs(folder, child, rng.randint(1, 3))
        time.sleep(rng.uniform(0.0, 1.0))
        child.send_signal(number_of)
        _, said = child.communicate(timeout=60)
        assert child.returncode == 128 + number_of, f"exit {child.returncode}: {said[-500:]}"
        assert len(_lines(said)) == 1, said[-800:]
        time.sleep(1.5)
        known = len(_pids(folder))
        time.sleep(2.0)
        assert len(_pids(folder)) == known, "runs go on beginning"
        assert not [pid for pid in _pids(folder) if Path(f"/proc/{pid}").exists()], "a run goes on"
    finally:
        cluster.close()  # type: ignore[attr-defined]


FAULTS = (
    Fault(
        "the scheduler is lost",
        "the Dask scheduler killed at a random moment of a screening",
        "one line, ours, exit 1; finished runs are kept",
        each(lost_scheduler),
        1,
        10,
    ),
    Fault(
        "a command on a cluster is interrupted",
        "Ctrl-C or SIGTERM at a random moment of a screening on a Dask worker",
        "exit 130 or 143, one line; within seconds none of its runs is left on the worker",
        each(interrupted),
        1,
        10,
    ),
)
