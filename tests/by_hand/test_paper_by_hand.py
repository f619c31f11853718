"""The paper's printed forces, entered by sheet, come to what they come to as tables."""

import json
import random
from pathlib import Path
from typing import Any

import pytest
import workflow
from sheets import Cells, awaited, entered, filled_in, paper_by_hand, text_of

from stemcal.errors import Waiting
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fresh import changes_since
from stemcal.study.reading import load_study

STAGES = ("screen", "rsm", "invert", "validate")


def content(folder: StudyFolder, stage: str) -> Any:
    """Return a stage's file without what names the solver: hashes of inputs, keys of records, the table's own note."""
    found = folder.read_stage(stage)
    found.pop("inputs")
    found["notes"] = [note for note in found["notes"] if note["kind"] != "from_table"]
    return json.loads(json.dumps(found), object_hook=lambda part: {k: v for k, v in part.items() if k != "key"})


def parts_of(sheet: Cells) -> list[Cells]:
    """Return a filled sheet in shuffled parts that overlap."""
    head, *rows = sheet
    random.Random(7).shuffle(rows)
    cut = len(rows) // 3
    return [[head, *part] for part in (rows[: 2 * cut], rows[cut:], rows)]


def test_entered_in_shuffled_parts_it_comes_to_the_replay(tmp_path: Path, replayed: tuple[Any, StudyFolder]) -> None:
    study, folder = load_study(paper_by_hand(tmp_path)), StudyFolder(tmp_path / "study")
    sizes = []
    while sheet := awaited(study, folder):
        sizes.append(len(sheet) - 1)
        first, second, whole = parts_of(filled_in(sheet))
        assert len(entered(study, folder, text_of(first)).taken) == len(first) - 1
        assert len(awaited(study, folder)) == len(whole) - len(first) + 1
        assert len(entered(study, folder, text_of(second)).taken) == len(whole) - len(first)
        again = entered(study, folder, text_of(whole))
        assert (len(again.known), again.taken, again.refused) == (sizes[-1], (), ())
    assert sizes == [12, 20, 5]
    for stage in STAGES:
        assert content(folder, stage) == content(replayed[1], stage)


def screened(tmp_path: Path) -> tuple[Any, StudyFolder, Cells]:
    """Return a study with its screening entered, and the sheet of that."""
    study, folder = load_study(paper_by_hand(tmp_path)), StudyFolder(tmp_path / "study")
    sheet = filled_in(awaited(study, folder))
    entered(study, folder, text_of(sheet))
    assert len(awaited(study, folder)) == 21
    return study, folder, sheet


def changed(sheet: Cells, run: str, value: str) -> str:
    """Return a sheet of one row with another value."""
    head, *rows = sheet
    row = next(row for row in rows if row[0] == run)
    return text_of([head, [*row[:-5], value, *row[-4:]]])


def test_another_value_needs_a_reason_and_makes_what_followed_stale(tmp_path: Path) -> None:
    study, folder, sheet = screened(tmp_path)
    before = folder.read_stage("screen")["design"]["runs"][2]["response"]
    refused = entered(study, folder, changed(sheet, "screen 3", "150")).refused
    assert [one.kind for one in refused] == ["known_otherwise"]
    assert changes_since(study, None, folder, "screen") == []
    found = entered(study, folder, changed(sheet, "screen 3", "150"), "wrong column")
    assert found.replaced == ("screen 3",)
    assert changes_since(study, None, folder, "screen") == ["results"]
    (line,) = [one for one in map(json.loads, (folder.path / "log.jsonl").open()) if one["event"] == "result_replaced"]
    assert (line["before"], line["now"], line["reason"]) == (f"{before:g}", "150", "wrong column")
    awaited(study, folder)
    assert folder.read_stage("screen")["design"]["runs"][2]["response"] == 150.0


def test_a_run_that_failed_counts_as_one(tmp_path: Path) -> None:
    """The screening goes on without it, as after a simulation that failed."""
    study, folder = load_study(paper_by_hand(tmp_path)), StudyFolder(tmp_path / "study")
    sheet = filled_in(awaited(study, folder))
    sheet[4][-5], sheet[4][-2] = "", "failed: the stem slipped"
    assert len(entered(study, folder, text_of(sheet)).taken) == 12
    with folder, pytest.raises(Waiting) as waiting:
        workflow.calibrate(study, folder, InlineExecutor())
    assert waiting.value.stage == "rsm" and waiting.value.exit_code == 6
    run = folder.read_stage("screen")["design"]["runs"][3]
    assert (run["status"], run["reason"], run["message"]) == ("failed", "not_run", "the stem slipped")
    sheet[4][-2] = ""
    assert entered(study, folder, changed(sheet, "screen 4", "180.3")).replaced == ("screen 4",)
