"""The stage of the mesh: other meshes simulated at the solution, their scatter in every interval."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes import TWO_FACTORS, SpecSolver
from scipy import stats

from stemcal import workflow
from stemcal.errors import RunsFailed, SpecError, UsageError
from stemcal.executors.inline import InlineExecutor
from stemcal.folder.study_folder import StudyFolder
from stemcal.overview.plan import OtherMeshes, plan
from stemcal.overview.status import ledger, retry, status
from stemcal.report.page.render import render
from stemcal.report.tables.stages import tables_of
from stemcal.solvers import SOLVERS
from stemcal.solvers.embedded import Embedded, meshed_as
from stemcal.solvers.protocol import Answer, Belonging, Meshed, Request
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.mesh.stage import ScatterUnknown
from stemcal.stages.results import Results, fresh_results
from stemcal.study.model import EmbeddedSolver, Study
from stemcal.study.reading import load_study
from stemcal.study.types.lengths import Length

TARGETS = """\
targets:
  calibrate_at: 8 mm
  forces:
    - {diameter: 7 mm, force: 84.2 N, sd: 3 N, n: 6}
    - {diameter: 8 mm, force: 110 N, sd: 4 N, n: 6}
    - {diameter: 10 mm, force: 171.9 N, sd: 6 N, n: 6}
