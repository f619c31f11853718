"""What scripts rely on: the envelope, the exit codes, what `init` writes, warnings of units."""

import json
import os
import shutil
import sys
from pathlib import Path

import pytest
from commanding import BAD_SPEC, COMMANDS, REPLAY, ROOT, command
from typer.main import get_command

from stemcal.cli.app import app
from stemcal.cli.exit_codes import EXIT_CODES


def test_every_json_is_one_envelope(tmp_path: Path) -> None:
    for arguments in (("check", REPLAY), ("doctor",), ("explain", "PRESS"), ("check", BAD_SPEC), ("status", REPLAY)):
        done = command(*arguments, *(("--out", tmp_path / "none") if arguments[0] == "status" else ()), "--json")
        found = json.loads(done.stdout)
        assert list(found) == ["command", "status", "result", "notes"]
        assert (found["command"], found["status"]) == (arguments[0], EXIT_CODES[done.exit_code][0])
        assert all(set(note) == {"kind", "severity", "text", "remedy"} for note in found["notes"])
        assert any(note["severity"] == "error" for note in found["notes"]) == (done.exit_code != 0)


def test_the_commands_are_these_18() -> None:
    root = get_command(app)
    assert sorted(root.commands) == sorted(COMMANDS) and len(COMMANDS) == 18
    assert sorted(root.commands["export"].commands) == ["deck", "figures", "material", "tables"]
    assert sorted(root.commands["measure"].commands) == ["diameters", "shear", "tests"]


def test_the_docs_have_the_table_of_exit_codes() -> None:
    page = (ROOT / "docs" / "reference" / "files.md").read_text("utf-8")
    for code, (status, meaning) in EXIT_CODES.items():
        if code < 100:
            assert f"| {code} | `{status}` | {meaning} |" in page
        else:
            assert f"`{status}`" in page and meaning in page


def test_init_writes_40_lines_and_with_full_the_rest(tmp_path: Path) -> None:
    assert command("init", tmp_path / "short").exit_code == command("init", tmp_path / "long", "--full").exit_code == 0
    short, long = ((tmp_path / f"{name}.yaml").read_text("utf-8").splitlines() for name in ("short", "long"))
    assert len([line for line in short if line]) <= 40 < len(long)
    assert max(map(len, long)) <= 120
    for name in ("short", "long"):
        assert command("check", tmp_path / f"{name}.yaml").exit_code == 0


def test_units_wrong_by_a_thousand_are_warned_of_after_ok(tmp_path: Path) -> None:
    """GPa written as MPa."""
    assert command("init", tmp_path / "mine").exit_code == 0
    spec = tmp_path / "mine.yaml"
    spec.write_text(spec.read_text("utf-8").replace("low: 10, high: 20", "low: 0.01, high: 0.02"), encoding="utf-8")
    done = command("check", spec)
    assert done.exit_code == 0 and f"{spec}: OK, 2 warnings. " in done.stdout
    assert done.stderr.count("check the unit") == 2


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")
def test_a_name_that_is_not_utf_8_does_not_end_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = os.fsdecode(b"\xff.yaml")
    shutil.copytree(ROOT / "configs" / "data", tmp_path / "data")
    shutil.copy(REPLAY, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    done = command("run", name, "--until", "screen", "--out", "out")
    assert done.exit_code == 0, done.stderr
    assert (tmp_path / "out" / "report.html").is_file()
