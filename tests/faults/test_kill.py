"""kill -9 of a whole study at random times: nothing acknowledged is lost or redone, same bytes at the end."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import workflow
from fakes import ENVIRONMENT, FakeSolver, lines, make_study
from trying import POINTS, POSIX, results

from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder

pytestmark = POSIX

SCRIPT = Path(__file__).parent / "study_process.py"
SECONDS_PER_RUN = 0.04


def start(folder: Path, witness: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, str(SCRIPT), str(folder), str(witness), str(SECONDS_PER_RUN)],
        start_new_session=True,
        stderr=subprocess.PIPE,
        env=ENVIRONMENT,
    )


def acknowledged(folder: StudyFolder) -> dict[str, str]:
    """Return the witness's line for every intact record."""
    found = {}
    for key in folder.keys():  # noqa: SIM118
        record = folder.peek(key)
        assert record is not None, f"{key} is damaged"
        found[key] = f"{record['request']['stage']} {record['request']['row']}"
    return found


def kill_at_random(process: subprocess.Popen[bytes], witness: Path, rng: random.Random) -> bool:
    """Kill the group once a few more runs have begun, at any moment of the next; False if it ended before."""
    goal = len(lines(witness)) + rng.randint(0, 8)
    while len(lines(witness)) < goal and process.poll() is None:
        time.sleep(0.005)
    time.sleep(rng.uniform(0.0, 0.3))
    killed = process.poll() is None
    if killed:
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    return killed


def survive(tmp_path: Path, kills: int, seed: int) -> int:
    """Kill a study `kills` times, let it finish, compare with an unbroken one; returns the kills that hit."""
    rng = random.Random(seed)
    unbroken, broken = StudyFolder(tmp_path / "unbroken"), StudyFolder(tmp_path / "broken")
    study = make_study(tmp_path, POINTS)
    workflow.calibrate(study, unbroken, InlineExecutor(), solver=FakeSolver())
    witness, hits = tmp_path / "witness", 0
    while hits < kills:
        hit = kill_at_random(start(broken.path, witness), witness, rng)
        hits += hit
        kept, begun = acknowledged(broken), len(lines(witness))
        saved = Path(f"{witness}.saved")
        assert set(lines(saved)) <= set(kept), "an acknowledged run is lost"
        if not hit or hits == kills:
            workflow.calibrate(study, broken, InlineExecutor(), solver=FakeSolver(witness))
            redone = set(lines(witness)[begun:]) & set(kept.values())
            assert not redone, f"computed again: {redone}"
            assert set(kept) <= set(acknowledged(broken))
            assert results(broken.path) == results(unbroken.path)
            assert broken.keys() == unbroken.keys()
            for key in broken.keys()[:: rng.randint(2, 5)]:  # leave work for the next kill
                broken.record_path(key).unlink()
            witness.unlink()
            saved.unlink(missing_ok=True)
    return hits


def test_two_kills_of_a_study_with_workers(tmp_path: Path) -> None:
    assert survive(tmp_path, kills=2, seed=20) == 2


@pytest.mark.slow
def test_sixty_kills(tmp_path: Path) -> None:
    assert survive(tmp_path, kills=60, seed=21) == 60


def test_a_damaged_record_is_computed_again(tmp_path: Path) -> None:
    """In a finished study every seventh record gets one flipped byte: just these runs are done again."""
    folder, witness = StudyFolder(tmp_path / "out"), tmp_path / "witness"
    study, solver = make_study(tmp_path), FakeSolver(witness)
    workflow.calibrate(study, folder, InlineExecutor(), solver=solver)
    before, begun, rng = results(folder.path), len(lines(witness)), random.Random(3)
    damaged = folder.keys()[::7]
    for key in damaged:
        path = folder.record_path(key)
        content = bytearray(path.read_bytes())
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        path.write_bytes(content)
    workflow.calibrate(study, folder, InlineExecutor(), solver=solver)
    assert len(lines(witness)) - begun == len(damaged) == len(list((folder.runs / "damaged").iterdir()))
    assert results(folder.path) == before


@pytest.mark.parametrize("name", ["SIGTERM", pytest.param("SIGINT", marks=pytest.mark.slow)])
def test_a_polite_signal_to_the_group(tmp_path: Path, name: str) -> None:
    """As a terminal's Ctrl-C or a batch system's end: the study ends soon and goes on later."""
    folder, witness = StudyFolder(tmp_path / "out"), tmp_path / "witness"
    saved = Path(f"{witness}.saved")
    process = start(folder.path, witness)
    while len(lines(saved)) < 2 and process.poll() is None:
        time.sleep(0.01)
    told = set(lines(saved))
    os.killpg(process.pid, signal.Signals[name])
    process.communicate(timeout=15)
    assert process.returncode != 0
    kept, begun = acknowledged(folder), len(lines(witness))
    assert len(told) >= 2 and told <= set(kept)
    workflow.calibrate(make_study(tmp_path, POINTS), folder, InlineExecutor(), solver=FakeSolver(witness))
    assert not set(lines(witness)[begun:]) & set(kept.values())
