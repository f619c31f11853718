"""The study folder: a record of each run, the result files of the stages, a lock and a log.

After `StudyFolder.save` has returned, the record survives a killed process and, if the system can flush a folder, a
power cut. Each record contains the SHA-256 of its content. A record that does not match its hash, or is not a valid
record, is moved to ``runs/damaged`` and counts as missing. The result files of the stages contain a hash, too.
"""

import json
import logging
import os
import platform
import re
import socket
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from inspect import signature
from pathlib import Path
from typing import Any, Self

from filelock import FileLock, Timeout

from stemcal.errors import FolderLocked, StemcalError, UsageError
from stemcal.storage.atomic import make_folder, refuse_link, remove_leftovers, write_atomic
from stemcal.storage.canonical import jsonable, key_of
from stemcal.storage.encodings import in_a_line
from stemcal.storage.plain import MIB, read_plain
from stemcal.storage.sealed import Broken, read_sealed, sealed

logger = logging.getLogger(__name__)

_SPEC_PLACE = "spec-path.txt"
_MOST_NOTE = 1 << 16  # largest size of the files with the path of the spec or the holder of the lock, bytes
SCHEMA_VERSION = 3  # version of the format of stage files
RECORD_VERSION = 4
_KEY = re.compile(r"[0-9a-f]{32}")
_RECORDED: dict[str, Any] = {
    **dict.fromkeys(("identity", "request", "details", "provenance"), dict),
    **dict.fromkeys(("status", "reason", "message"), str),
    "response": float | int | None,
}
_WITHIN: dict[str, dict[str, Any]] = {
    "request": {"stage": str, "row": int, "levels": dict, "condition": float | int | None},
    "details": {
        **dict.fromkeys(("curve", "responses"), dict | None),
        **dict.fromkeys(("time_limit", "peak_force", "peak_travel", "added_mass_percent"), float | int | None),
    },
}
"""Types of the entries of a record, and of those entries of its `request` and `details` that are read."""
_MOST_KNOWN = 16 * MIB  # limit on the total size of the record files that are cached in memory, bytes
_TICK_NS = 100_000_000  # coarsest resolution of the time stamps of a file system, ns
_LOCK_PATIENCE_S = 0.2  # wait longer than the lock is held by `StudyFolder.holder`, which only tests it


def place_of(study: str, out: str | Path | None = None) -> Path:
    """Return the study folder: `out`, or by default ``runs/<study name>``."""
    return Path("runs") / study if out is None else Path(out)


