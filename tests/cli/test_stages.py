"""The commands of a study, on the replay of the printed tables."""

import json
from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, SMOKE, STAGES, command, process

from stemcal.cli.session import study_or_exit
from stemcal.stages.rsm.options import WITHOUT_SURFACE
from stemcal.stages.stage import stages_of


def test_run_leaves_every_file_and_shows_the_result(finished: tuple[Path, Any]) -> None:
    folder, result = finished
    assert result.exit_code == 0
    for name in (*STAGES, "report"):
        suffix = "html" if name == "report" else "json"
        assert (folder / f"{name}.{suffix}").is_file()
    assert "18.37" in result.stdout
    assert "≤ 15.35 to ≥ 19.96" in result.stdout
    assert "Largest held-out error: 7.83 %" in " ".join(result.stdout.split())
    assert "Screening: 12/12 runs" in result.stderr
    assert "12/12" not in result.stdout


def test_stages_one_by_one_print_their_file_as_json(tmp_path: Path) -> None:
    for name in STAGES:
        result = command(name, REPLAY, "--out", tmp_path, "--json")
        assert result.exit_code == 0
        assert (
            json.loads(result.stdout)["result"].items()
            < json.loads((tmp_path / f"{name}.json").read_text("utf-8")).items()
        )


def test_json_is_pure_in_a_process(finished: tuple[Path, Any], tmp_path: Path) -> None:
    ascii_only = {"PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}
    done = process(tmp_path, "validate", REPLAY, "--out", finished[0], "--json", **ascii_only)
    assert done.returncode == 0 and json.loads(done.stdout)["command"] == "validate"
    assert json.loads(done.stdout)["result"]["worst_percent"] == pytest.approx(7.83, abs=0.01)


def test_quiet_says_nothing_on_stderr(tmp_path: Path) -> None:
    result = command("screen", REPLAY, "--out", tmp_path, "--quiet")
    assert result.stderr == ""
    assert "X4" in result.stdout


def test_default_folder_is_named_after_the_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert command("screen", REPLAY, "-q").exit_code == 0
    assert (tmp_path / "runs" / "paper-replay" / "screen.json").is_file()


def test_report_needs_a_folder_and_a_stage(tmp_path: Path) -> None:
    missing = command("report", REPLAY, "--out", tmp_path / "none")
    assert missing.exit_code == 2
    assert not (tmp_path / "none").exists()
    assert command("report", REPLAY, "--out", tmp_path).exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_report_of_an_unfinished_study(tmp_path: Path) -> None:
    command("screen", REPLAY, "--out", tmp_path)
    result = command("report", REPLAY, "--out", tmp_path, "--json")
    page = Path(json.loads(result.stdout)["result"]["page"])
    assert result.exit_code == 0
    assert "Unfinished stages: Response surface, Calibration, Validation." in page.read_text("utf-8")


def test_failed_runs_end_with_three(tmp_path: Path, monkeypatch: Any) -> None:
    from stemcal.stages.validate import analysis
    from stemcal.stages.validate.result import ValidateResult

    result = ValidateResult.from_json(
        {
            "schema_version": 3,
            "stage": "validate",
            "study": "known",
            "parameters": {},
            "rows": [
                {"condition": 7.0, "measured": 120.0, "simulated": None, "error_percent": None, "role": "held_out",
                 "response": None, "status": "failed", "reason": "inverted", "message": "element 7 at 0.1 s"},
                {"condition": 8.0, "measured": 159.2, "simulated": 160.0, "error_percent": -0.5,
                 "role": "fitted", "response": 160.0, "status": "ok", "reason": "", "message": ""},
            ],
            "worst_percent": 0.5,
            "mean_abs_error_percent": 0.5,
        }
    )  # fmt: skip
    monkeypatch.setattr(analysis, "validate", lambda *_: result)
    done = command("validate", REPLAY, "--out", tmp_path)
    assert done.exit_code == 3
    assert "validate: 1 of 2 runs failed: inverted (1)" in done.stderr
    assert "inverted" in done.stdout


def test_check_counts_and_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = command("check", REPLAY, "--json")
    found = json.loads(done.stdout)["result"]["plan"]
    assert [(stage["stage"], stage["rows"]) for stage in found["stages"]] == [
        ("screen", 12),
        ("rsm", 20),
        ("validate", 5),
    ]
    assert list(tmp_path.iterdir()) == []
    shown = [line.split() for line in command("check", REPLAY).stdout.splitlines()]
    assert ["rsm", "20", "20", "0"] in shown and ["validate", "5", "5", "0"] in shown  # the sheet has them all


def test_init_writes_a_right_spec_and_never_overwrites(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first = command("init", "maize-2026")
    path = tmp_path / "maize-2026.yaml"
    assert (first.exit_code, first.stdout) == (0, "maize-2026.yaml\n")
    assert command("check", path).exit_code == 0
    text = path.read_bytes()
    again = command("init", "maize-2026.yaml")
    assert again.exit_code == 2
    assert "already exists" in again.stderr
    assert path.read_bytes() == text
    assert command("init", "new/folder/rape").exit_code == 0
    assert command("check", "new/folder/rape.yaml").exit_code == 0
    assert command("init", "con").exit_code == 2


def test_changes_are_read_with_the_spec() -> None:
    whole, quick = study_or_exit(SMOKE), study_or_exit(SMOKE, WITHOUT_SURFACE)
    assert "rsm" in [stage.name for stage in stages_of(whole)]
    assert [stage.name for stage in stages_of(quick)] == ["refine", "validate"]
