"""kill -9 of a study many times over: PYTHONPATH=tests python tests/faults/kill_many.py [KILLS] [SEED]

A process that has everything imported forks the study, kills it at a random moment and forks it again, so that a
kill costs some tenths of a second. Mostly it is a screening, sometimes the whole chain. Now and then one gets
through; then its files must be those of an unbroken one, byte for byte, and a random part of its records is taken
away to give the next kills work.

Prints how many kills hit, at how many acknowledged runs, and what was lost or done again: 0 and 0. POSIX only.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import scipy.stats.qmc
from fakes import FakeSolver, lines, make_study
from trying import POINTS, results

from stemcal import workflow
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.study.model import Study

PRELOADED = scipy.stats.qmc
SECONDS_PER_RUN = 0.002


class WitnessedFolder(StudyFolder):
    """Tells of every acknowledged record, in a file that a kill cannot take back."""

    def save(self, record: Mapping[str, Any]) -> None:
        super().save(record)
        with self.path.with_suffix(".saved").open("ab") as file:
            file.write(f"{record['key']} {record['request']['stage']} {record['request']['row']}\n".encode())


@dataclass
class Tally:
    """What happened."""

    kills: int = 0
    finished: int = 0
    acknowledged: int = 0
    lost: list[str] = field(default_factory=list)
    redone: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return (
            f"{self.kills} kills, {self.finished} studies finished between them, "
            f"{self.acknowledged} runs acknowledged: {len(self.lost)} lost, {len(self.redone)} done again"
        )


def kill_many(place: Path, kills: int, seed: int) -> Tally:
    """Kill a study `kills` times in `place`; raise `AssertionError` if a byte of its results differs."""
    rng, tally, study = random.Random(seed), Tally(), make_study(place, POINTS)
    unbroken, broken = StudyFolder(place / "unbroken"), StudyFolder(place / "broken")
    workflow.calibrate(study, unbroken, InlineExecutor(), solver=FakeSolver())
    witness, saved = place / "witness", place / "broken.saved"
    seconds, job = {"screen": 0.3, "calibrate": 3.0}, "screen"
    while tally.kills < kills:
        before, kept = len(lines(witness)), _answered(broken)
        process = _fork(job, study, broken.path, FakeSolver(witness, SECONDS_PER_RUN))
        time.sleep(rng.uniform(0.0, seconds[job]))
        finished = _end(process)
        tally.kills += not finished
        _check_records(broken, kept, lines(witness)[before:], tally)
        if finished:
            tally.finished += 1
            whole = results(unbroken.path)
            found = results(broken.path)
            assert found.items() <= whole.items() if job == "screen" else found == whole, "the tables differ"
            tally.acknowledged += _take_away(broken, saved, rng)
            job = "calibrate" if rng.random() < 0.1 else "screen"
    tally.acknowledged += len(lines(saved))
    return tally


def _fork(job: str, study: Study, folder: Path, solver: FakeSolver) -> int:
    process = os.fork()
    if process:
        return process
    code = 1
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        getattr(workflow, job)(study, WitnessedFolder(folder), InlineExecutor(), solver=solver)
        code = 0
    finally:
        os._exit(code)


def _end(process: int) -> bool:
    """Kill the process unless it has finished; tell which."""
    ended, status = os.waitpid(process, os.WNOHANG)
    if not ended:
        os.kill(process, signal.SIGKILL)
        _, status = os.waitpid(process, 0)
    assert os.WIFSIGNALED(status) or status == 0, f"the study ended with status {status}"
    return status == 0


def _answered(folder: StudyFolder) -> set[str]:
    """Return stage and row of every intact record."""
    requests = [record["request"] for key in folder.keys() if (record := folder.peek(key))]  # noqa: SIM118
    return {f"{request['stage']} {request['row']}" for request in requests}


def _check_records(folder: StudyFolder, kept: set[str], begun: list[str], tally: Tally) -> None:
    """Whatever was acknowledged is there, intact, and what was there before was not begun again."""
    for line in lines(folder.path.with_suffix(".saved")):
        if folder.peek(line.split()[0]) is None:
            tally.lost.append(line)
    for key in folder.keys():  # noqa: SIM118
        if folder.peek(key) is None:
            tally.lost.append(f"{key} is damaged")
    tally.redone += sorted(kept & set(begun))


def _take_away(folder: StudyFolder, saved: Path, rng: random.Random) -> int:
    """Remove some records of a finished study, so that there is work; return how many were acknowledged."""
    count = len(lines(saved))
    removed = {key for key in folder.keys() if rng.random() < 0.6}  # noqa: SIM118
    for key in removed:
        folder.record_path(key).unlink()
    for path in folder.path.glob("*.json"):
        if rng.random() < 0.5:
            path.unlink()
    saved.unlink(missing_ok=True)
    return count


def main() -> int:
    """Kill as often as asked and print the count."""
    kills = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as place:
        tally = kill_many(Path(place), kills, seed)
    print(f"{tally}, in {time.monotonic() - begun:.0f} s")
    return bool(tally.lost or tally.redone)


if __name__ == "__main__":
    sys.exit(main())
