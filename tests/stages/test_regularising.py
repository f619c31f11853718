"""The failure strain over element size of a force whose law is known, and the files for one's own model."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from fakes import FakeSolver, make_study
from typer.testing import CliRunner

import stemcal
from stemcal import workflow
from stemcal.cli.app import app
from stemcal.errors import UsageError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.status import ledger
from stemcal.report.progress import describe
from stemcal.runs.answer import ignore
from stemcal.solvers.deck.material import curve_text
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.regularise import Regularisation, regularise, without_lengths
from stemcal.stages.work import Work
from stemcal.study.model import EmbeddedSolver, Study
from stemcal.study.model.growth import Growth
from stemcal.study.reading import load_study
from stemcal.study.types.lengths import Length
from stemcal.text.regularisation import material_lines, not_valid

ROOT = Path(__file__).parents[2]
TWO = "rsm: {factors: [yield_stress, failure_strain], centre_points: 3}\n"
PLACES = (0.9, 0.95, 1.0, 1.05, 1.1)


@dataclass(frozen=True)
class WithoutLengths:
    """F = 110·(ε·h/0.05 mm)^0.4 N on average, ±10 % over the places; no force is above 90 N in elements of 4 mm.

    In elements of 3 mm the scatter is four times as large; in those of 2.5 mm one place never gives more than 60 N.
    """

    study: Study

    def prepare(self) -> None:
        """Do nothing."""

    def identity(self, request: Request) -> dict[str, Any]:
        """What was asked."""
        return {"kind": "without-lengths", **request.as_record()}

    def given_design(self, _stage: str) -> None:
        """Any levels."""
        return

    def solve(self, request: Request) -> Answer:
        """Answer by the law."""
        size = Length.of(request.element_size or "").at(8.0)
        force = 110.0 * (request.levels["failure_strain"] * size / 0.05) ** 0.4
        forces = [place * (min(force, 90.0) if size == 4.0 else force) for place in PLACES[: request.phases]]
        if size == 2.5:
            forces[0] = min(forces[0], 60.0)
        sd = (0.2 if size == 3.0 else 0.05) * force
        return Answer("ok", sum(forces) / len(forces), details={"phase_peaks": forces, "peak_sd": sd})


def calibrated(folder: Path) -> Work:
    """Return a calibrated study whose answers are known."""
    study, out, solver = make_study(folder, TWO), StudyFolder(folder / "out"), FakeSolver()
    workflow.fit_surface(study, out, InlineExecutor(), solver=solver)
    workflow.invert(study, out, solver=solver)
    return Work(study, out, InlineExecutor(), ignore, solver)


def found_for(folder: Path, monkeypatch: pytest.MonkeyPatch, *sizes: float) -> Regularisation:
    monkeypatch.setattr("stemcal.solvers.embedded.Embedded", WithoutLengths)
    return regularise(calibrated(folder), sizes, 5)


def test_the_strain_goes_with_one_over_the_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """110 N at ε·h = 0.05 mm, within 2 % of the force, that is 5 % of the strain; sizes rise in the result."""
    found = found_for(tmp_path, monkeypatch, 2.0, 0.5, 1.0)
    assert [row.element_size for row in found.rows] == [0.5, 1.0, 2.0]
    for row in found.rows:
        assert row.found and row.places == 5 and row.force == pytest.approx(110.0, rel=0.02)
        assert row.failure_strain == pytest.approx(0.05 / row.element_size * (row.force / 110.0) ** 2.5)
        assert row.sd_percent == pytest.approx(5.0, rel=0.02)
    # the first guess, from twice the size, is right; then the ends of the band, guessed and run again a bit farther out
    assert found.row(0.5).runs == 5


def test_the_band_is_what_the_places_take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A place that gives 1.1 times the mean takes ε·1.1^(−1/0.4) for it."""
    found = found_for(tmp_path, monkeypatch, 1.0)
    row = found.rows[0]
    exact = 0.05
    assert row.low == pytest.approx(exact * 1.1 ** (-2.5), rel=0.01)
    assert row.high == pytest.approx(exact * 0.9 ** (-2.5), rel=0.01)


def test_a_force_that_is_not_reached_is_no_valid_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = found_for(tmp_path, monkeypatch, 4.0)
    assert not found.row(4.0).found and found.row(4.0).force == pytest.approx(90.0)


def test_a_mean_of_much_scatter_is_no_valid_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """20 % over five places is 8.9 % of the mean; sixteen places would do."""
    found = found_for(tmp_path, monkeypatch, 3.0)
    row = found.row(3.0)
    assert row.force == pytest.approx(110.0, rel=0.02) and row.bracketed and not row.found
    assert row.se_percent == pytest.approx(20.0 / 5**0.5, rel=0.03)
    assert re.search(
        r"scatters by .* standard error of 8\.\d+ %.*; take --places 16 or more", not_valid(found, row, 50)
    )
    assert "16 places would be needed" in not_valid(found, row, 10)


def test_a_place_that_never_has_the_force_makes_no_valid_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = found_for(tmp_path, monkeypatch, 2.5)
    row = found.row(2.5)
    assert row.force == pytest.approx(110.0, rel=0.02) and row.high == 2.0
    assert not row.bracketed and not row.found
    assert "some places of the mesh do not reach 110 N at any failure strain from 0.001 to 2;" in not_valid(
        found, row, 50
    )


