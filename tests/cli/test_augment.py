"""`stemcal augment` on a study of the embedded solver."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

from commanding import REPLAY, SMOKE, command


def test_runs_are_added_and_nothing_is_computed_twice(tmp_path: Path) -> None:
    spec, out = tmp_path / "mine.yaml", tmp_path / "out"
    text = SMOKE.read_text(encoding="utf-8").replace("d/10", "d/6").replace("d/5", "d/3")
    spec.write_text(text, encoding="utf-8")
    assert command("rsm", spec, "--out", out, "-q").exit_code in (0, 3)
    records = {path.name: path.read_bytes() for path in (out / "runs").glob("*.json")}
    told = command("augment", spec, "--extra-runs", 2, "--out", out, "--dry-run")
    assert "11 runs become 13, 2 of them to compute" in told.stderr
    assert spec.read_text(encoding="utf-8") == text
    result = command("augment", spec, "--extra-runs", 2, "--out", out, "--json", "-q")
    assert len(json.loads(result.stdout)["result"]["design"]["runs"]) == 13
    after = {path.name: path.read_bytes() for path in (out / "runs").glob("*.json")}
    assert len(after) == len(records) + 2 and all(after[name] == content for name, content in records.items())
    assert "  extra_runs: 2\n" in spec.read_text(encoding="utf-8")


def test_what_cannot_be_augmented_is_said(tmp_path: Path) -> None:
    result = command("augment", REPLAY, "--fold-over", "--out", tmp_path)
    assert result.exit_code == 2 and "a table answers only what it holds" in result.stderr
    result = command("augment", SMOKE, "--axial", 1, "--out", tmp_path / "none")
    assert result.exit_code == 2 and "is not there" in result.stderr


def test_a_climb_before_the_surface_is_brought_up_to_date(tmp_path: Path) -> None:
    """The climb reads the section that the added runs are written into; its own runs are there."""
    shutil.copytree(Path(__file__).parents[1] / "cases" / "repose", tmp_path, dirs_exist_ok=True)
    spec = tmp_path / "angle.yaml"
    text = spec.read_text("utf-8").replace("[python,", f"[{json.dumps(sys.executable)},")
    text = text.replace("rsm: {", "climb: {steps: 3}\nrsm: {")
    spec.write_text(text, "utf-8")
    out = tmp_path / "out"
    for stage in ("screen", "climb", "rsm"):
        assert command(stage, spec, "--out", out, "-q").exit_code in (0, 3)
    steps = json.loads((out / "climb.json").read_text("utf-8"))["rows"]
    result = command("augment", spec, "--extra-runs", 2, "--out", out, "-q")
    assert result.exit_code in (0, 3), result.stderr
    assert json.loads((out / "climb.json").read_text("utf-8"))["rows"] == steps
    assert len(json.loads((out / "rsm.json").read_text("utf-8"))["design"]["runs"]) == 16
