"""Processes that die, are asked to end, or meet each other in one folder."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

from fakes import ENVIRONMENT, FakeSolver, make_study
from tally import Fault, Missing, Tally, each

from stemcal import workflow
from stemcal.errors import FolderLocked
from stemcal.executors.inline import InlineExecutor
from stemcal.executors.local import LocalExecutor
from stemcal.folder.study_folder import StudyFolder

HERE = Path(__file__).parent
POINTS = "rsm: {centre_points: 3}\n"


def posix() -> None:
    if os.name == "nt":
        raise Missing("needs POSIX signals")


def results(folder: Path) -> dict[str, bytes]:
    """Return the bytes of all stage files and tables."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".json", ".csv")}


def heeding() -> None:
    """Let a child hear Ctrl-C, also where a shell has begun these trials in the background and ignores it for all."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def kill_nine(_place: Path, times: int, rng: random.Random) -> Tally:
    """Let `kill_many` do it in a process of its own, which forks."""
    posix()
    command = [sys.executable, str(HERE / "kill_many.py"), str(times), str(rng.randrange(10**6))]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, check=False)
    found = re.search(r"(\d+) kills.* (\d+) runs acknowledged: (\d+) lost, (\d+) done again", done.stdout)
    if found is None:
        return Tally(times, [done.stderr[-400:]])
    kills, runs, lost, again = map(int, found.groups())
    broken = ["lost"] * lost + ["done again"] * again
    return Tally(kills, broken, f"{runs} acknowledged runs: {lost} lost, {again} done again")


# ---- a worker dies

WAYS = ("kill", "exit", "segfault")


def worker_dies(folder: Path, number: int, rng: random.Random) -> None:
    """Once: the run is begun again and nothing shows. Every time: this run alone fails, under its name."""
    if os.name == "nt":
        raise Missing("needs POSIX signals")
    way, row, always = WAYS[number % 3], rng.randrange(12), number % 2 == 1
    study, witness = make_study(folder), folder / "witness"
    accident = None if always else folder / "accident"
    solver = FakeSolver(witness, trouble={row: way}, accident=accident)
    whole = workflow.run_stage(
        "screen", study, StudyFolder(folder / "whole"), InlineExecutor(), solver=FakeSolver()
    ).to_json()
    with LocalExecutor(2) as executor:
        stage = workflow.run_stage("screen", study, StudyFolder(folder / "out"), executor, solver=solver).to_json()
    begun = witness.read_text(encoding="utf-8").split("\n")
    assert begun.count(f"screen {row}") == 2, f"begun {begun.count(f'screen {row}')} times"
    runs, expected = stage["design"]["runs"], whole["design"]["runs"]
    others = [run for run in runs if run["run"] != row + 1]
    assert others == [run for run in expected if run["run"] != row + 1], "another run changed"
    if always:
        assert (runs[row]["status"], runs[row]["reason"], runs[row]["response"]) == ("failed", "worker_died", None)
    else:
        assert runs == expected


# ---- two at once

HOLDER = """
import sys, time
from stemcal.folder.study_folder import StudyFolder
folder = StudyFolder(sys.argv[1])
folder.lock()
print("held", flush=True)
time.sleep(60)
"""


def two_at_once(folder: Path, _number: int, rng: random.Random) -> None:
    """The second is refused and told who has it; when the first is killed, the lock is gone with it."""
    posix()
    command = [sys.executable, "-c", HOLDER, str(folder / "study")]
    holder = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
    assert holder.stdout is not None
    try:
        assert holder.stdout.readline() == "held\n"
        time.sleep(rng.uniform(0.0, 0.02))
        try:
            StudyFolder(folder / "study").lock()
        except FolderLocked as refused:
            assert refused.exit_code == 5 and f"process {holder.pid} on" in str(refused), str(refused)
        else:
            raise AssertionError("two processes had the folder")
    finally:
        holder.kill()
        holder.communicate()
    with StudyFolder(folder / "study") as mine:
        assert mine.holder() is not None


# ---- signals and pipes

SLOW_SPEC = """\
name: slow
factors:
  - {{name: width, unit: mm, low: 10, high: 20}}
  - {{name: depth, unit: mm, low: 10, high: 20}}
solver:
  kind: command
  command: [{python}, "-S", "-c", "import sys, time; time.sleep(0.3); print(sys.argv[1], sys.argv[2])", "{{{{width}}}}", "{{{{depth}}}}"]
  result: {{file: program-output.txt, pattern: '(\\S+) \\S+'}}