def test_a_material_that_grows_names_its_diameter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, study = found_for(tmp_path, monkeypatch, 1.0), make_study(tmp_path, TWO)
    growing = {"material": study.material.model_copy(update={"density": Growth(at=8.0, exponent=0.5, value=1e-9)})}
    said = "Parameters of this study follow the stem's diameter: all values here hold for 8 mm."
    told = [material_lines(one, found, found.rows[0], 110.0) for one in (study, study.model_copy(update=growing))]
    assert [said in lines for lines in told] == [False, True]


def test_progress_tells_of_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.solvers.embedded.Embedded", WithoutLengths)
    lines: list[str] = []
    regularise(replace(calibrated(tmp_path), watch=lambda progress: lines.append(describe(progress))), [1.0, 0.5], 5)
    title = "Failure strain over element size"
    assert lines[0] == f"{title}: size 1 of 2" and lines[-1] == f"{title}: 2 sizes"
    assert {line.split(",")[0] for line in lines} == {
        f"{title}: size 1 of 2",
        f"{title}: size 2 of 2",
        f"{title}: 2 sizes",
    }


def test_runs_are_recorded_and_belong_to_no_stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.solvers.embedded.Embedded", WithoutLengths)
    work = calibrated(tmp_path)
    first = regularise(work, [1.0], 5)
    records = len(work.folder.keys())
    assert regularise(work, [1.0], 5) == first and len(work.folder.keys()) == records
    assert "regularise" not in {entry.stage for entry in ledger(work.study, work.folder, work.solver)}


def test_the_model_has_no_lengths_and_a_longer_stroke(tmp_path: Path) -> None:
    study = make_study(tmp_path, TWO)
    there = without_lengths(study)
    assert there.material.internal_length.at(8.0) == there.blade.edge_spread.at(8.0) == 0.0
    assert there.loading.duration == 3.0 * study.loading.duration and isinstance(there.solver, EmbeddedSolver)
    with pytest.raises(UsageError, match=r"needs `solver: \{kind: embedded\}`; this spec has kind sheet"):
        without_lengths(load_study(ROOT / "configs" / "paper-replay.yaml"))


def test_a_curve_rises_in_its_sizes() -> None:
    text = curve_text([(2.0, 0.0146), (0.707, 0.27)], ["Failure strain over element size, mm."])
    lines = text.splitlines()
    assert lines[:3] == ["*KEYWORD", "$ Failure strain over element size, mm.", "*DEFINE_CURVE"]
    assert [line.split() for line in lines[-3:]] == [["0.707", "0.27"], ["2.0", "0.0146"], ["*END"]]


@pytest.mark.slow
def test_the_material_of_a_study(tmp_path: Path) -> None:
    """The card has the strain of its size, the deck the same card; a simulation of its mesh gives the force told."""
    spec, out, folder = ROOT / "configs" / "smoke.yaml", tmp_path / "out", tmp_path / "material"
    stemcal.calibrate(spec, out=out, workers=1)
    options = ["--for", "openradioss", "--element-size", "2 mm", "--size", "1.5 mm", "--places", "3", "--json"]
    done = CliRunner().invoke(app, ["export", "material", str(spec), str(folder), *options, "--out", str(out)])
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)["result"]
    assert told == json.loads((folder / "material.json").read_text("utf-8"))
    assert sorted(path.name for path in folder.iterdir()) == sorted(told["files"])
    # at 1.5 mm the force scatters by 12 %: the mean over three places is not known within 5 %
    assert told["valid_sizes"] == [2.0] and told["aim"] == 159.2
    rows = list(csv.DictReader(io.StringIO((folder / "curve.csv").read_text("utf-8"))))
    strain = float(rows[1]["failure_strain"])
    assert strain == told["parameters"]["failure_strain"] < float(rows[0]["failure_strain"])
    assert all(float(row["force"]) == pytest.approx(159.2, rel=0.05) for row in rows)
    card = (folder / "material.k").read_text("utf-8")
    material = card[card.index("*MAT_PIECEWISE") : card.index("*END")]
    assert material in (folder / "check.k").read_text("utf-8")
    assert float(material.splitlines()[2][60:70]) == pytest.approx(strain, rel=1e-6)
    there = load_study(spec).with_(
        solver={"element_size": "2 mm"},
        material={"internal_length": "0 mm"},
        blade={"edge_spread": "0 mm"},
        loading={"duration": "1.5 s"},
    )
    force = stemcal.simulate(there, 8.0, **told["parameters"]).peak_force
    assert force == pytest.approx(told["check"]["force"], rel=0.05)


def test_elements_too_large_for_the_stem_are_refused(tmp_path: Path) -> None:
    spec = ROOT / "configs" / "smoke.yaml"
    options = ["--for", "lsdyna", "--element-size", "5 mm", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["export", "material", str(spec), str(tmp_path / "m"), *options])
    assert done.exit_code == 2 and "elements of 5 mm are too large for a 8 mm stem; take 4 mm at most" in done.stderr
