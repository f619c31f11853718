"""The material of a finished study in another spec: its values, its uncertainty, and what `check` refuses."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes import TWO_FACTORS, SpecSolver
from planting import HALF, MIDDLE, Law, judged

from stemcal.errors import SpecError, UsageError
from stemcal.overview.plan import plan
from stemcal.overview.status import retry, stage_states
from stemcal.runs.record import RESPONSES
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.fresh import make_all
from stemcal.stages.ledger import ledger
from stemcal.stages.optimise.material import Borrowed, _add_sections, calibrated_sections
from stemcal.stages.work import HERE
from stemcal.study.model.layers import layers_at
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.types.solver_kind import SOLVERS

CONFIGS = Path(__file__).parents[2] / "configs"
LAW = Law(p=20.0, q=8.0, r=0.0)
SOURCE = TWO_FACTORS.replace("failure_strain, low", "failure_strain, prior: {mean: 0.03, sd: 0.01, source: known}, low")
SOURCE += """\
targets: [{diameter: 8 mm, force: 110 N, sd: 2 N}, {diameter: 9 mm, force: 139.2 N}]
solver: {rate_law: paper, element_size: d/12}
contact: {static_friction: 0.2}
screen: {design: none}
rsm: {factors: [yield_stress, failure_strain]}
"""
CUTTER = """\
name: cutter
material: {from: out}
specimen: {outer_diameter: 8.5 mm}
factors:
  - {name: edge_angle, unit: deg, low: 15, high: 60}
  - {name: thickness, unit: mm, low: 1, high: 4}
loading: {until: severed, stroke: d/1}
goal: {minimise: [cutting_energy]}
screen: {design: none}
rsm: {factors: [edge_angle, thickness]}
"""


@pytest.fixture
def calibrated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a finished calibration in `out`."""
    verdict, _ = judged(tmp_path, SOURCE, LAW, monkeypatch)
    assert verdict.holds, verdict.reasons
    StudyFolder(tmp_path / "out").remember_spec(tmp_path / "study.yaml")
    return tmp_path


def cutter(folder: Path, text: str = CUTTER) -> Study:
    (folder / "cutter.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "cutter.yaml")


def force(study: Study) -> float:
    """Return the planted force of the material of a study at 8 mm."""
    values = study.parameters({}, 8.0)
    a, b = (np.array([values["yield_stress"], values["failure_strain"]]) - MIDDLE) / HALF
    return LAW.at(float(a), float(b), 8.0)[0]


def test_values_and_settings_of_the_calibration(calibrated: Path) -> None:
    """The material gives the measured force again; mesh, friction and fixed values are those of the calibration."""
    study = cutter(calibrated)
    assert force(study) == pytest.approx(110.0, abs=0.05)
    assert study.material.fixed()["elastic_modulus"] == 1000.0
    assert str(study.solver.element_size) == "d/12"
    assert study.contact.static_friction == 0.2
    assert not study.pending


def test_other_materials_have_the_scatter_of_the_measurement(calibrated: Path) -> None:
    """Propagated to the force that was measured, the covariance is its variance: Σ ΔF² = 2² N²."""
    study = cutter(calibrated)
    changes = [force(study.model_copy(update=other)) - force(study) for other in study.materials]
    assert len(changes) == 2
    assert np.linalg.norm(changes) == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("loading:", "solver: {element_size: d/16}\nloading:", "solver.element_size"),
        ("loading:", "solver: {rate_law: cowper_symonds}\nloading:", "solver.rate_law"),
        ("loading:", "blade: {edge_spread: 1 mm}\nloading:", "blade.edge_spread"),
        ("thickness, unit: mm, low: 1, high: 4}", "speed, unit: m/s, low: 0.1, high: 1}", "material.from"),
        ("stroke: d/1", "stroke: d/1, speed: 1 m/s", "material.from"),
        ("from: out", "from: out, internal_length: d/5", "material.internal_length"),
        ("from: out", "from: out, elastic_modulus: 900 MPa", "material.elastic_modulus"),
        ("8.5 mm", "8.5 mm, diameter_ratio: 0.5", "specimen.diameter_ratio"),
        ("8.5 mm", "12 mm", "specimen.outer_diameter"),
        ("8.5 mm", "6 mm", "specimen.outer_diameter"),
        ("from: out", "from: elsewhere", "material.from"),
        ("loading:", "solver: {kind: deck, program: openradioss}\nloading:", "material.from"),
    ],
)
def test_check_names_the_difference(calibrated: Path, old: str, new: str, place: str) -> None:
    with pytest.raises(SpecError) as caught:
        cutter(calibrated, CUTTER.replace(old, new))
    problem = caught.value.problems[0]
    assert problem.path == place
    assert problem.remedy and ("outside the diameters" in problem.message) is (place == "specimen.outer_diameter")