rsm: {factors: [yield_stress, failure_strain], centre_points: 2}
"""
FORCES = TARGETS
MESH = "mesh: {phases: 4, sizes: [d/24]}\n"
PLACES = (1.02, 0.98, 1.01, 0.97)


@dataclass(frozen=True)
class FakeForce(SpecSolver):
    """The known force of two factors."""

    def solve(self, request: Request) -> Answer:
        held = {"strain_rate_c": 90.0, "elastic_modulus": 1000.0}
        return super().solve(replace(request, levels={**held, **request.levels}))


@dataclass(frozen=True)
class FakeMeshes(FakeForce):
    """The known force times what its mesh makes of it: a factor for each place, 0.95 for any other element size."""

    places: tuple[float, ...] = (1.0,)
    size: float = 1.0
    fails: bool = False

    @property
    def phases(self) -> int:
        return len(self.places)

    def on(self, request: Request) -> FakeMeshes:
        if request.element_size is not None:
            return replace(self, size=0.95, version=int(Length.of(request.element_size).divisor or 0))
        return self if request.phases is None else replace(self, places=PLACES[: request.phases])

    def belongings(self, diameter: float) -> dict[str, str]:
        return {"element_size": f"d/16 ({diameter / 16:g} mm)"}

    def identity(self, request: Request) -> dict[str, Any]:
        meshed = self.on(request)
        return {**super(FakeMeshes, meshed).identity(request), "places": list(meshed.places), "size": meshed.size}

    def solve(self, request: Request) -> Answer:
        whole, meshed = super().solve(request), self.on(request)
        if self.fails and len(meshed.places) > 1:
            return Answer("failed", reason="inverted", message="element 3")
        forces = [meshed.size * place * (whole.response or 0.0) for place in meshed.places]
        return Answer("ok", sum(forces) / len(forces), details={"phase_peaks": forces} if len(forces) > 1 else {})


Made = Callable[..., tuple[Study, StudyFolder, Results]]


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Made:
    def make(extra: str = "", solver: FakeMeshes | None = None) -> tuple[Study, StudyFolder, Results]:
        monkeypatch.setitem(SOLVERS, "embedded", lambda _study: solver or FakeMeshes())
        path = tmp_path / "study.yaml"
        path.write_text(TWO_FACTORS + TARGETS + extra, encoding="utf-8")
        study, folder = load_study(path), StudyFolder(tmp_path / "out")
        workflow.calibrate(study, folder, InlineExecutor())
        return study, folder, fresh_results(study, folder)

    return make


def test_every_interval_is_wider_with_the_mesh(made: Made) -> None:
    plain, meshed = made()[2], made(MESH)[2]
    assert plain.mesh is None and meshed.mesh is not None
    without, held = plain.inversion, meshed.inversion
    assert without is not None and held is not None
    assert without.point.solution == held.point.solution
    for name, (low, high) in without.ranges.items():
        assert held.ranges[name][0] <= low and high <= held.ranges[name][1]
    assert without.certainty is not None and held.certainty is not None
    narrow, wide = without.certainty.intervals["yield_stress"], held.certainty.intervals["yield_stress"]
    assert wide[0] <= narrow[0] and narrow[1] <= wide[1]
    low, high = held.point.prediction_interval or (0.0, 0.0)
    middle = 110.0 * meshed.mesh.scatter.mean_factor
    assert 0.5 * (low + high) == pytest.approx(middle, rel=1e-3)
    assert all(low < 110.0 * place < high for place in PLACES)


def test_the_page_says_what_the_ranges_assume(made: Made) -> None:
    study, folder, _ = made()
    assumed = "The ranges assume that the mesh stays in its place; a section <code>mesh</code> shows"
    assert assumed in render(study, folder)
    study, folder, _ = made(MESH)
    assert "The ranges assume" not in render(study, folder)


def test_the_budget_tells_each_source(made: Made) -> None:
    mesh = made(MESH)[2].mesh
    assert mesh is not None
    budget = {row.source: row for row in mesh.budget if row.condition == 8.0}
    assert list(budget) == ["laboratory", "surface", "mesh"]
    assert sum(row.share_percent for row in budget.values()) == pytest.approx(100.0)
    assert budget["laboratory"].sd == pytest.approx(4.0 / 6**0.5, rel=0.02)
    assert budget["mesh"].sd == pytest.approx(110.0 * mesh.scatter.variance**0.5)
    assert budget["mesh"].df == 3.0
    assert mesh.sizes[0].factor == pytest.approx(0.95)


def test_jointly_the_common_part_stands_apart(made: Made) -> None:
    """Every diameter has the same factors: all of the scatter is shared, and nothing is averaged away."""
    mesh = made(MESH + "invert: {diameters: all}\n")[2].mesh
    assert mesh is not None and mesh.certainty_alone is not None
    assert mesh.scatter.common == pytest.approx(mesh.scatter.variance, rel=1e-6)
    shared = [row for row in mesh.budget if row.shared]
    assert [row.condition for row in shared] == [7.0, 8.0, 10.0]
    assert len(mesh.rows) == 9


def test_the_validation_shows_what_the_mesh_does(made: Made) -> None:
    validation, meshed = made()[2].validation, made(MESH)[2].validation
    assert validation is not None and meshed is not None
    for plain, row in zip(validation.rows, meshed.rows, strict=True):
        low, high = row.mesh_interval or (0.0, 0.0)
        assert low < (row.compared.simulated or 0.0) < high and plain.mesh_interval is None


def test_it_is_shown_and_comes_back_from_its_file(made: Made) -> None:
    study, folder, results = made(MESH)
    assert results.mesh is not None and results.inversion is not None
    content = json.loads((folder.path / "mesh.json").read_text(encoding="utf-8"))
    assert MeshResult.from_json(content) == results.mesh
    assert (folder.path / "mesh_budget.csv").is_file()
    assert [sheet.title for sheet in tables_of(results.mesh)] == [
        "The solution on other meshes",
        "What the error of the maximum force is made of",
    ]
    assert any("element_size d/16 (0.5 mm): cite" in line for line in tables_of(results.inversion)[0].foot)
    page = render(study, folder)
    assert "What the error of the maximum force is made of" in page and "standard deviation of" in page
    assert OtherMeshes(4, 1, 1) in plan(study, folder).notes
    assert all(stage.file == "fresh" for stage in status(study, folder).stages)


TRAVELS = (1.02, 0.98, 1.012, 0.988)


@dataclass(frozen=True)
class FakeTravels(FakeMeshes):
    """Travel 1 + 0.2b and work half of force times travel, times d/8; the travel has a scatter of its own."""

    silent: bool = False

    def solve(self, request: Request) -> Answer:
        whole, meshed = super().solve(request), self.on(request)
        b = (request.levels["failure_strain"] - 0.03) / 0.02
        travel, force = (1.0 + 0.2 * b) * request.condition / 8.0, whole.response or 0.0
        curve = {"travel": [0.0, travel, 2.0 * travel], "force": [0.0, force, 0.0]}
        if len(meshed.places) == 1:
            return replace(whole, details={"peak_travel": travel, "curve": curve})
        travels = [travel * factor for factor in TRAVELS[: len(meshed.places)]]
        works = [0.5 * f * u for f, u in zip(whole.details["phase_peaks"], travels, strict=True)]
        told = {} if self.silent else {"phase_travels": travels, "phase_works": works}
        return replace(whole, details={**whole.details, **told})


def of_travel(made: Made, extra: str, solver: FakeMeshes, monkeypatch: pytest.MonkeyPatch) -> Results:
    """A study that measured the travel at 7 and 8 mm and fits it at 8 mm."""
    told = {" 3 N, n: 6": "travel: 0.9 mm", " 4 N, n: 6": "travel: 1.05 mm"}
    targets = FORCES
    for after, travel in told.items():
        targets = targets.replace(after, f"{after}, {travel}, travel_sd: 0.01 mm")
    monkeypatch.setattr(f"{__name__}.TARGETS", targets)
    return made(extra + "invert: {responses: [force, travel]}\n", solver)[2]


def test_the_scatter_of_the_travel_is_in_what_the_travel_tells(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    """The failure strain is told by the travel alone: ±t·√(variance of mean and mesh) over its slope of 0.2 mm."""
    plain = of_travel(made, "", FakeTravels(), monkeypatch)
    meshed = of_travel(made, MESH, FakeTravels(), monkeypatch)
    assert plain.inversion is not None and plain.inversion.certainty is not None and meshed.mesh is not None
    scatter = meshed.mesh.scatter_of("travel")
    assert scatter is not None and scatter.own == pytest.approx(np.var(np.log(TRAVELS), ddof=1), rel=1e-9)
    assert meshed.mesh.scatter.own == pytest.approx(np.var(np.log(PLACES), ddof=1), rel=1e-9)
    narrow = plain.inversion.certainty.intervals["failure_strain"]
    wide = meshed.mesh.certainty.intervals["failure_strain"]
    laboratory, mesh = 0.01**2 / 6, 1.05**2 * scatter.own
    df = (laboratory + mesh) ** 2 / (laboratory**2 / 5 + mesh**2 / 3)
    reach = stats.t.ppf(0.975, df) * (laboratory + mesh) ** 0.5 / 0.2 * 0.02
    assert wide == pytest.approx((0.035 - reach, 0.035 + reach), abs=0.02 * reach)
    assert wide[1] - wide[0] > 2.0 * (narrow[1] - narrow[0])
    assert (meshed.mesh.further or {})["travel"].sd_percent == pytest.approx(1.9, abs=0.05)
    assert MeshResult.from_json(meshed.mesh.to_json()) == meshed.mesh


def test_the_validation_has_the_scatter_of_the_travel(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    validation = of_travel(made, MESH, FakeTravels(), monkeypatch).validation
    assert validation is not None
    row = validation.rows[0].further[0]
    low, high = row.mesh_interval or (0.0, 0.0)
    own = np.var(np.log(TRAVELS), ddof=1)
    middle = row.simulated * stats.gmean(TRAVELS)
    reach = stats.t.ppf(0.975, 3) * middle * (own * (1 + 1 / 4)) ** 0.5
    assert (low, high) == pytest.approx((middle - reach, middle + reach))
    foot = tables_of(validation)[1].foot
    assert any(
        line.startswith("With the mesh at another place the travel to the maximum force at 7 mm lies within")
        for line in foot
    )


def test_a_travel_that_no_place_tells_is_told_to_be_in_no_interval(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    results = of_travel(made, MESH, FakeTravels(silent=True), monkeypatch)
    assert results.mesh is not None and results.validation is not None
    assert results.mesh.further is None and results.validation.rows[0].further[0].mesh_interval is None
    assert results.mesh.notes == (ScatterUnknown("travel"),)


def test_a_failed_place_stops_it_and_a_failed_size_is_left_out(made: Made) -> None:
    with pytest.raises(RunsFailed, match=r"mesh: the run at 8 mm \(phases\) failed \(inverted\): element 3"):
        made(MESH, FakeMeshes(fails=True))


def test_failed_runs_of_other_meshes_are_computed_again(made: Made, tmp_path: Path) -> None:
    """The record tells which mesh was asked for, so the same run is begun again, and the stage goes on with it."""
    with pytest.raises(RunsFailed):
        made(MESH, FakeMeshes(fails=True))
    study, folder = load_study(tmp_path / "study.yaml"), StudyFolder(tmp_path / "out")
    failed = [entry for entry in ledger(study, folder, FakeMeshes()) if entry.status == "failed"]
    assert [(entry.stage, entry.phases) for entry in failed] == [("mesh", 4)]
    again = retry(study, folder, InlineExecutor(), solver=FakeMeshes())
    assert [(entry.key, entry.status) for entry in again] == [(failed[0].key, "ok")]
    records = set(folder.keys())
    assert made(MESH)[2].mesh is not None
    assert {folder.load(key)["request"]["stage"] for key in set(folder.keys()) - records} == {"validate"}


def test_solvers_that_cannot_mesh_otherwise_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SOLVERS, "embedded", lambda _study: FakeForce())
    path = tmp_path / "study.yaml"
    path.write_text(TWO_FACTORS + TARGETS + MESH, encoding="utf-8")
    with pytest.raises(UsageError, match="mesh: solver embedded does not say how it would mesh otherwise"):
        workflow.calibrate(load_study(path), StudyFolder(tmp_path / "out"), InlineExecutor())
    path.write_text(TWO_FACTORS + TARGETS + MESH + "solver: {kind: embedded, perturb: 1}\n", encoding="utf-8")
    with pytest.raises(SpecError, match=r"solver\.perturb draws the place of the mesh anew"):
        load_study(path)


def test_the_embedded_solver_meshes_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(TWO_FACTORS + TARGETS, encoding="utf-8")
    solver = Embedded(load_study(path))
    assert isinstance(solver, Meshed) and isinstance(solver, Belonging) and solver.phases == 1
    assert solver.belongings(8.0) == {
        "element_size": "d/16 (0.5 mm)", "edge_spread": "d/9.5 (0.842 mm)", "internal_length": "d/4.5 (1.78 mm)",
    }  # fmt: skip
    request = Request("mesh", 0, {"yield_stress": 15.0, "failure_strain": 0.03}, 8.0)
    assert len(solver.identity(replace(request, phases=3))["tests"]) == 3
    finer = meshed_as(solver.study, replace(request, element_size="d/24")).solver
    assert isinstance(finer, EmbeddedSolver) and str(finer.element_size) == "d/24"
    assert finer.time_step == pytest.approx(4e-5 * 16 / 24)
