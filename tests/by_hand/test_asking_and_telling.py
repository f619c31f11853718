"""Runs asked for and told: by commands, by JSON, in Python; what a study done by hand leaves for those who do it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import openpyxl
import pytest
from sheets import awaited, cells_of, entered, text_of
from typer.testing import CliRunner, Result

import stemcal
from stemcal.by_hand.awaited import gone_on, sheet_rows
from stemcal.by_hand.handing_out import hand_out
from stemcal.cli.app import app
from stemcal.errors import UsageError, Waiting
from stemcal.folder.study_folder import StudyFolder

HEAP = (Path(__file__).parents[2] / "examples" / "by-hand" / "heap.yaml").read_text("utf-8")


def spec_of(folder: Path, **changes: str) -> Path:
    """Write the example's spec with lines of its solver replaced."""
    text = HEAP
    for old, new in changes.items():
        assert f"  {old}: " in text
        text = "\n".join(f"  {new}" if line.startswith(f"  {old}: ") else line for line in text.splitlines())
    (folder / "heap.yaml").write_text(text, encoding="utf-8")
    return folder / "heap.yaml"


def angle(levels: dict[str, float]) -> float:
    """Return the angle of a heap that nobody has made, deg."""
    return 18.3 + 16.0 * levels["sliding"] + 38.0 * levels["rolling"] + 1.5 * levels["wall"]


def command(*words: object, typed: str | None = None) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], input=typed)


def test_a_study_that_waits_ends_with_six_and_leaves_its_sheet(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "study"
    planned = command("check", spec, "--out", out).stdout
    assert "runs by hand, 16 in all" in planned and "unknown" not in planned
    done = command("run", spec, "--out", out)
    assert done.exit_code == 6
    assert f"Waiting for 15 results of rsm; fill in {out / 'sheet.xlsx'}, then: stemcal enter" in done.stderr
    head, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
    assert head == ["run", "sliding", "rolling", "wall", "angle (deg)", "who", "when", "remark", "study"]
    assert sorted(row[0] for row in rows) == sorted(f"rsm {number}" for number in range(1, 16))
    sheet = openpyxl.load_workbook(out / "sheet.xlsx").worksheets[0]
    assert [[str(c.value or "") for c in row] for row in sheet.iter_rows()] == [head, *rows]
    assert sheet.protection.sheet and sheet["A1"].protection.locked and sheet["B2"].protection.locked
    assert not sheet["E2"].protection.locked
    assert command("rsm", spec, "--out", out).exit_code == 6
    assert json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]["sheet"] == str(
        out / "sheet.csv"
    )
    assert "Results are awaited: fill in" in command("status", spec, "--out", out).stdout


def test_a_run_that_failed_may_be_tried_again(tmp_path: Path) -> None:
    """Retry asks for it once more; the value then takes the failure's place, and both are in the record."""
    spec, out = spec_of(tmp_path), tmp_path / "study"
    runs = json.loads(command("ask", spec, "--out", out, "--json").stdout)["result"]["runs"]
    told = [{**run, "responses": {"angle": angle(run["levels"])}} for run in runs]
    told[3] = {**runs[3], "failed": "the heap slid"}
    assert command("tell", spec, "-", "--out", out, typed=json.dumps(told)).exit_code == 0
    assert json.loads(command("ask", spec, "--out", out, "--json").stdout)["result"]["waiting_for"] == "refine"
    assert command("run", spec, "--retry", "--out", out).exit_code == 6
    assert [row[0] for row in cells_of((out / "sheet.csv").read_text("utf-8"))[1:]] == [runs[3]["run"]]
    told[3] = {**runs[3], "responses": {"angle": angle(runs[3]["levels"])}}
    done = command("tell", spec, "-", "--out", out, "--json", typed=json.dumps(told))
    assert [len(json.loads(done.stdout)["result"][key]) for key in ("taken", "known", "replaced")] == [0, 14, 1]
    assert json.loads((out / "rsm.json").read_text("utf-8"))["design"]["runs"] != []
    assert command("status", spec, "--out", out, "--json").stdout.count('"stale"') >= 1


def test_a_program_asks_and_tells_until_nothing_is_awaited(tmp_path: Path) -> None:
    spec, out, rounds = spec_of(tmp_path), tmp_path / "study", []
    while runs := json.loads(command("ask", spec, "--out", out, "--json").stdout)["result"]["runs"]:
        rounds.append(len(runs))
        told = [{**run, "responses": {"angle": angle(run["levels"])}, "who": "a script"} for run in runs]
        done = command("tell", spec, "-", "--out", out, "--json", typed=json.dumps({"runs": told}))
        assert done.exit_code == 0 and len(json.loads(done.stdout)["result"]["taken"]) == len(runs)
    assert rounds == [15, 1, 1]
    assert command("ask", spec, "--out", out).stdout.startswith("No result is awaited")
    solution = json.loads((out / "refine.json").read_text("utf-8"))["parameters"]
    assert angle(solution) == pytest.approx(28.2, rel=0.001)


