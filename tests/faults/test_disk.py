"""A disk that is full or fails, for real: a small tmpfs, and errors that strace injects into system calls.

All of it on a whole screening of the replayed paper in a process of its own: nothing that was acknowledged is
lost or corrupt, the message names the file, and with the disk mended the study goes on to the same bytes.
"""

import errno
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import workflow
from fakes import ENVIRONMENT, FakeSolver, make_study
from trying import CONFIGS, POSIX, command, results, trials

from stemcal.errors import StemcalError
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder

REPLAY = CONFIGS / "paper-replay.yaml"
CALLS = {"write": "write", "fsync": "fsync", "rename": "rename,renameat,renameat2"}


def screen(folder: Path, *before: str) -> subprocess.CompletedProcess[str]:
    """Run `stemcal screen` on the replayed paper, perhaps under another command."""
    return subprocess.run(
        [*before, sys.executable, "-m", "stemcal", "screen", str(REPLAY), "--out", str(folder), "--quiet"],
        capture_output=True,
        text=True,
        env={**ENVIRONMENT, "PYTHONDONTWRITEBYTECODE": "1"},
        timeout=120,
        check=False,
    )


def intact(folder: Path) -> dict[str, bytes]:
    """Return the bytes of all records; each must be whole."""
    store = StudyFolder(folder)
    assert all(store.peek(key) is not None for key in store.keys())  # noqa: SIM118
    return {key: store.record_path(key).read_bytes() for key in store.keys()}  # noqa: SIM118


def screened(folder: Path) -> None:
    """Run the same in this process, on a sound disk."""
    done = command("screen", REPLAY, "--out", folder, "--quiet")
    assert done.exit_code == 0, done.stderr


def goes_on(folder: Path, kept: dict[str, bytes], expected: dict[str, bytes]) -> None:
    """With the disk mended the study ends as if nothing had been, and keeps every record it had."""
    screened(folder)
    assert results(folder) == expected
    assert intact(folder).items() >= kept.items()
    assert not list(folder.rglob(".writing-*"))


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("unbroken")
    screened(folder)
    return results(folder)


# ---- no space left


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 32 kB, gone afterwards."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("mount") is None:
        pytest.skip("needs root and mount, to make a small file system")
    place = tmp_path / "small"
    place.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", str(place)], capture_output=True, text=True
    )
    if made.returncode:
        pytest.skip(f"a small file system cannot be mounted here: {made.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def test_disk_full(small_disk: Path, expected: dict[str, bytes]) -> None:
    folder = small_disk / "study"
    full = screen(folder)
    assert full.returncode == 1
    assert os.strerror(errno.ENOSPC) in full.stderr and "free some disk space, then repeat the command" in full.stderr
    assert "Traceback" not in full.stderr
    kept = intact(folder)
    assert 0 < len(kept) < 12
    again = screen(folder)  # still full: the same message, nothing lost
    assert again.returncode == 1 and intact(folder).items() >= kept.items()
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    goes_on(folder, kept, expected)


# ---- errors of the disk


@pytest.fixture(scope="module")
def strace() -> str:
    found = shutil.which("strace")
    if found is None:
        pytest.skip("needs strace, to let system calls fail")
    tried = subprocess.run([found, "-f", "-qq", "-o", os.devnull, "true"], capture_output=True, text=True, check=False)
    if tried.returncode:
        pytest.skip(f"strace may not trace here: {tried.stderr.strip()}")
    return found


def inject(strace: str, call: str, nth: int, folder: Path) -> subprocess.CompletedProcess[str]:
    """Let the nth of these system calls fail with EIO."""
    names = CALLS[call]
    options = ("-f", "-qq", "--seccomp-bpf", "-o", os.devnull, "-e", f"trace={names}")
    return screen(folder, strace, *options, "-e", f"inject={names}:error=EIO:when={nth}")


def count(strace: str, call: str, folder: Path) -> int:
    """Return how often an unbroken screening makes a system call."""
    log = folder.with_suffix(".log")
    done = screen(folder, strace, "-f", "-qq", "--seccomp-bpf", "-o", str(log), "-e", f"trace={CALLS[call]}")
    assert done.returncode == 0, done.stderr
    return len(log.read_text(encoding="utf-8", errors="replace").splitlines())


def survives(strace: str, call: str, nth: int, folder: Path, expected: dict[str, bytes]) -> bool:
    """Inject one error, mend the disk, go on; return whether the error ended the study."""
    done = inject(strace, call, nth, folder)
    assert "Traceback" not in done.stderr, done.stderr
    kept = intact(folder) if folder.exists() else {}
    if done.returncode:
        if call != "write":  # it may have been the message itself
            assert os.strerror(errno.EIO) in done.stderr, done.stderr
        if call in ("fsync", "rename"):
            assert "then repeat the command; finished runs are kept" in done.stderr
    goes_on(folder, kept, expected)
    return done.returncode != 0


def test_one_error_of_the_disk(strace: str, tmp_path: Path, expected: dict[str, bytes]) -> None:
    assert survives(strace, "rename", 5, tmp_path / "study", expected)


@pytest.mark.slow
@pytest.mark.parametrize("call", ["fsync", "rename", "write"])
def test_every_error_of_the_disk(strace: str, call: str, tmp_path: Path, expected: dict[str, bytes]) -> None:
    """Every fsync and rename of a screening; of its writes, many of which are no business of ours, a sample."""
    total = count(strace, call, tmp_path / "counted")
    tried = random.Random(1).sample(range(1, total + 1), min(total, 40))
    ended = [survives(strace, call, nth, tmp_path / f"study-{nth}", expected) for nth in tried]
    print(
        f"{call}: {len(tried)} of {total} calls failed one by one, {sum(ended)} ended the study, "
        "0 records lost, 0 tables differ"
    )


# ---- places that may not be written


@POSIX
@trials(3, 15)
def test_a_folder_that_may_not_be_written(folder: Path, number: int, _rng: random.Random) -> None:
    """The study's records, its folder, or what it would be made in: told with the place; later it goes on."""
    study = StudyFolder(folder / "place" / "study")
    place = (study.runs, study.path, study.path.parent)[number % 3]
    place.mkdir(parents=True)
    with closed(place), pytest.raises(StemcalError, match=f"{place}.*;"), study:
        workflow.run_stage("screen", make_study(folder), study, InlineExecutor(), solver=FakeSolver())
    assert not study.runs.is_dir() or study.keys() == []
    workflow.run_stage("screen", make_study(folder), study, InlineExecutor(), solver=FakeSolver())


@contextmanager
def closed(folder: Path) -> Iterator[None]:
    """Take away the right to write; from root, who has every right, by a file system that is read-only."""
    if os.geteuid() != 0:
        folder.chmod(0o555)
        yield
        folder.chmod(0o755)
        return
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(folder)], capture_output=True, check=False)
    if made.returncode:
        pytest.skip("root needs mount, to make a file system that may not be written")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)