class StudyFolder:
    """The folder of one study; it is created when it is locked for the first time.

    A ``with`` statement locks the folder; the process that holds the lock may lock it again. Reading needs no lock.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._lock, self._holder_file = _file_lock(self.path / ".lock", _LOCK_PATIENCE_S), self.path / ".lock.holder"
        # cached records by key, each with the time, size and inode of its file
        self._known: dict[str, tuple[tuple[int, int, int], dict[str, Any]]] = {}
        self._room = _MOST_KNOWN

    def __repr__(self) -> str:
        return f"StudyFolder({str(self.path)!r})"

    def __reduce__(self) -> tuple[type, tuple[Path]]:
        """Restrict pickling and copying to the path, because a lock cannot be copied."""
        return type(self), (self.path,)

    # ---- lock

    def __enter__(self) -> Self:
        self.lock()
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock.lock_counter == 1:
            with suppress(OSError):
                self._holder_file.unlink()
        self._lock.release()

    def lock(self) -> None:
        """Lock the folder for this process; raise `FolderLocked` if another process is using it."""
        try:
            make_folder(self.runs)
            refuse_link(self.path / ".lock")
            self._lock.acquire()
        except Timeout:
            raise FolderLocked(
                f"{self.path}: {self._signature()}; wait until this process has finished, or choose another folder "
                "with `--out`"
            ) from None
        except (OSError, NotImplementedError) as error:  # such as a network disk without a lock service
            place, why = getattr(error, "filename", None) or self.path, getattr(error, "strerror", None) or error
            message = f"{place}: {why}; use `--out` to choose a folder on a disk that supports file locks"
            raise StemcalError(message) from None
        if self._lock.lock_counter == 1:
            with suppress(OSError, StemcalError):
                by = f"process {os.getpid()} on {socket.gethostname()} has been using this folder since {now()}"
                write_atomic(self._holder_file, by)
            remove_leftovers(self.path, self.runs)

    def holder(self) -> str | None:
        """Return a text that names the process using the folder; None if no process is using it."""
        probe = _file_lock(self.path / ".lock", 0.0)
        try:
            if not Path(probe.lock_file).exists():
                return None
            probe.acquire()
        except Timeout:
            return self._signature()
        except (OSError, NotImplementedError):  # without permission to lock, only the signature is available
            return self._signature() if self._holder_file.exists() else None
        probe.release()
        return None

    def _signature(self) -> str:
        try:
            return in_a_line(read_plain(self._holder_file, _MOST_NOTE).decode("utf-8", "replace"))
        except OSError:
            return "another process is using this folder"

    # ---- records of runs

    @property
    def work(self) -> Path:
        """Folder for the run folders of solvers that need files."""
        return self.path.absolute() / "work"

    @property
    def runs(self) -> Path:
        """Folder of the records."""
        return self.path / "runs"

    def record_path(self, key: str) -> Path:
        if _KEY.fullmatch(key) is None:
            raise ValueError(f"{key!r} is not a valid record key")
        return self.runs / f"{key}.json"

    def keys(self) -> list[str]:
        """Return the keys of all records, damaged or not, sorted."""
        return sorted(path.stem for path in self.runs.glob("*.json") if _KEY.fullmatch(path.stem))

    def save(self, record: Mapping[str, Any]) -> None:
        """Write a record in full or not at all; its file name is `record["key"]`."""
        write_atomic(self.record_path(record["key"]), sealed({"record_version": RECORD_VERSION, **record}))

    def load(self, key: str) -> dict[str, Any] | None:
        """Return a record without its hash; None if there is none. A damaged record is moved to ``runs/damaged``."""
        record, problem = self._read(key)
        if problem:
            path = self.record_path(key)
            logger.warning("%s %s; the record was moved to `runs/damaged`, and its run will be repeated", path, problem)
            with suppress(OSError, StemcalError):
                damaged = make_folder(self.runs / "damaged")
                path.replace(damaged / f"{path.stem}-{datetime.now(UTC).strftime('%Y%m%dT%H%M%S%f')}.json")
                self.log("record_damaged", key=key)
        return record

    def peek(self, key: str) -> dict[str, Any] | None:
        """Return a record without its hash; None if there is none or it is damaged. No file is changed."""
        return self._read(key)[0]

    def _read(self, key: str) -> tuple[dict[str, Any] | None, str]:
        """Return the result of `examine`; it is cached until the file changes, because commands read a record often."""
        try:
            status = self.record_path(key).stat()
        except OSError:
            return self.examine(key)
        stamp = status.st_mtime_ns, status.st_size, status.st_ino
        if key in self._known and self._known[key][0] == stamp:
            return self._known[key][1], ""
        record, problem = self.examine(key)
        settled = time.time_ns() - status.st_mtime_ns > _TICK_NS  # old enough: a later change has another time stamp
        if record is not None and settled and self._room >= status.st_size:
            self._room -= status.st_size
            self._known[key] = stamp, record
        return record, problem

    def examine(self, key: str) -> tuple[dict[str, Any] | None, str]:
        """Return a record without its hash (None if there is none or it is damaged), and its fault ("" if none)."""
        try:
            record = read_sealed(self.record_path(key))
        except FileNotFoundError:
            return None, ""
        except Broken as broken:
            return None, str(broken)
        problem = _problem_of(record, key)
        return (None, problem) if problem else (record, "")

    # ---- result files of the stages

    def write_stage(self, stage: str, content: Mapping[str, Any]) -> None:
        """Write the result of a stage with its hash, in full or not at all; equal content is written as equal bytes."""
        write_atomic(self.path / f"{stage}.json", sealed(content))

    def read_stage(self, stage: str) -> dict[str, Any]:
        """Return the result of a stage; `UsageError` if it is missing, damaged or of another schema version."""
        content = self.examine_stage(stage)
        if (version := content.get("schema_version")) != SCHEMA_VERSION:
            raise UsageError(
                f"{self.path / stage}.json has schema version {version!r:.20}; this version of stemcal requires "
                f"{SCHEMA_VERSION}; run `stemcal {stage} SPEC` again (recorded runs are reused)"
            )
        return content

    def examine_stage(self, stage: str) -> dict[str, Any]:
        """Return the result of a stage, of any schema version; `UsageError` if it is missing or damaged."""
        path = self.path / f"{stage}.json"
        try:
            content = read_sealed(path)
        except FileNotFoundError:
            raise UsageError(f"{path} does not exist yet; run `stemcal {stage} SPEC` first") from None
        except Broken as broken:
            raise UsageError(f"{path} is damaged: the file {broken}; run `stemcal {stage} SPEC` again") from None
        if content.get("stage") != stage:
            raise UsageError(f"{path} is not a result of the {stage} stage; run `stemcal {stage} SPEC` again")
        return content

    def has_stage(self, stage: str) -> bool:
        return (self.path / f"{stage}.json").exists()

    def remember_spec(self, spec: Path) -> None:
        """Store the path of the spec, so that results can be opened with the path of the folder alone."""
        write_atomic(self.path / _SPEC_PLACE, f"{spec.absolute()}\n")

    def remembered_spec(self) -> Path | None:
        """Return the path of the spec that is stored in the study folder; None if no path is stored."""
        try:
            return Path(read_plain(self.path / _SPEC_PLACE, _MOST_NOTE).decode("utf-8", "surrogateescape").strip())
        except OSError:
            return None

    def log(self, event: str, **facts: Any) -> None:
        """Append an event with its facts and the time to ``log.jsonl`` as a line of JSON; only warn if this fails."""
        line = json.dumps({"time": now(), "event": event, **jsonable(facts)}, ensure_ascii=False, allow_nan=False)
        path = self.path / "log.jsonl"
        try:
            refuse_link(path)
            with path.open("ab") as file:
                file.write(f"{line}\n".encode("utf-8", "backslashreplace"))
        except (OSError, StemcalError) as error:
            logger.warning("log.jsonl: %s", error)


def _problem_of(record: Mapping[str, Any], key: str) -> str:
    if (version := record.get("record_version")) != RECORD_VERSION:
        return f"has record version {version!r:.20}; this version of stemcal requires {RECORD_VERSION}"
    if missing := [name for name in _RECORDED if name not in record]:
        return f"is not a valid run record: it does not contain {', '.join(missing)}"
    parts = [record, *(record[name] for name in _WITHIN if isinstance(record[name], dict))]
    for part, kinds in zip(parts, (_RECORDED, *_WITHIN.values()), strict=False):
        if wrong := [name for name, kind in kinds.items() if name in part and not isinstance(part[name], kind)]:
            return f"is not a valid run record: {', '.join(f'`{name}` is {part[name]!r:.20}' for name in wrong)}"
    if (curve := record["details"].get("curve")) and not _is_curve(curve):
        return "is not a valid run record: `curve` requires the lists `travel` and `force` of as many numbers"
    numbers = {**(record["details"].get("responses") or {}), **record["request"].get("levels", {})}
    if wrong := [name for name, value in numbers.items() if not isinstance(value, float | int | None)]:
        return f"is not a valid run record: {', '.join(f'`{name}` is {numbers[name]!r:.20}' for name in wrong)}"
    status, response = record["status"], record["response"]
    if status not in ("ok", "failed") or (status == "ok") != (response is not None):
        return f"is not a valid run record: the status {status!r:.20} contradicts the response {response!r:.20}"
    if record.get("key") != key or key_of(record["identity"]) != key:
        return "has a file name that does not match its content"
    return ""


def _is_curve(curve: Mapping[str, Any]) -> bool:
    travel, force = curve.get("travel"), curve.get("force")
    if not (isinstance(travel, list) and isinstance(force, list) and len(travel) == len(force)):
        return False
    return all(isinstance(value, float | int | None) for value in (*travel, *force))


def _file_lock(path: Path, patience: float) -> FileLock:
    """Return a lock of the operating system; a mere lock file would remain after its process was killed."""
    kernel_only = {"fallback_to_soft": False} if "fallback_to_soft" in signature(FileLock.__init__).parameters else {}
    any_lock: Callable[..., FileLock] = FileLock
    return any_lock(path, timeout=patience, poll_interval=0.02, **kernel_only)


def provenance() -> dict[str, str]:
    """Return the versions of the programs, and the machine, for the record of a run."""
    import numpy

    from stemcal.version import __version__

    return {
        "stemcal": __version__,
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "host": socket.gethostname(),
        "platform": platform.platform(),
    }


def now() -> str:
    """Return the present time, UTC, in ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