def test_python_asks_and_tells(tmp_path: Path) -> None:
    study, out = stemcal.load_study(spec_of(tmp_path)), tmp_path / "study"
    with pytest.raises(Waiting, match="waiting for 15 results of rsm"):
        stemcal.calibrate(study, out=out, workers=1)
    while runs := study.ask(out):
        told = [{"run": run["run"], "responses": {"angle": angle(run["levels"])}} for run in runs]
        assert study.tell(told, out) == len(runs)
    results = stemcal.calibrate(study, out=out, workers=1)
    assert angle(results.parameters) == pytest.approx(28.2, rel=0.001)
    run = {"run": "rsm 1", "responses": {"angle": 25.0}}
    with pytest.raises(UsageError, match=r"rsm 1 has the result .* already"):
        study.tell([run], out)
    assert study.tell([run], out, replace="misread", who="Li") == 1


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"run": "rsm 1", "responses": {"angel": 3}}, "no response 'angel'; did you mean angle?"),
        ({"run": "rsm 1", "responses": {"angle": float("nan")}}, "'nan' is not a number"),
        ({"run": "rsm 1", "levels": {"wall": 0.7}, "responses": {"angle": 3}}, "was asked for at wall = 0.5"),
        ({"run": "rsm 1", "replicate": 2, "responses": {"angle": 3}}, "has no replicate '2'"),
        ({"responses": {"angle": 3}}, "has no name"),
        ("rsm 1", "has no name"),
    ],
)
def test_what_a_program_tells_is_checked(told: Any, said: str, tmp_path: Path) -> None:
    study = stemcal.load_study(spec_of(tmp_path))
    with pytest.raises(UsageError) as caught:
        study.tell([told], tmp_path / "study")
    assert said in str(caught.value)


def test_commands_refuse_what_has_no_sense(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "study"
    for words, said in (
        (("enter", spec, tmp_path / "none.csv"), "name the sheet"),
        (("enter", spec, spec, "--replace"), "--replace needs a reason"),
        (("enter", spec, spec), "no line has the heading `run`"),
        (("ask", Path("configs/paper-replay.yaml")), "solver.kind is table, whose runs nobody enters"),
    ):
        done = command(*words, "--out", out)
        assert done.exit_code == 2 and said in done.stderr


def test_refused_rows_end_the_command_and_the_others_are_kept(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "study"
    printed = command("ask", spec, "--out", out, "--quiet").stdout
    head, *rows = cells_of(printed)
    for row in rows:
        row[4] = f"{angle(dict(zip(head[1:4], map(float, row[1:4]), strict=True))):.1f}"
    rows[2][4] = "steep"
    sheet = tmp_path / "mine.csv"
    sheet.write_text(text_of([head, *rows]), encoding="utf-8")
    done = command("enter", spec, sheet, "--out", out)
    assert done.exit_code == 2
    assert f"mine.csv:4: {rows[2][0]}, angle: 'steep' is not a number" in done.stderr
    assert len(cells_of(command("ask", spec, "--out", out, "--quiet").stdout)) == 2


def test_a_sheet_that_is_being_filled_in_is_left_alone(tmp_path: Path) -> None:
    """Another one is put aside, with what is written in it."""
    study, folder = stemcal.load_study(spec_of(tmp_path)), StudyFolder(tmp_path / "study")
    with folder:
        waiting = gone_on(study, folder)
        assert waiting is not None
        rows = sheet_rows(study, folder, waiting)
        hand_out(study, folder, rows)
        sheet = folder.path / "sheet.csv"
        half = sheet.read_text("utf-8").replace(",,,,", ",28.2,Li,,", 3)
        sheet.write_text(half, encoding="utf-8")
        hand_out(study, folder, rows)
        assert sheet.read_text("utf-8") == half
        hand_out(study, folder, rows[1:])
    assert [path.read_text("utf-8") for path in (folder.path / "sheets").glob("*.csv")] == [half]
    assert len(cells_of(sheet.read_text("utf-8"))) == 15


def test_replicates_are_rows_of_their_own(tmp_path: Path) -> None:
    study = stemcal.load_study(spec_of(tmp_path, deterministic="replicates: 2"))
    folder = StudyFolder(tmp_path / "study")
    sizes = []
    while sheet := awaited(study, folder):
        head, *rows = sheet
        assert head[4:6] == ["replicate", "angle (deg)"]
        for row in rows:
            level = angle(dict(zip(head[1:4], map(float, row[1:4]), strict=True)))
            row[5] = str(level + float(row[4]) / 10)
        sizes.append(len(rows))
        assert len(entered(study, folder, text_of([head, *rows])).taken) == len(rows)
    assert sizes == [30, 2, 2]
    runs = folder.read_stage("rsm")["design"]["runs"]
    assert [round(run["response"] - angle(run["levels"]), 6) for run in runs] == [0.1] * 15 + [0.2] * 15
    assert len(folder.read_stage("validate")["rows"][0]["replicates"]["values"]) == 2


def test_order_is_drawn_by_chance_where_there_is_chance(tmp_path: Path) -> None:
    def order(name: str, line: str) -> list[str]:
        (tmp_path / name).mkdir()
        study = stemcal.load_study(spec_of(tmp_path / name, deterministic=line))
        return [row[0] for row in awaited(study, StudyFolder(tmp_path / name / "study"))[1:]]

    by_chance = order("a", "deterministic: false")
    assert by_chance == order("b", "deterministic: false") != order("c", "deterministic: false\n  seed: 1")
    assert order("d", "deterministic: true") == [f"rsm {number}" for number in range(1, 14)]  # one run in the middle
    assert sorted(by_chance, key=lambda run: int(run.split()[1])) == [f"rsm {number}" for number in range(1, 16)]


def test_templates_are_filled_in_for_every_run(tmp_path: Path) -> None:
    (tmp_path / "heap.in").write_text("friction {{sliding}} {{rolling}}\n", encoding="utf-8")
    spec = spec_of(tmp_path, deterministic="templates: [heap.in]")
    assert command("run", spec, "--out", tmp_path / "study").exit_code == 6
    inputs = tmp_path / "study" / "inputs"
    assert len(list(inputs.iterdir())) == 15
    assert (inputs / "rsm-2" / "heap.in").read_text("utf-8") == "friction 0.2 0.2\n"
