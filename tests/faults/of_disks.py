"""Disks that are full, fail or may not be written."""

from __future__ import annotations

import errno
import os
import random
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import test_disk
from fakes import FakeSolver, make_study
from of_processes import POINTS, results
from tally import Fault, Missing, Tally, each

from stemcal import workflow
from stemcal.errors import StemcalError
from stemcal.executors.inline import InlineExecutor
from stemcal.files import durable
from stemcal.folder.study_folder import StudyFolder


def finished(folder: Path, name: str = "out", witness: Path | None = None) -> StudyFolder:
    """Take the known study through all stages."""
    found = StudyFolder(folder / name)
    workflow.calibrate(make_study(folder, POINTS), found, InlineExecutor(), solver=FakeSolver(witness))
    return found


# ---- every operation on the disk fails once


class Failing:
    """Lets the nth operation on a file of the study fail, and counts them."""

    def __init__(self, nth: int, number: int) -> None:
        self.nth, self.number, self.count = nth, number, 0

    def __call__(self, operation: Callable[..., Any]) -> Callable[..., Any]:
        def perhaps(*args: Any, **kwargs: Any) -> Any:
            self.count += 1
            if self.count == self.nth:
                raise OSError(self.number, os.strerror(self.number))
            return operation(*args, **kwargs)

        return perhaps

    def installed(self) -> mock._patch[Any]:
        """Replace what `durable` opens, flushes and renames with."""
        return mock.patch.multiple(
            durable, _replace=self(durable._replace), _flush_folder=self(durable._flush_folder), os=_Os(self)
        )


class _Os:
    """The module os, with a `fsync` that may fail."""

    def __init__(self, failing: Failing) -> None:
        self.fsync = failing(os.fsync)

    def __getattr__(self, name: str) -> Any:
        return getattr(os, name)


def every_operation(place: Path, times: int, rng: random.Random) -> Tally:
    """Let one fsync, rename or flush of a folder after another fail in a whole study; then go on."""
    place.mkdir(parents=True, exist_ok=True)
    whole, counting = results(finished(place, "whole").path), Failing(0, 0)
    with counting.installed():
        finished(place, "counted")
    total = 2 * counting.count
    chosen = sorted(rng.sample(range(total), min(times, total)))
    trials = each(lambda folder, number, _rng: _fails_once(folder, chosen[number], whole))
    tally = trials(place, len(chosen), rng)
    tally.remark = f"a study has {counting.count} such operations, each tried with 2 errors"
    return tally


def _fails_once(folder: Path, which: int, whole: dict[str, bytes]) -> None:
    failing = Failing(which // 2 + 1, (errno.EIO, errno.ENOSPC)[which % 2])
    said = ""
    with failing.installed():
        try:
            finished(folder)
        except StemcalError as error:
            said = str(error)
    assert "the same command then resumes with the finished runs" in said, f"operation {failing.nth}: {said!r}"
    kept = StudyFolder(folder / "out")
    before = {key: kept.record_path(key).read_bytes() for key in kept.keys()}  # noqa: SIM118
    assert all(kept.peek(key) for key in before), "a record is not whole"
    finished(folder)
    assert results(kept.path) == whole, "the tables differ"
    assert all(kept.record_path(key).read_bytes() == blob for key, blob in before.items()), "a run was done again"
    assert not list(kept.path.rglob(".writing-*")), "a temporary file is left"


# ---- errors of the system itself


def system_errors(place: Path, times: int, rng: random.Random) -> Tally:
    """Let strace fail one write, fsync or rename of a process."""
    strace = shutil.which("strace")
    tried = subprocess.run([strace, "-qq", "true"], capture_output=True, check=False) if strace else None
    if strace is None or tried is None or tried.returncode:
        raise Missing("needs strace that may trace")
    place.mkdir(parents=True, exist_ok=True)
    test_disk.screen(place / "whole")
    expected = test_disk.results(place / "whole")

    def trial(folder: Path, number: int, rng: random.Random) -> None:
        call = ("fsync", "rename", "write")[number % 3]
        test_disk.survives(strace, call, rng.randint(1, 12), folder / "study", expected)

    return each(trial)(place, times, rng)


def disk_full(place: Path, times: int, rng: random.Random) -> Tally:
    """Give the study a file system of some kB, later of some MB."""
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("mount") is None:
        raise Missing("needs root and mount, to make a small file system")
    place.mkdir(parents=True, exist_ok=True)
    test_disk.screen(place / "whole")
    expected = test_disk.results(place / "whole")

    def trial(folder: Path, _number: int, rng: random.Random) -> None:
        _small_disk(folder, rng.randrange(12, 60, 4), expected)

    return each(trial)(place, times, rng)


def _small_disk(folder: Path, kilobytes: int, expected: dict[str, bytes]) -> None:
    options = ["-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(folder)]
    if subprocess.run(["mount", *options], capture_output=True, check=False).returncode:
        raise Missing("a small file system cannot be mounted here")
    try:
        full = test_disk.screen(folder / "study")
        assert full.returncode == 1 and "Traceback" not in full.stderr, full.stderr[-300:]
        assert os.strerror(errno.ENOSPC) in full.stderr, full.stderr[-300:]
        kept = test_disk.intact(folder / "study") if (folder / "study").exists() else {}
        subprocess.run(["mount", "-o", "remount,size=8m", str(folder)], check=True)
        test_disk.goes_on(folder / "study", kept, expected)
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def read_only(folder: Path, number: int, _rng: random.Random) -> None:
    """The study's records, its folder, or what it would be made in may not be written; later they may."""
    study = StudyFolder(folder / "place" / "study")
    closed = (study.runs, study.path, study.path.parent)[number % 3]
    closed.mkdir(parents=True)
    with _closed(closed):
        try:
            with study:
                workflow.run_stage("screen", make_study(folder), study, InlineExecutor(), solver=FakeSolver())
        except StemcalError as error:
            said = str(error)
            assert str(closed) in said and ";" in said, said
        else:
            raise AssertionError("nothing was said")
        assert not study.runs.is_dir() or study.keys() == []
    workflow.run_stage("screen", make_study(folder), study, InlineExecutor(), solver=FakeSolver())


@contextmanager
def _closed(folder: Path) -> Iterator[None]:
    """Take away the right to write; from root, who has every right, by a file system that is read-only."""
    if os.name == "nt":
        raise Missing("needs POSIX rights")
    if os.geteuid() != 0:
        folder.chmod(0o555)
        yield
        folder.chmod(0o755)
        return
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(folder)], capture_output=True, check=False)
    if made.returncode:
        raise Missing("root needs mount, to make a file system that may not be written")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


FAULTS = (
    Fault(
        "an operation on the disk fails",
        "EIO or ENOSPC at one fsync, rename or flush of a folder after another, in a whole study",
        "nothing corrupt, a message with the file and the remedy, goes on to the same bytes",
        every_operation,
        4,
        10_000,
    ),
    Fault(
        "a system call fails",
        "EIO that strace injects into a write, fsync or rename of `stemcal screen`",
        "the same",
        system_errors,
        0,
        12,
    ),
    Fault(
        "the disk is full",
        "a file system of 12 to 56 kB, later of 8 MB",
        "the same",
        disk_full,
        1,
        6,
    ),
    Fault(
        "the folder may not be written",
        "the records, the study folder, or what it would be made in are read-only",
        "a message with the place and the remedy, no traceback",
        each(read_only),
        3,
        15,
    ),
)
