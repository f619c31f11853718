"""Runs asked for and told: by commands and in Python; the files that a study done by hand leaves."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from sheets import awaited, cells_of, entered, text_of
from typer.testing import CliRunner, Result

import stemcal
from stemcal.cli.app import app
from stemcal.errors import UsageError, Waiting
from stemcal.runs.study_folder import StudyFolder

pytestmark = pytest.mark.usefixtures("blank_figures")
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


def command(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def filled(out: Path, value: str = "") -> None:
    """Write angles into the empty cells of the sheet in a study folder."""
    head, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
    for row in rows:
        row[4] = row[4] or value or f"{angle(dict(zip(head[1:4], map(float, row[1:4]), strict=True))):.6f}"
    (out / "sheet.csv").write_text(text_of([head, *rows]), encoding="utf-8")


def test_run_continues_as_far_as_the_sheet_allows(tmp_path: Path) -> None:
    """15 runs of the surface, one of the refinement and one of the validation: rows of one sheet."""
    spec, out = spec_of(tmp_path), tmp_path / "study"
    planned = command("check", spec, "--out", out).stdout
    assert "runs must be done by hand, 16 in total" in planned and "unknown" not in planned
    done = command("run", spec, "--out", out)
    assert done.exit_code == 6
    assert f"Waiting for 15 results from the rsm stage. Fill in {out / 'sheet.csv'}. Then run `stemcal" in done.stderr
    head, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
    assert head == ["run", "sliding", "rolling", "wall", "angle (deg)", "who", "when", "remark", "study"]
    assert sorted(row[0] for row in rows) == sorted(f"rsm {number}" for number in range(1, 16))
    assert json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]["sheet"] == str(
        out / "sheet.csv"
    )
    assert "Fill in" in command("status", spec, "--out", out).stdout
    for count in (15, 16):
        filled(out)
        assert command("run", spec, "--out", out).exit_code == 6
        _, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
        assert len(rows) == count + 1 and [row[0] for row in rows if not row[4]] == [rows[-1][0]]
    filled(out)
    assert command("run", spec, "--out", out).exit_code == 0
    assert "sheet" not in json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]
    solution = json.loads((out / "refine.json").read_text("utf-8"))["parameters"]
    assert angle(solution) == pytest.approx(28.2, rel=0.001)


def test_a_wrong_row_of_the_own_sheet_stops_the_run_and_stays(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "study"
    command("run", spec, "--out", out)
    filled(out)
    text = (out / "sheet.csv").read_text("utf-8").replace(",,,heap", ",,\n", 1)
    (out / "sheet.csv").write_text(text, encoding="utf-8")
    done = command("run", spec, "--out", out)
    assert done.exit_code == 2 and "sheet.csv:2: the row has only 8 cells, but the header row has 9" in done.stderr
    assert (out / "sheet.csv").read_text("utf-8") == text
    assert len(list(StudyFolder(out).keys())) == 14


def test_a_correction_from_another_sheet_is_in_the_own_one(tmp_path: Path) -> None:
    """What the own sheet has beside the value that is replaced is entered first."""
    spec, out = spec_of(tmp_path), tmp_path / "study"
    command("run", spec, "--out", out)
    head, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
    for row in rows:
        row[4] = f"{angle(dict(zip(head[1:4], map(float, row[1:4]), strict=True))):.6f}"
    (out / "sheet.csv").write_text(text_of([head, *rows[:9]]), encoding="utf-8")
    assert command("run", spec, "--out", out).exit_code == 6
    (out / "sheet.csv").write_text(text_of([head, *rows[:12]]), encoding="utf-8")
    other = [*rows[0][:4], "30.5", *rows[0][5:]]
    (tmp_path / "other.csv").write_text(text_of([head, other]), encoding="utf-8")
    done = command("enter", spec, tmp_path / "other.csv", "--out", out, "--replace", "misread")
    assert done.exit_code == 6 and f"Results replaced: 1 ({rows[0][0]})." in done.stdout
    assert "3 results from the rsm stage" in done.stderr
    assert [row[4] for row in cells_of((out / "sheet.csv").read_text("utf-8")) if row[0] == rows[0][0]] == ["30.5"]


def test_a_run_that_failed_may_be_tried_again(tmp_path: Path) -> None:
    """Retry asks for it once more; the value then takes the failure's place."""
    spec, out = spec_of(tmp_path), tmp_path / "study"
    study = stemcal.load_study(spec)
    runs = study.ask(out)
    study.tell([{**run, "angle": angle(run)} for run in runs[1:]] + [{**runs[0], "failed": "the heap slid"}], out)
    assert [run["run"].split()[0] for run in study.ask(out)] == ["refine"]
    assert command("run", spec, "--retry", "--out", out).exit_code == 6
    _, *rows = cells_of((out / "sheet.csv").read_text("utf-8"))
    assert [row[0] for row in rows if not row[4]] == [runs[0]["run"]]
    filled(out)
    done = command("enter", spec, out / "sheet.csv", "--out", out)
    assert re.findall(r"\d+", done.stdout)[:3] == ["0", "14", "1"] and runs[0]["run"] in done.stdout
    assert (done.exit_code, study.ask(out)[0]["run"].split()[0]) == (6, "refine")


