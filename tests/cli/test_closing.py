"""The commands around the solution: climb, refine."""

import json
from pathlib import Path

import pytest
from commanding import REPLAY, SMOKE, command


@pytest.mark.slow
def test_a_sheet_is_asked_for_the_rows_of_refine_and_climb(tmp_path: Path) -> None:
    command("run", REPLAY, "--out", tmp_path, "--quiet")
    for name in ("refine", "climb"):
        result = command(name, REPLAY, "--out", tmp_path)
        assert result.exit_code == 6, result.stderr


@pytest.mark.slow
def test_a_study_that_climbs_and_refines(tmp_path: Path) -> None:
    """The coarse study from beginning to end: the simulated force ends within the tolerance."""
    spec = tmp_path / "smoke.yaml"
    spec.write_text(SMOKE.read_text("utf-8") + "climb: {}\nrefine: {tolerance_percent: 0.5}\n", encoding="utf-8")
    result = command("run", spec, "--out", tmp_path / "out")
    assert result.exit_code == 0
    refined = json.loads((tmp_path / "out" / "refine.json").read_text("utf-8"))
    assert refined["converged"] and abs(refined["error_percent"]) <= 0.5
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "Refinement" in page and "Climb" in page and "Refinement runs" in page


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wild-chrysanthemum-as-published.yaml"])
def test_the_published_study_ends_within_one_per_cent(tmp_path: Path, name: str) -> None:
    """The simulated force at 8 mm is within 1 % of the measured 159.2 N."""
    result = command("run", SMOKE.parent / name, "--out", tmp_path, "--json", "--quiet")
    rows = {row["condition"]: row for row in json.loads(result.stdout)["result"]["validate"]["rows"]}
    assert abs(rows[8.0]["error_percent"]) <= 1.0