def test_check_shows_values_with_their_units_and_one_remedy(calibrated: Path) -> None:
    """Also of a stale stage, whose own remedy would repeat this stage only."""
    text = CUTTER.replace("from: out", "from: out, density: 900 kg/m3").replace("8.5 mm", "8.5 mm, bore: 1 mm")
    with pytest.raises(SpecError) as caught:
        cutter(calibrated, text)
    first, second = (problem.message for problem in caught.value.problems)
    assert first.endswith("(density: 1100 kg/m3)") and second.endswith("(bore: not set)")
    (calibrated / "study.yaml").write_text(SOURCE.replace("110 N", "115 N"), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        cutter(calibrated)
    assert str(caught.value).count("run `stemcal") == 1 and ".." not in str(caught.value)


def test_a_study_with_the_name_of_its_calibration_is_refused(calibrated: Path) -> None:
    """Both would be in one folder, and the calibration would be overwritten."""
    name = load_study(calibrated / "study.yaml").name
    with pytest.raises(SpecError) as caught:
        cutter(calibrated, CUTTER.replace("name: cutter", f"name: {name}"))
    assert [problem.path for problem in caught.value.problems] == ["name"]


@pytest.mark.parametrize("end", ["low: 5, high: 8.5", "low: 8.5, high: 16"])
def test_a_varied_diameter_is_that_of_the_calibration(calibrated: Path, end: str) -> None:
    factor = f"  - {{name: outer_diameter, unit: mm, {end}}}\nloading"
    text = CUTTER.replace("specimen: {outer_diameter: 8.5 mm}\n", "").replace("loading", factor)
    with pytest.raises(SpecError) as caught:
        cutter(calibrated, text)
    (problem,) = caught.value.problems
    assert problem.path == f"factors.outer_diameter.{'low' if '5,' in end[:7] else 'high'}"


def test_a_thickness_can_be_varied_in_borrowed_layers() -> None:
    source = load_study(CONFIGS / "hemp-two-layers.yaml")
    factor = source.factors[0].model_copy(update={"name": "phloem_thickness", "unit": "mm", "low": 0.3, "high": 0.7})
    borrowed = Borrowed(others=[calibrated_sections(source, source.midlevels())])
    _add_sections(borrowed, source, source.midlevels(), {"factors": {0: factor}}, {})
    for sections in (borrowed.sections, *borrowed.others):
        assert [layer.thickness for layer in sections["layers"]] == [None, None]
    study = source.model_copy(update={**borrowed.sections, "factors": (factor,)})
    assert layers_at(study, {"phloem_thickness": 0.4}, 9.3)[0].thickness == 0.4


@pytest.mark.parametrize("name", ["x" * 5000, '"a\\0b"', '""', '"  "'])
def test_a_folder_that_cannot_exist_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(SpecError, match=r"material\.from"):
        cutter(tmp_path, CUTTER.replace("from: out", f"from: {name}"))


def test_equal_settings_are_accepted(calibrated: Path) -> None:
    text = CUTTER.replace("loading:", "solver: {element_size: d/12.0}\nblade: {edge_spread: d/9.5}\nloading:")
    assert str(cutter(calibrated, text).solver.element_size) == "d/12"


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [("110 N", "115 N", "out of date"), ("sd: 2 N", "sd: 2 N, n: 3", "out of date")],
)
def test_stale_calibration_is_refused(calibrated: Path, old: str, new: str, reason: str) -> None:
    (calibrated / "study.yaml").write_text(SOURCE.replace(old, new), encoding="utf-8")
    with pytest.raises(SpecError, match=reason):
        cutter(calibrated)


