"""Records that survive, damage that is seen, a lock that holds."""

import errno
import json
import os
import random
import subprocess
import sys
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import workflow
from fakes import ENVIRONMENT, make_study
from hypothesis import given
from hypothesis import strategies as st

from stemcal.drawing.table import Table
from stemcal.errors import FolderLocked, StemcalError, UsageError
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.verdict.verdict_rules import verdict_of
from stemcal.storage import atomic
from stemcal.storage.canonical import as_json, canonical, digest
from stemcal.storage.sealed import sealed

IDENTITY = {"solver": "known", "levels": {"a": 1.5}}
KEY = digest(IDENTITY)[:32]


def record(**extra: Any) -> dict[str, Any]:
    return {
        "key": KEY,
        "identity": IDENTITY,
        "request": {"stage": "screen", "row": 0, "levels": {"a": 1.5}, "condition": 8.0, "pictured": False},
        "status": "ok",
        "response": 120.1,
        "reason": "",
        "message": "",
        "details": {"more": [0.1, 2.0, 1e-9]},
        "provenance": {},
        **extra,
    }


@pytest.fixture
def folder(tmp_path: Path) -> StudyFolder:
    with StudyFolder(tmp_path / "study") as folder:
        yield folder


# ---- records


def test_what_is_saved_is_loaded(folder: StudyFolder) -> None:
    folder.save(record(message="Kraft fällt auf 0 N — 切割"))
    loaded = folder.load(KEY)
    assert loaded == {"record_version": 4, **record(message="Kraft fällt auf 0 N — 切割")}
    assert folder.keys() == [KEY]


def test_numbers_come_back_bit_by_bit(folder: StudyFolder) -> None:
    rng = random.Random(1)
    values = [rng.uniform(-1, 1) * 10 ** rng.randint(-300, 300) for _ in range(500)]
    folder.save(record(details={"values": np.array(values)}))
    loaded = folder.load(KEY)
    assert loaded is not None and loaded["details"]["values"] == values


def test_missing_is_none(folder: StudyFolder) -> None:
    assert folder.load(KEY) is None


@pytest.mark.parametrize("key", ["../../etc/passwd", "", "g" * 32, "0" * 33, "0" * 31 + "\n"])
def test_keys_are_no_paths(folder: StudyFolder, key: str) -> None:
    with pytest.raises(ValueError, match="not a valid record key"):
        folder.load(key)


def test_every_flipped_bit_and_every_truncation_is_seen(folder: StudyFolder) -> None:
    folder.save(record())
    path = folder.record_path(KEY)
    whole = path.read_bytes()
    for index in range(len(whole)):
        for spoiled in (whole[:index] + bytes([whole[index] ^ (1 << index % 8)]) + whole[index + 1 :], whole[:index]):
            path.write_bytes(spoiled)
            assert folder.peek(KEY) is None, f"byte {index} of {len(whole)}"
    path.write_bytes(whole)
    assert folder.peek(KEY) is not None


def test_a_damaged_record_is_set_aside(folder: StudyFolder) -> None:
    folder.save(record())
    path = folder.record_path(KEY)
    path.write_bytes(path.read_bytes().replace(b"120.1", b"121.1"))
    assert folder.load(KEY) is None
    assert not path.exists()
    assert len(list((folder.runs / "damaged").iterdir())) == 1
    assert "record_damaged" in (folder.path / "log.jsonl").read_text(encoding="utf-8")
    folder.save(record())
    assert folder.load(KEY) is not None


def test_a_record_under_another_name_is_refused(folder: StudyFolder) -> None:
    folder.save(record())
    other = "f" * 32
    folder.record_path(other).write_bytes(folder.record_path(KEY).read_bytes())
    assert folder.load(other) is None


@pytest.mark.parametrize("junk", [b"", b"[]", b"null", b"{}", b"\xff\xfe", b"[" * 100_000, b'{"sha256": 1}'])
def test_junk_is_damage(folder: StudyFolder, junk: bytes) -> None:
    folder.record_path(KEY).write_bytes(junk)
    assert folder.load(KEY) is None