targets: [{{diameter: 8 mm, force: 15 N}}]
rsm: {{factors: [width, depth]}}
"""  # noqa: E501
ENDINGS = {"SIGINT": 130, "SIGTERM": 143}


def asked_to_end(folder: Path, number: int, rng: random.Random) -> None:
    """At any moment from its first: the exit code says which signal, no traceback, and the same command goes on."""
    posix()
    spec = folder / "slow.yaml"
    spec.write_text(SLOW_SPEC.format(python=json.dumps(sys.executable)), encoding="utf-8")
    name = sorted(ENDINGS)[number % 2]
    command = [sys.executable, "-m", "stemcal", "screen", str(spec), "--out", str(folder / "out"), "--workers", "1"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    if rng.random() < 0.5:  # else perhaps before Python itself is there
        _until((folder / "out" / "runs").is_dir, child)
    time.sleep(rng.uniform(0.0, 2.0))
    child.send_signal(signal.Signals[name])
    _, errors = child.communicate(timeout=30)
    code = child.returncode if child.returncode >= 0 else 128 - child.returncode  # as a shell tells it
    assert code in (ENDINGS[name], 0), f"exit {code}: {errors[-300:]}"
    assert "Traceback" not in errors, errors[-300:]
    store = StudyFolder(folder / "out")
    kept = {key: store.record_path(key).read_bytes() for key in store.keys() if store.peek(key)}  # noqa: SIM118
    again = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, check=False, timeout=60)
    assert again.returncode == 0, again.stderr[-300:]
    assert all(store.record_path(key).read_bytes() == blob for key, blob in kept.items()), "a run was done again"


def _until(condition: object, child: subprocess.Popen[str], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition() and child.poll() is None and time.monotonic() < end:  # type: ignore[operator]
        time.sleep(0.01)


PRINTING = (("check",), ("screen", "--quiet"), ("screen", "--json"), ("status", "--runs"), ("status", "--json"))


def pipe_closed(folder: Path, number: int, rng: random.Random) -> None:
    """Whoever reads stops after some bytes, or none: that is no error."""
    posix()
    verb, *options = PRINTING[number % len(PRINTING)]
    replay = HERE.parents[1] / "configs" / "paper-replay.yaml"
    command = [sys.executable, "-m", "stemcal", verb, str(replay), "--out", str(folder), *options]
    if verb in ("check", "status"):
        workflow_ready(folder, replay)
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=ENVIRONMENT)
    assert child.stdout is not None and child.stderr is not None
    child.stdout.read(rng.choice([0, 1, 20]))
    child.stdout.close()
    errors = child.stderr.read().decode()
    child.stderr.close()
    assert child.wait(60) == 0, f"{verb}: exit {child.returncode}: {errors[-300:]}"
    assert "Traceback" not in errors and "Broken" not in errors, errors[-300:]


def workflow_ready(folder: Path, spec: Path) -> None:
    """Do the screening of the replayed paper, which takes no time."""
    from stemcal.study.reading import load_study

    workflow.run_stage("screen", load_study(spec), StudyFolder(folder), InlineExecutor())


FAULTS = (
    Fault(
        "kill -9 of the study",
        "killed at random moments, begun again, until it ends; sometimes the whole chain",
        "no acknowledged run lost or done again, tables byte for byte those of an unbroken study",
        kill_nine,
        50,
        1000,
    ),
    Fault(
        "a worker process dies",
        "SIGKILL, exit, segmentation fault in a random run, once or every time",
        "begun again once; then this run alone is failed, with its reason",
        each(worker_dies),
        3,
        30,
    ),
    Fault(
        "two processes on one folder",
        "one holds it, another comes; the first is killed with SIGKILL",
        "the second is refused (exit 5) and told who; no lock is left behind",
        each(two_at_once),
        3,
        100,
    ),
    Fault(
        "Ctrl-C, SIGTERM",
        "sent to `stemcal screen` at a random moment",
        "exit 130 or 143, no traceback, goes on, nothing done twice",
        each(asked_to_end),
        2,
        30,
    ),
    Fault(
        "the reader closes the pipe",
        "after 0, 1 or 20 bytes of five commands' output",
        "exit 0, nothing said",
        each(pipe_closed),
        2,
        25,
    ),
)