def test_of_a_stale_calibration_nothing_else_is_compared(calibrated: Path) -> None:
    (calibrated / "study.yaml").write_text(SOURCE.replace("110 N", "115 N"), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        cutter(calibrated, CUTTER.replace("from: out", "from: out, elastic_modulus: 900 MPa"))
    assert [problem.path for problem in caught.value.problems] == ["material.from"]


def test_equal_layers_are_accepted_and_others_are_not() -> None:
    source = load_study(CONFIGS / "hemp-two-layers.yaml")
    own = {"layers": source.layers, "solver": source.solver}
    for layers, paths in ((source.layers, []), (source.layers[:1], [("layers",)])):
        borrowed = Borrowed()
        _add_sections(borrowed, source, source.midlevels(), {**own, "layers": layers}, {})
        assert [finding.path for finding in borrowed.findings] == paths
        assert borrowed.sections["layers"] == calibrated_sections(source, source.midlevels())["layers"]


def test_damaged_and_unfinished_calibrations_are_refused(calibrated: Path) -> None:
    (calibrated / "out" / "validate.json").unlink()
    with pytest.raises(SpecError, match="not calibrated"):
        cutter(calibrated)
    (calibrated / "out" / "invert.json").write_text("{}", encoding="utf-8")
    with pytest.raises(SpecError, match=r"material\.from"):
        cutter(calibrated)


def test_calibration_that_was_not_run_yet(tmp_path: Path) -> None:
    """With its spec next to this one, the study can be checked, but no stage runs."""
    (tmp_path / "out.yaml").write_text(SOURCE, encoding="utf-8")
    study = cutter(tmp_path)
    assert "out.yaml" in study.pending
    assert study.warnings[0] == study.pending
    assert study.parameters({}, 8.0)["yield_stress"] == 15.0
    with pytest.raises(UsageError, match=r"stemcal run"):
        make_all(study, StudyFolder(tmp_path / "cutter"), HERE)


@pytest.mark.parametrize("name", ["wild-chrysanthemum", "hemp-two-layers", "grapevine"])
def test_sections_of_shipped_stems(name: str) -> None:
    """Growing parameters, layers and fibres have at each diameter the values that the levels give."""
    source = load_study(Path(__file__).parents[2] / "configs" / f"{name}.yaml")
    levels = {one.name: one.low + 0.3 * (one.high - one.low) for one in source.factors}
    blade = source.factors[0].model_copy(update={"name": "edge_angle", "unit": "deg", "low": 15.0, "high": 60.0})
    study = source.model_copy(update={**calibrated_sections(source, levels), "factors": (blade,)})
    for target in source.targets.means:
        at = target.condition
        assert layers_at(study, {}, at) == layers_at(source, levels, at)
        assert study.parameters({}, at) == pytest.approx(source.parameters(levels, at), rel=1e-12)


@pytest.mark.parametrize("key, wrong", [("8.5 mm", "8.5 MPa"), ("out}", "out, yield_stress: 3 mm}")])
def test_a_wrong_value_beside_a_borrowed_material(calibrated: Path, key: str, wrong: str) -> None:
    """A section that lacks a wrong value is compared with the calibration in its other values."""
    with pytest.raises(SpecError) as refused:
        cutter(calibrated, CUTTER.replace(key, wrong))
    line = CUTTER[: CUTTER.index(key)].count("\n") + 1
    assert [problem.line for problem in refused.value.problems] == [line]


@dataclass(frozen=True)
class Linear(SpecSolver):
    """A cutting energy that increases with angle and thickness, and a force; the runs of `broken` rows fail."""

    study: Study | None = None
    broken: tuple[int, ...] = ()

    def solve(self, request: Request) -> Answer:
        if request.stage == "optimise" and request.row in self.broken:
            return Answer("failed", reason="crashed")
        energy = 200.0 + request.levels["edge_angle"] + 10.0 * request.levels["thickness"]
        return Answer("ok", 100.0, details={RESPONSES: {"cutting_energy": energy}})

    def identity(self, request: Request) -> dict[str, Any]:
        assert self.study is not None
        return {**super().identity(request), "yield": self.study.parameters({}, 8.0)["yield_stress"]}


def test_runs_in_other_materials_are_counted_and_repeated(calibrated: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """9 runs of the design; the optimum and the present cutter in three materials. One fails and is repeated."""
    study, folder = cutter(calibrated), StudyFolder(calibrated / "cutter")
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda one: Linear(study=one, broken=(5,)))
    planned = {one.stage: (one.rows, one.distinct_runs, one.to_run) for one in plan(study).stages}
    assert planned["optimise"] == (6, 6, 6)
    make_all(study, folder, HERE)
    counted = {one.stage: (one.rows, one.done, one.failed, one.left) for one in stage_states(study, folder).stages}
    assert counted["optimise"] == (6, 5, 1, 0)
    (failed,) = (row for row in ledger(study, folder) if row.status == "failed")
    assert (failed.stage, failed.run, failed.material) == ("optimise", 6, 1)
    monkeypatch.setattr(SOLVERS.named("embedded"), "make", lambda one: Linear(study=one))
    (again,) = retry(study, folder, HERE)
    assert (again.key, again.status, again.material) == (failed.key, "ok", 1)


def test_a_factor_is_not_taken_from_the_calibration(tmp_path: Path) -> None:
    (tmp_path / "out.yaml").write_text(SOURCE, encoding="utf-8")
    factor = "factors:\n  - {name: elastic_modulus, unit: MPa, low: 800, high: 1200}\n"
    study = cutter(tmp_path, CUTTER.replace("factors:\n", factor))
    values = study.parameters({"elastic_modulus": 900.0}, 8.0)
    assert (values["elastic_modulus"], values["tangent_modulus"]) == (900.0, 0.5)