def test_python_asks_and_tells(tmp_path: Path) -> None:
    study, out, rounds = stemcal.load_study(spec_of(tmp_path)), tmp_path / "study", []
    with pytest.raises(Waiting, match="waiting for 15 results from the rsm stage"):
        stemcal.calibrate(study, out=out, workers=1)
    while runs := study.ask(out):
        told = [{"run": run["run"], "angle": angle(run)} for run in runs]
        rounds.append(study.tell(told, out))
    assert rounds == [15, 1, 1]
    results = stemcal.calibrate(study, out=out, workers=1)
    assert angle(results.parameters) == pytest.approx(28.2, rel=0.001)
    run = {"run": "rsm 1", "angle": 25.0}
    with pytest.raises(UsageError, match=r"rsm 1 already has the result .*, but the new result is 25"):
        study.tell([run], out)
    assert study.tell([run], out, replace="misread") == 1


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"run": "rsm 1", "angel": 3}, "no column 'angel'; did you mean angle?"),
        ({"run": "rsm 1", "angle": float("nan")}, "'nan' is not a number"),
        ({"run": "rsm 1", "wall": 0.7, "angle": 3}, "was requested at wall = 0.5"),
        ({"run": "rsm 1", "angle": 3, "failed": "too wet"}, "has a value but is marked as failed"),
        ({"run": "rsm 1", "failed": True}, "is marked as failed without a reason"),
        ({"run": "rsm 1", "failed": ""}, "is marked as failed without a reason"),
        ({"run": "rsm 1", "angle": 3, "failed": ""}, "has a value but is marked as failed"),
        ({"angle": 3}, "has no name"),
        ("rsm 1", "has no name"),
    ],
)
def test_what_a_program_tells_is_checked(told: Any, said: str, tmp_path: Path) -> None:
    study = stemcal.load_study(spec_of(tmp_path))
    with pytest.raises(UsageError) as caught:
        study.tell([told], tmp_path / "study")
    assert said in str(caught.value)
    assert list(StudyFolder(tmp_path / "study").keys()) == []


def test_commands_refuse_what_has_no_sense(tmp_path: Path) -> None:
    spec, out = spec_of(tmp_path), tmp_path / "study"
    smoke = Path(__file__).parents[2] / "configs" / "smoke.yaml"
    (tmp_path / "sheet.csv").write_text("run,angle\nrsm 1,3\n", encoding="utf-8")
    for words, said in (
        (("enter", spec, tmp_path / "none.csv"), "specify the path of the run sheet"),
        (("enter", spec, spec), "no row contains the `run` heading"),
        (("enter", spec, tmp_path / "sheet.csv"), "no column has the heading sliding, rolling or wall"),
    ):
        done = command(*words, "--out", out)
        assert done.exit_code == 2 and said in done.stderr, done.stderr
    with pytest.raises(UsageError, match=r"write `solver: \{kind: sheet\}`"):
        stemcal.load_study(smoke).ask(out)


def test_replicates_are_rows_of_their_own(tmp_path: Path) -> None:
    study = stemcal.load_study(spec_of(tmp_path, replicates="replicates: 2"))
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


def test_equal_runs_are_entered_by_the_name_on_the_sheet(tmp_path: Path) -> None:
    """Of three equal runs in the middle of the design the sheet has the first one."""
    study, folder = stemcal.load_study(spec_of(tmp_path, replicates="")), StudyFolder(tmp_path / "study")
    head, *rows = awaited(study, folder)
    for row in rows:
        row[4] = str(angle(dict(zip(head[1:4], map(float, row[1:4]), strict=True))))
    assert len(entered(study, folder, text_of([head, *rows])).taken) == 13


def test_order_is_drawn_by_chance_where_there_is_chance(tmp_path: Path) -> None:
    def order(name: str, line: str) -> list[str]:
        (tmp_path / name).mkdir()
        study = stemcal.load_study(spec_of(tmp_path / name, replicates=line))
        return [row[0] for row in awaited(study, StudyFolder(tmp_path / name / "study"))[1:]]

    by_chance = order("a", "replicates: 1")
    assert by_chance == order("b", "replicates: 1") != sorted(by_chance, key=lambda run: int(run.split()[1]))
    assert order("d", "") == [f"rsm {number}" for number in range(1, 14)]  # one run in the middle
    assert sorted(by_chance, key=lambda run: int(run.split()[1])) == [f"rsm {number}" for number in range(1, 16)]


def test_templates_are_filled_in_for_every_run(tmp_path: Path) -> None:
    (tmp_path / "heap.in").write_text("friction {{sliding}} {{rolling}}\n", encoding="utf-8")
    spec = spec_of(tmp_path, replicates="replicates: 1\n  templates: [heap.in]")
    assert command("run", spec, "--out", tmp_path / "study").exit_code == 6
    inputs = tmp_path / "study" / "inputs"
    assert len(list(inputs.iterdir())) == 15
    assert (inputs / "rsm-2" / "heap.in").read_text("utf-8") == "friction 0.2 0.2\n"