def test_a_record_that_has_grown_beyond_reason_is_damage(folder: StudyFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.save(record())
    monkeypatch.setattr("stemcal.storage.sealed.MAX_BYTES", 100)
    assert folder.peek(KEY) is None


CHANGED = {"record_version": 3, "key": "f" * 32, "identity": {"solver": "another"}, "status": "done", "response": None}


@pytest.mark.parametrize("name", [*record(), "record_version"])
def test_a_sealed_record_of_something_else_is_set_aside(folder: StudyFolder, name: str) -> None:
    whole = {"record_version": 4, **record()}
    without = {key: value for key, value in whole.items() if key != name}
    for content in (without, *([{**whole, name: CHANGED[name]}] if name in CHANGED else [])):
        folder.record_path(KEY).write_bytes(sealed(content).encode())
        found, problem = folder.examine(KEY)
        assert found is None and problem, content
        assert folder.load(KEY) is None and not folder.record_path(KEY).exists()


@pytest.mark.parametrize("changed", [
    {"details": [1]}, {"details": None}, {"identity": "x"}, {"request": []}, {"provenance": 3}, {"reason": 3},
    {"response": "120"}, {"details": {"curve": [1]}}, {"details": {"responses": 2}}, {"details": {"time_limit": "s"}},
    {"details": {"peak_force": [1]}}, {"request": {**record()["request"], "levels": [1]}},
    {"request": {**record()["request"], "condition": "8"}}, {"request": {**record()["request"], "levels": {"a": "1"}}},
    {"details": {"responses": {"angle": "32"}}}, {"details": {"curve": {"travel": [0.0, 1.0]}}},
    {"details": {"curve": {"travel": 1.0, "force": 2.0}}}, {"details": {"curve": {"travel": "01", "force": "01"}}},
    {"details": {"curve": {"travel": [0.0, 1.0], "force": [0.0]}}},
    {"details": {"curve": {"travel": [0.0, 1.0], "force": [0.0, "2"]}}},
])  # fmt: skip
def test_a_sealed_record_with_values_of_other_types_is_set_aside(folder: StudyFolder, changed: dict[str, Any]) -> None:
    folder.save(record(**changed))
    assert folder.load(KEY) is None and folder.keys() == []
    assert list((folder.runs / "damaged").iterdir())


@pytest.mark.parametrize(
    "curve", [None, {}, {"travel": [], "force": []}, {"travel": [0, 0.5], "force": [0.0, None], "x": 1}]
)
def test_a_record_with_a_curve_or_none_is_read(folder: StudyFolder, curve: dict[str, Any] | None) -> None:
    folder.save(record(details={"curve": curve, "responses": {"angle": 32.6, "bulk": None}}))
    found = folder.load(KEY)
    assert found is not None and found["details"]["curve"] == curve


def test_a_folder_in_the_place_of_a_record_is_set_aside(folder: StudyFolder) -> None:
    folder.record_path(KEY).mkdir()
    assert folder.examine(KEY) == (None, "is a folder")
    assert folder.load(KEY) is None
    folder.save(record())
    assert folder.load(KEY) is not None


# ---- JSON


def test_not_a_number_becomes_null() -> None:
    assert json.loads(as_json({"a": [np.nan, float("inf"), np.float64(2.5), np.int64(3), np.bool_(True)]})) == {
        "a": [None, None, 2.5, 3, True]
    }


@given(st.dictionaries(st.text(), st.floats() | st.text() | st.integers() | st.none()))
def test_json_of_anything_reads_back_to_the_same_digest(content: dict[str, Any]) -> None:
    assert digest(json.loads(as_json(content).encode("utf-8", "surrogatepass"))) == digest(content)
    assert canonical(content) == canonical(dict(reversed(content.items())))


def test_unknown_objects_are_refused() -> None:
    with pytest.raises(TypeError, match="cannot be written as JSON"):
        as_json({"a": object()})


# ---- stages and tables


def test_a_changed_digit_of_a_stage_file_is_seen(folder: StudyFolder) -> None:
    folder.write_stage("screen", {"stage": "screen", "x": 120.25})
    path = folder.path / "screen.json"
    whole = path.read_bytes()
    for changed in (whole.replace(b"120.25", b"121.25"), whole + b" ", whole.replace(b"  ", b" ")):
        path.write_bytes(changed)
        with pytest.raises(UsageError, match=r"does not match its SHA-256 checksum; run `stemcal screen SPEC` again"):
            folder.read_stage("screen")


def test_a_stage_file_without_its_seal_is_damaged(folder: StudyFolder) -> None:
    (folder.path / "screen.json").write_text('{"schema_version": 3, "stage": "screen"}', encoding="utf-8")
    with pytest.raises(UsageError, match="has no SHA-256 checksum; run `stemcal screen SPEC` again"):
        folder.read_stage("screen")


def test_a_folder_in_the_place_of_a_stage_file_is_told(folder: StudyFolder) -> None:
    (folder.path / "screen.json").mkdir()
    with pytest.raises(UsageError, match=r"screen.json is damaged: the file is a folder"):
        folder.read_stage("screen")


def test_stage_files(folder: StudyFolder) -> None:
    content = {"schema_version": 3, "stage": "screen", "x": 0.1}
    folder.write_stage("screen", {**content, "x": np.float64(0.1)})
    whole = f'{{\n  "sha256": "{digest(content)}",\n  "schema_version": 3,\n  "stage": "screen",\n  "x": 0.1\n}}\n'
    assert (folder.path / "screen.json").read_bytes() == whole.encode()
    assert folder.read_stage("screen") == content
    with pytest.raises(UsageError, match="run `stemcal rsm SPEC` first"):
        folder.read_stage("rsm")
    (folder.path / "screen.json").write_bytes(b'{"stage": "scr')
    with pytest.raises(UsageError, match="damaged"):
        folder.read_stage("screen")


def test_a_stage_file_of_another_version_is_told(folder: StudyFolder) -> None:
    folder.write_stage("screen", {"schema_version": 1, "stage": "screen"})
    with pytest.raises(UsageError, match=r"screen.json has schema version 1; .* requires 3; run .* again"):
        folder.read_stage("screen")


def test_tables_are_the_same_on_every_system(folder: StudyFolder) -> None:
    table = Table.of(("factor", "value"), [{"factor": "a,b", "value": 0.1}, {"factor": "é"}])
    atomic.write_atomic(folder.path / "t.csv", table.csv())
    assert (folder.path / "t.csv").read_bytes() == 'factor,value\n"a,b",0.1\né,\n'.encode()


# ---- lock


LOCKER = """
import sys, time
from stemcal.drawing.table import Table
from stemcal.storage.sealed import sealed
from stemcal.runs.study_folder import StudyFolder
with StudyFolder(sys.argv[1]):
    print("locked", flush=True)
    time.sleep(60)
"""


def test_a_second_process_is_refused_and_a_killed_one_leaves_no_lock(tmp_path: Path) -> None:
    other = subprocess.Popen(
        [sys.executable, "-c", LOCKER, str(tmp_path)], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT
    )
    try:
        assert other.stdout is not None and other.stdout.readline() == "locked\n"
        with pytest.raises(FolderLocked, match=f"process {other.pid} on ") as refused:
            StudyFolder(tmp_path).lock()
        assert refused.value.exit_code == 5
    finally:
        other.kill()
        other.communicate()
    with StudyFolder(tmp_path):
        pass


def test_who_looks_does_not_disturb(tmp_path: Path) -> None:
    """`holder` takes the lock for a moment; whoever wants to work waits that long."""
    looker = StudyFolder(tmp_path / "study")
    assert looker.holder() is None and not looker.path.exists()
    with StudyFolder(looker.path):
        assert f"process {os.getpid()} on " in (looker.holder() or "")
    assert looker.holder() is None
    for _ in range(20):
        stop = threading.Event()
        busy = threading.Thread(target=lambda stop=stop: [looker.holder() for _ in iter(stop.is_set, True)])
        busy.start()
        with StudyFolder(looker.path):
            pass
        stop.set()
        busy.join()


def test_the_holder_may_lock_again(tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path)
    with folder, folder:
        pass
    with StudyFolder(tmp_path):
        pass
    assert not (tmp_path / ".lock.holder").exists()


def test_two_folder_objects_of_one_process_exclude_each_other(tmp_path: Path) -> None:
    with StudyFolder(tmp_path), pytest.raises(FolderLocked):
        StudyFolder(tmp_path).lock()


def test_leftovers_of_a_killed_writer_are_removed(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / ".writing-1-0.tmp").touch()
    with StudyFolder(tmp_path) as folder:
        assert list(folder.runs.iterdir()) == []


def test_a_file_in_the_way_is_a_clear_message(tmp_path: Path) -> None:
    (tmp_path / "study").touch()
    with pytest.raises(StemcalError, match="use `--out` to choose a folder"):
        StudyFolder(tmp_path / "study").lock()


# ---- disk errors


@pytest.mark.parametrize("step", ["fsync", "_replace", "write"])
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
def test_a_failing_disk_loses_nothing(
    folder: StudyFolder, monkeypatch: pytest.MonkeyPatch, step: str, number: int
) -> None:
    folder.save(record())
    before = folder.record_path(KEY).read_bytes()

    def fail(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        if step == "fsync":
            patch.setattr(os, "fsync", fail)
        elif step == "_replace":
            patch.setattr(atomic, "_replace", fail)
        else:
            patch.setattr(Path, "open", fail)
        with pytest.raises(StemcalError, match="then repeat the command; finished runs are kept"):
            folder.save(record(response=1.0))
    assert folder.record_path(KEY).read_bytes() == before
    assert [path.name for path in folder.runs.iterdir()] == [f"{KEY}.json"]
    folder.save(record(response=2.0))
    loaded = folder.load(KEY)
    assert loaded is not None and loaded["response"] == 2.0


def test_a_log_that_cannot_be_written_stops_nothing(tmp_path: Path) -> None:
    with StudyFolder(tmp_path) as folder:
        (tmp_path / "log.jsonl").mkdir()
        folder.log("event")
        folder.save(record())
        assert folder.load(KEY) is not None
    assert list((tmp_path / "log.jsonl").iterdir()) == []


# ---- records are read once in a command


def test_a_record_is_read_again_only_after_its_file_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor is one that was written in the tick of the clock before."""
    read: list[str] = []
    examine = StudyFolder.examine
    monkeypatch.setattr(StudyFolder, "examine", lambda self, key: (read.append(key), examine(self, key))[1])
    with StudyFolder(tmp_path / "study") as folder:
        folder.save(record())
        assert folder.peek(KEY) == folder.peek(KEY) and len(read) == 2
        past = folder.record_path(KEY).stat().st_mtime_ns - 10**9
        os.utime(folder.record_path(KEY), ns=(past, past))
        assert folder.peek(KEY) == folder.load(KEY) == folder.peek(KEY) and len(read) == 3
        folder.save(record(response=121.0))
        loaded = folder.load(KEY)
        assert loaded is not None and loaded["response"] == 121.0 and len(read) == 4
        blob = folder.record_path(KEY).read_bytes()
        folder.record_path(KEY).write_bytes(blob.replace(b"121", b"131"))
        assert folder.peek(KEY) is None and folder.examine(KEY)[1]


def test_no_more_records_are_kept_than_have_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.runs.study_folder._MOST_KNOWN", 10)
    with StudyFolder(tmp_path / "study") as folder:
        folder.save(record())
        os.utime(folder.record_path(KEY), ns=(0, 0))
        assert folder.peek(KEY) is not None and not folder._known


def test_a_run_reads_each_record_once_or_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study that is complete: every stage is compared with its runs, the verdict and the page take from them."""
    study, place = make_study(tmp_path), StudyFolder(tmp_path / "out")
    workflow.calibrate(study, place, InlineExecutor())
    for key in place.keys():  # noqa: SIM118
        os.utime(place.record_path(key), ns=(0, 0))
    count, examine = Counter[str](), StudyFolder.examine
    monkeypatch.setattr(StudyFolder, "examine", lambda self, key: (count.update([key]), examine(self, key))[1])
    again = StudyFolder(place.path)
    workflow.calibrate(study, again, InlineExecutor())
    verdict_of(study, again)
    assert set(count) == set(place.keys()) and max(count.values()) == 1
