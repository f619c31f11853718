"""`status` with `--runs`, `--failed`, `--verify`, and `run --retry`: a study with known answers and known failures."""

import json
import shutil
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from commanding import REPLAY, command
from fakes import SPEC, SpecSolver, force, lines

from stemcal.cli.status import _failures
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.ledger import LedgerRow
from stemcal.storage.sealed import sealed
from stemcal.study.types.solver_kind import SOLVERS
from stemcal.version import code_version
from stemcal.vocabulary import Wording

pytestmark = pytest.mark.usefixtures("without_workers")
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"


class Known:
    """A spec, its folder, and what its solver does."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.spec, self.out, self.witness = folder / "known.yaml", folder / "out", folder / "witness"
        self.monkeypatch, self.versions = monkeypatch, count()
        self.write("")

    def write(self, extra: str) -> None:
        self.spec.write_text(SPEC + TWO + extra, encoding="utf-8")

    def solver(self, **facts: Any) -> None:
        solver, code = SpecSolver(self.witness, **facts), f"{code_version()}-{next(self.versions)}"
        # a solver that changes without the code is a test's alone
        self.monkeypatch.setattr("stemcal.stages.fresh.code_version", lambda: code)
        self.monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda _study: solver)

    def __call__(self, name: str, *args: object) -> Any:
        return command(name, self.spec, *args, "--out", self.out)

    def json(self, name: str, *args: object) -> Any:
        return json.loads(self(name, *args, "--json").stdout)["result"]


@pytest.fixture
def known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Known:
    found = Known(tmp_path, monkeypatch)
    found.solver()
    return found


@pytest.fixture
def failed(known: Known) -> Known:
    """A screening of which run 3 turned inside out."""
    known.solver(trouble={2: "failed"})
    assert known("screen", "-j", 1).exit_code == 3
    return known


def climbed(known: Known) -> int:
    return sum(run["stage"] == "climb" for run in known.json("status", "--runs")["runs"])


def stage(found: dict[str, Any], name: str) -> dict[str, Any]:
    return next(stage for stage in found["stages"] if stage["stage"] == name)


# ---- status


def test_status_counts_every_row(failed: Known) -> None:
    found = failed.json("status")
    assert found["working"] is None
    screen, rsm, validate = (stage(found, name) for name in ("screen", "rsm", "validate"))
    assert {name: screen[name] for name in ("rows", "done", "failed", "left", "file")} == {
        "rows": 12, "done": 11, "failed": 1, "left": 0, "file": "fresh",
    }  # fmt: skip
    assert screen["reasons"] == {"inverted": 1}
    assert (rsm["rows"], rsm["left"], rsm["file"]) == (11, 11, "none")
    assert (validate["rows"], validate["left"]) == (None, None)  # the solution is not known yet
    shown = failed("status")
    assert shown.exit_code == 0
    assert "screen: some runs failed: inverted (1)" in shown.stdout


def test_status_of_a_study_at_work(known: Known) -> None:
    """Another process (here: another folder object) holds the lock."""
    with StudyFolder(known.out) as held:
        assert known.json("status")["working"] == held.holder()
        assert str(held.holder())[1:] in " ".join(known("status").stdout.split())
    assert known.json("status")["working"] is None


def test_a_stage_is_stale_with_the_one_before_it(replayed: Path, tmp_path: Path) -> None:
    """The surface reads the section that has changed; inversion and validation rest on it."""
    shutil.copytree(REPLAY.parent, tmp_path / "configs")
    spec, out = tmp_path / "configs" / REPLAY.name, replayed
    before = json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]["stages"]
    assert {part["file"] for part in before} == {"fresh"}
    text = spec.read_text("utf-8")
    spec.write_text(text.replace("\nrsm:\n", "\nrsm:\n  reduce: backward\n"), "utf-8")
    found = {
        part["stage"]: part
        for part in json.loads(command("status", spec, "--out", out, "--json").stdout)["result"]["stages"]
    }
    assert found["screen"]["file"] == "fresh" and found["rsm"]["changed"] == ["rsm"]
    assert (found["invert"]["file"], found["invert"]["changed"]) == ("stale", ["rsm.json"])
    assert (found["validate"]["file"], found["validate"]["changed"]) == ("stale", ["invert.json"])
    text = spec.read_text("utf-8")
    spec.write_text(text.replace("rule: least_coded_distance", "rule: others_at_centre"), "utf-8")
    both = stage(json.loads(command("status", spec, "--out", out, "--json").stdout)["result"], "invert")
    assert (both["file"], both["changed"]) == ("stale", ["invert"])  # its own change is named first


def test_status_says_what_made_a_stage_stale(failed: Known) -> None:
    failed.solver(version=2)
    found = stage(failed.json("status"), "screen")
    assert (found["file"], found["changed"], found["left"]) == ("stale", ["stemcal"], 12)
    assert "screen.json is out of date: stemcal changed" in " ".join(failed("status").stdout.split())
    again = failed("screen", "-j", 1)
    assert "screen is recomputed (changed: stemcal)" in again.stderr


def test_a_changed_target_recomputes_nothing(known: Known) -> None:
    assert known("run", "-j", 1).exit_code == 0
    before = len(lines(known.witness))
    known.spec.write_text(known.spec.read_text("utf-8").replace("force: 171.875 N", "force: 180 N"), encoding="utf-8")
    assert known("run", "-j", 1).exit_code == 0
    assert len(lines(known.witness)) == before


def test_runs_that_a_former_spec_decided_on_are_not_this_ones(known: Known) -> None:
    """The steps that another version of the solver took stay in the folder; no number of this study rests on them."""
    known.write("climb: {steps: 3}\n")
    assert known("screen", "-j", 1).exit_code == known("climb", "-j", 1).exit_code == 0
    steps = climbed(known)
    assert stage(known.json("status"), "climb")["done"] == steps > 0
    known.solver(version=2)
    assert stage(known.json("status"), "climb")["done"] == 0
    assert known("screen", "-j", 1).exit_code == known("climb", "-j", 1).exit_code == 0
    assert stage(known.json("status"), "climb")["done"] == climbed(known) == steps


def test_status_needs_a_folder(known: Known) -> None:
    assert known("status").exit_code == 2
    assert not known.out.exists()


# ---- runs


def test_runs_are_listed(failed: Known) -> None:
    found = failed.json("status", "--runs")["runs"]
    assert [run["run"] for run in found if run["stage"] == "screen"] == list(range(1, 13))
    for run in found:
        if run["status"] == "ok":
            assert run["response"] == pytest.approx(force(run["levels"], run["condition"]))
    assert sum(run["status"] == "left" for run in found) == 11
    (bad,) = failed.json("status", "--failed")["runs"]
    assert (bad["run"], bad["reason"], bad["response"], bad["again"]) == (3, "inverted", None, False)
    assert "element 17" in bad["message"]
    (line,) = failed("status", "--failed").stdout.splitlines()
    levels = ", ".join(f"{name}={value:g}" for name, value in bad["levels"].items())
    assert line.startswith(f"screen run 3 at a diameter of 8 mm ({levels}): inverted: ") and "element 17" in line


def test_runs_of_one_record_are_one_failure() -> None:
    row = LedgerRow("rsm", 9, "a", "failed", None, "crashed", "in\nstep 3", False, 8.0, {"x": 1.0})
    again = [replace(row, run=10), replace(row, run=9, replicate=1), replace(row, run=11, key="b", levels={"x": 2.5})]
    assert _failures([row, *again], Wording()) == [
        "rsm runs 9 and 10 at a diameter of 8 mm (x=1): crashed: in step 3",
        "rsm run 11 at a diameter of 8 mm (x=2.5): crashed: in step 3",
    ]


# ---- retry


def test_retry_computes_what_failed_and_nothing_else(failed: Known) -> None:
    before = len(lines(failed.witness))
    again = failed("run", "--until", "screen", "--retry", "-j", 1)
    assert again.exit_code == 3 and "1 of 1 runs failed again" in again.stderr
    failed.solver()
    assert failed("run", "--until", "screen", "--retry", "-j", 1).exit_code == 0
    assert lines(failed.witness)[before:] == ["screen 2", "screen 2"]
    assert failed.json("status", "--failed")["runs"] == []
    assert (failed.out / "report.html").exists() and not (failed.out / "rsm.json").exists()


def test_until_needs_a_stage_of_the_study(known: Known) -> None:
    for name in ("climb", "rsn"):
        refused = known("run", "--until", name)
        assert refused.exit_code == 2 and "use one of screen, rsm, invert, validate" in refused.stderr


# ---- verify


def test_verify_names_what_is_wrong(failed: Known) -> None:
    assert failed("status", "--verify").exit_code == 0
    folder = StudyFolder(failed.out)
    first, second = folder.keys()[:2]
    path = folder.record_path(first)
    path.write_bytes(path.read_bytes().replace(b'"stage": "screen"', b'"stage": "scream"'))
    found = failed.json("status", "--verify")["verify"]
    assert found["ok"] is False and found["records"] == 12
    assert found["damaged"] == {f"runs/{first}.json": "does not match its SHA-256 checksum"}
    result = failed("status", "--verify")
    assert result.exit_code == 1
    assert f"runs/{first}.json does not match" in result.stderr
    assert folder.record_path(second).exists() and path.exists()  # nothing was moved


def test_verify_sees_a_changed_table_and_a_version_that_it_does_not_know(failed: Known) -> None:
    table = failed.out / "screen.csv"
    table.write_text(table.read_text("utf-8").replace("yield_stress", "yield_strain"), encoding="utf-8")
    result = failed("status", "--verify")
    assert result.exit_code == 1 and "screen.csv is missing or has been changed" in result.stderr
    path = failed.out / "screen.json"
    content = json.loads(path.read_text("utf-8")) | {"schema_version": 99}
    path.write_text(sealed({name: part for name, part in content.items() if name != "sha256"}), encoding="utf-8")
    result = failed("status", "--verify")
    assert result.exit_code == 1 and "screen.json has schema version 99, but version 3 is required" in result.stderr


def test_report_leaves_out_a_damaged_stage_and_says_so(failed: Known) -> None:
    (failed.out / "screen.json").write_bytes(b"{")
    result = failed("report")
    assert "screen.json is damaged" in " ".join(result.stderr.split()), result.stderr


def test_verify_sees_a_stage_of_another_solver(failed: Known) -> None:
    failed.solver(version=2)
    found = failed.json("status", "--verify")["verify"]
    assert found["ok"] is True
    (failed.out / "screen.json").write_bytes(b"{")
    assert failed.json("status", "--verify")["verify"]["damaged"] == {
        "screen.json": "is damaged: the file contains no JSON object; run `stemcal screen SPEC` again"
    }
