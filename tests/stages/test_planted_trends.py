"""Simulated materials that follow the diameter: the advice names the parameter, and its edit removes the error.

Of d/8 elements with the lengths of the published study ∂ln F/∂ln θ is 0.95 for the yield stress and 0.2 to 0.45 for the
failure strain; with lengths of d/5 the latter is 0.1, and no force shows how it follows the diameter.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from edits import merged

import stemcal
from stemcal.python.results import StudyResults

pytestmark = pytest.mark.slow

DIAMETERS = (7.0, 8.0, 9.5, 11.0)
SPEC = """\
name: planted
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: failure_strain, low: 0.01, high: 0.05}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05}
specimen: {length: 30 mm}
loading: {duration: 2.5 s}
solver: {kind: embedded, rate_law: none, element_size: d/8, mass_scaling: 3e4, time_step: 80 us, coarsening: 2}
screen: {design: none}
rsm: {factors: [yield_stress, failure_strain], centre_points: 1}
invert: {diameters: all}
targets:
"""
# The surfaces of so coarse a mesh miss by up to 3.5 %; runs at the solution correct them.
REFINE = "\nrefine: {tolerance_percent: 1, budget: 10}\n"
_UNSEEN = pytest.mark.xfail(strict=True, reason="with four forces the 95 % interval of the exponent includes 0")
PLANTED = [
    *[("yield_stress", *one) for one in [(15, 0.3), (14, 0.5), (13, 0.8), (13, 1.0), (15, -0.3), (16, -0.7)]],
    *[("failure_strain", *one) for one in [(0.03, 0.5), (0.025, 0.8), (0.022, 1.0), (0.03, -0.5), (0.035, -1.0)]],
    pytest.param("failure_strain", 0.035, -0.8, marks=_UNSEEN),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that all studies share: they differ in their targets, so most runs are the same."""
    return tmp_path_factory.mktemp("planted")


def with_targets(folder: Path, materials: list[dict[str, float]], factor: np.ndarray | float = 1.0) -> str:
    """Return the spec with the forces of these materials, one per diameter, times a factor each."""
    path = folder / "unmeasured.yaml"
    path.write_text(f"{SPEC}  - {{diameter: 8 mm, force: 100 N}}\n", encoding="utf-8")
    simulated = [stemcal.simulate(path, d, **levels).peak_force for d, levels in zip(DIAMETERS, materials, strict=True)]
    rows = zip(DIAMETERS, np.array(simulated) * factor, strict=True)
    return SPEC + "".join(f"  - {{diameter: {d:g} mm, force: {force:.6g} N}}\n" for d, force in rows)


def calibrated(text: str, folder: Path) -> StudyResults:
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return stemcal.calibrate(path, out=folder / "out", progress=False)


@pytest.mark.parametrize(("parameter", "value", "exponent"), PLANTED)
def test_the_planted_parameter_is_named_and_the_edit_removes_the_error(
    parameter: str, value: float, exponent: float, folder: Path
) -> None:
    common = {"yield_stress": 15.0, "failure_strain": 0.03}
    text = with_targets(folder, [common | {parameter: value * (d / 8.0) ** exponent} for d in DIAMETERS])
    before = calibrated(text, folder).verdict
    reason = next(one for one in before.reasons if one.kind == "trend")  # so coarse a mesh has other troubles too
    assert reason.remedy is not None
    assert parameter in re.findall(r"(\w+) proportional", reason.remedy.text)
    after = calibrated(merged(text, reason.remedy.edit) + REFINE, folder)
    assert after.validation.worst_percent is not None and after.validation.worst_percent <= 3.0
    assert not after.verdict.has("trend")


@pytest.mark.parametrize("seed", range(6))
def test_scatter_without_a_trend_gets_no_advice_about_growth(seed: int, folder: Path) -> None:
    rng = np.random.default_rng(seed)
    material = {"yield_stress": rng.uniform(12.0, 18.0), "failure_strain": rng.uniform(0.015, 0.045)}
    text = with_targets(folder, [material] * len(DIAMETERS), 1.0 + 0.02 * rng.standard_normal(len(DIAMETERS)))
    assert not calibrated(text, folder).verdict.has("trend")


def test_the_advice_leads_from_the_published_study_to_a_calibrated_one(folder: Path) -> None:
    """Edits that any user merges: a longer stroke, all diameters, then a yield stress that grows; none comes twice."""
    spec = Path(__file__).parents[2] / "configs" / "wild-chrysanthemum-as-published.yaml"
    text = spec.read_text(encoding="utf-8")
    edits: list[str] = []
    after = calibrated(text, folder)
    while (remedy := after.verdict.reasons[0].remedy) is not None and remedy.edit is not None and len(edits) < 4:
        assert remedy.edit not in edits
        edits.append(remedy.edit)
        text = merged(text, remedy.edit)
        after = calibrated(text, folder)
    assert "duration" in edits[0] and "diameters: all" in edits[1] and "growth" in edits[2], edits
    assert after.verdict.holds and not after.verdict.has("trend")
    assert after.validation.worst_percent is not None and after.validation.worst_percent <= 6.0
