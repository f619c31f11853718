"""The verdict where people meet it: the last lines of `run`, the top of the page, `status`, a script."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, command
from fakes import SPEC, SpecSolver

import stemcal
from stemcal.solvers.protocol import Answer, Request
from stemcal.study.types.solver_kind import SOLVERS

pytestmark = pytest.mark.usefixtures("without_workers")
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"


class Doubted(SpecSolver):
    """The known force, from runs of which none is to be trusted."""

    def solve(self, request: Request) -> Answer:
        answer = super().solve(request)
        return Answer("ok", answer.response, details={"hourglass_ratio_percent": 40.0, "stroke_was_enough": True})


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "known.yaml"
    path.write_text(SPEC + TWO, encoding="utf-8")
    return path


def test_the_last_screen_holds_verdict_table_and_path(
    spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: SpecSolver())
    one = spec.read_text(encoding="utf-8").replace("[yield_stress, failure_strain]", "[yield_stress]")
    spec.write_text(one, encoding="utf-8")
    said = command("run", spec, "--out", tmp_path / "out", "-j", 1)
    assert said.exit_code == 0
    lines = said.stdout.splitlines()
    end = lines.index("Calibrated.")
    table = next(number for number, line in enumerate(lines) if line.startswith("Calibrated parameters"))
    assert (
        "(limit: 10 %) at diameters of 7, 8 and 10 mm." in " ".join(map(str.strip, lines[end + 1 : table]))
        and "95 % confidence interval" in lines[table + 1]
    )
    assert [line.split()[0] for line in lines[-7:-4]] == ["7", "8", "10"]
    assert lines[-1].startswith("Report: ") and lines[-1].endswith("report.html")
    assert len(lines) - end < 24 and max(map(len, lines[end:-1])) <= 80
    found = said.stdout.index("Effects on the maximum force"), said.stdout.index("Identifiability")
    assert found[0] < found[1] < said.stdout.index("Calibrated.")
    notes = [line for line in said.stderr.splitlines() if line.startswith("note: ")]
    assert len(notes) == 5 and "more notes in the report" in said.stderr
    told = json.loads(command("status", spec, "--out", tmp_path / "out", "--json").stdout)["result"]
    assert (told["verdict"], told["reasons"]) == ("calibrated", [])
    errors = [
        row["error_percent"] for row in json.loads((tmp_path / "out" / "validate.json").read_text("utf-8"))["rows"]
    ]
    largest = f"at most {max(map(abs, errors)):.1f} % (limit: 10 %) at diameters of 7, 8 and 10 mm. "
    assert told["use"].startswith(f"The error of the simulation is {largest}")
    assert "The parameters were fitted to data at a diameter of 8 mm. " in told["use"]
    assert stemcal.open_results(tmp_path / "out").verdict.verdict == "calibrated"


def test_no_interval_is_shown_where_nothing_is_calibrated(
    spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: Doubted())
    for stage in ("screen", "rsm", "invert"):
        alone = command(stage, spec, "--out", tmp_path / "out", "-j", 1)
        assert alone.exit_code == 0
    told = " ".join(alone.stderr.split())
    assert "confidence intervals and agreement with the measurements are not reported" in told
    assert "hourglass energy is up to 40 %" in told and "8 mm alone" not in told
    said = command("run", spec, "--out", tmp_path / "out", "-j", 1)
    ending = " ".join(said.stdout.split())
    assert re.search(
        r"Not calibrated\. (?:1\. )?The physical validity of (\d+) of \1 runs is doubtful: the hourglass energy",
        ending,
    )
    assert "Next: Use much smaller elements" in ending
    for claim in ("95 % confidence interval", "Identifiability", "95 % confidence interval"):
        assert claim not in said.stdout + alone.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    body = page[page.index("<main>") :]
    assert body.index("Not calibrated") < body.index("Outcome")
    for claim in (">95 % confidence interval<", "Identifiability", "Equal within", "The 95 % confidence interval"):
        assert claim not in body
    assert "confidence intervals and agreement with the measurements are not reported" in body


def test_a_single_stage_shows_the_intervals_of_a_study_that_is_only_not_finished(
    spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: SpecSolver())
    for stage in ("screen", "rsm", "invert"):
        said = command(stage, spec, "--out", tmp_path / "good", "-j", 1)
    assert "95 % confidence interval" in said.stdout and "Identifiability" in said.stdout
    assert "Not calibrated. Unfinished stages: Validation." in " ".join(said.stderr.split())


def test_a_target_out_of_reach_ends_with_advice(spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: SpecSolver())
    spec.write_text(spec.read_text("utf-8").replace("force: 110 N", "force: 200 N"), encoding="utf-8")
    said = command("run", spec, "--out", tmp_path / "out", "-j", 1)
    assert said.exit_code == 4
    ending = " ".join(said.stdout.split())
    assert "Not calibrated. The measured maximum force of 200 N" in ending and "`high` of yield_stress to" in ending
    told = json.loads(command("status", spec, "--out", tmp_path / "out", "--json").stdout)["result"]
    assert told["verdict"] == "not_calibrated"
    reason = told["reasons"][0]
    assert reason["kind"] == "out_of_reach" and reason["remedy"]["edit"].startswith(
        "factors: [{name: yield_stress, high: "
    )
    assert reason["text"].startswith("The measured maximum force of 200 N")


def test_forces_of_a_table_are_a_reservation(finished: tuple[Path, Any]) -> None:
    folder, said = finished
    ending = " ".join(said.stdout.split())
    assert "Calibrated, with reservations. " in ending
    told = json.loads(command("status", REPLAY, "--out", folder, "--json").stdout)["result"]
    assert {"not_identified", "validation_from_table"} <= {reason["kind"] for reason in told["reasons"]}
    assert "Calibrated, with reservations" in command("status", REPLAY, "--out", folder).stdout
