"""The failure strain by element size of a force whose law is known, and the files for another model."""

import json
from dataclasses import dataclass, replace
from math import exp
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

import pytest
import workflow
from fakes import FakeSolver, make_study
from typer.testing import CliRunner

import stemcal
from stemcal.cli.app import app
from stemcal.errors import UsageError
from stemcal.report.progress import describe
from stemcal.runs.answer import watch_nothing
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.options import EmbeddedSolver
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.element_size import SizedStrain, material_lines, not_valid, strain_of, without_lengths
from stemcal.stages.ledger import ledger
from stemcal.stages.work import Work
from stemcal.study.model.growth import Growth
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

ROOT = Path(__file__).parents[2]
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"


@dataclass(frozen=True)
class WithoutLengths(Solver):
    """F = 110·(ε·h/0.05 mm)^0.4 N on average, ±10 % over five positions; no force is above 90 N in elements of 4 mm.

    In elements of 3 mm the scatter is four times as large.
    """

    study: Study
    random_offset: bool = True

    def identity(self, request: Request) -> dict[str, Any]:
        """What was asked."""
        return {"kind": "without-lengths", "solver": self.study.solver.model_dump(mode="json"), **request.as_record()}

    def solve(self, request: Request) -> Answer:
        """Answer by the law."""
        size = self.study.solver.element_size.at(8.0)
        force = 110.0 * (request.levels["failure_strain"] * size / 0.05) ** 0.4
        force = min(force, 90.0) if size == 4.0 else force
        sd = (0.19 if size == 3.0 else 0.05) * force
        places = [float(place) for place in range(self.study.solver.repeats)]
        share = (places[request.replicate - 1] - fmean(places)) / stdev(places)
        return Answer("ok", force + share * sd)


def calibrated(folder: Path) -> Work:
    """Return a calibrated study whose answers are known."""
    study, out, solver = make_study(folder, TWO), StudyFolder(folder / "out"), FakeSolver()
    workflow.run_stage("rsm", study, out, InlineExecutor(), solver=solver)
    workflow.run_stage("invert", study, out, solver=solver)
    return Work(study, out, InlineExecutor(), watch_nothing, solver)


def found_for(folder: Path, monkeypatch: pytest.MonkeyPatch, size: float) -> SizedStrain:
    monkeypatch.setattr("stemcal.solvers.embedded.Embedded", WithoutLengths)
    return strain_of(calibrated(folder), size)


@pytest.mark.parametrize("size", [2.0, 0.5])
def test_the_strain_goes_with_one_over_the_size(size: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """110 N at ε·h = 0.05 mm, within 2 % of the force, that is 5 % of the strain."""
    found = found_for(tmp_path, monkeypatch, size)
    assert found.valid and found.positions == 5 and found.force == pytest.approx(110.0, rel=0.02)
    assert found.failure_strain == pytest.approx(0.05 / size * (found.force / 110.0) ** 2.5)
    assert found.sd_percent == pytest.approx(5.0) and found.levels["failure_strain"] == found.failure_strain


def test_the_interval_is_that_of_the_scatter_over_positions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """5 % over five positions: ln ε ± t(4)·0.05/√5/0.4, with the slope 0.4 of the two runs or 0.5 before."""
    row = found_for(tmp_path, monkeypatch, 1.0)
    assert row.interval is not None and row.runs > 1
    half = 2.776445 * 0.05 / 5**0.5 / 0.4
    ends = [row.failure_strain * exp(-half), row.failure_strain * exp(half)]
    assert row.interval == pytest.approx(ends, rel=1e-4)


def test_a_large_scatter_takes_more_positions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """19 % over five positions is 8.5 % of the mean; with fifteen it is 4.9 %."""
    row = found_for(tmp_path, monkeypatch, 3.0)
    assert row.valid and row.positions == row.positions_needed == 15 and row.force == pytest.approx(110.0, rel=0.02)


def test_a_force_that_is_not_reached_is_no_valid_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = found_for(tmp_path, monkeypatch, 4.0)
    assert not found.valid and found.force == pytest.approx(90.0)
    assert "mean force is 90 N (target 110 N), with a coefficient of variation of 5 % over 5" in not_valid(found)


def test_a_material_that_grows_states_its_diameter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, study = found_for(tmp_path, monkeypatch, 1.0), make_study(tmp_path, TWO)
    growing = {"material": study.material.model_copy(update={"density": Growth(at=8.0, exponent=0.5, value=1e-9)})}
    said = "Some parameters depend on the stem diameter, so all values are valid only for a diameter of 8 mm."
    lines = [material_lines(one, found) for one in (study, study.model_copy(update=growing))]
    assert [said in each for each in lines] == [False, True]


def test_runs_are_recorded_and_are_of_no_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.solvers.embedded.Embedded", WithoutLengths)
    lines: list[str] = []
    work = replace(calibrated(tmp_path), watch=lambda progress: lines.append(describe(progress)))
    first = strain_of(work, 1.0)
    records = len(work.folder.keys())
    assert strain_of(work, 1.0) == first and len(work.folder.keys()) == records
    assert "material" not in {entry.stage for entry in ledger(work.study, work.folder)}
    assert lines[0] == "Failure strain for this element size: 0/5 runs"


def test_the_model_has_no_lengths_and_a_longer_stroke(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    there = without_lengths(study)
    assert there.material.internal_length.at(8.0) == there.blade.edge_spread.at(8.0) == 0.0
    assert there.loading.duration == 3.0 * study.loading.duration and isinstance(there.solver, EmbeddedSolver)
    with pytest.raises(
        UsageError, match=r"is `sheet`, but `embedded` is required\. Write `solver: \{kind: embedded\}`"
    ):
        without_lengths(load_study(ROOT / "configs" / "paper-replay.yaml"))


@pytest.mark.slow
def test_the_material_of_a_study(tmp_path: Path) -> None:
    """The card has the strain of its size; a simulation of its mesh gives the mean force within the scatter."""
    spec, out, folder = ROOT / "configs" / "smoke.yaml", tmp_path / "out", tmp_path / "material"
    stemcal.calibrate(spec, out=out, workers=1)
    options = ["--for", "openradioss", "--element-size", "2 mm", "--json"]
    done = CliRunner().invoke(app, ["export", "material", str(spec), str(folder), *options, "--out", str(out)])
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)["result"]
    assert told == json.loads((folder / "material.json").read_text("utf-8"))
    assert sorted(path.name for path in folder.iterdir()) == sorted(told["files"])
    assert told["element_size"] == 2.0 and told["aim"] == 159.2
    strain = told["failure_strain"]
    assert strain == told["parameters"]["failure_strain"]
    assert told["valid"] and told["force"] == pytest.approx(159.2, rel=0.05)
    card = (folder / "material.k").read_text("utf-8")
    material = card[card.index("*MAT_PIECEWISE") : card.index("*END")]
    assert float(material.splitlines()[2][60:70]) == pytest.approx(strain, rel=1e-6)


def test_elements_too_large_for_the_stem_are_refused(tmp_path: Path) -> None:
    spec = ROOT / "configs" / "smoke.yaml"
    options = ["--for", "lsdyna", "--element-size", "5 mm", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["export", "material", str(spec), str(tmp_path / "m"), *options])
    assert done.exit_code == 2 and "5 mm is too large for a stem diameter of 8 mm. Use at most 4 mm." in " ".join(
        done.stderr.split()
    )
