"""The material of a calibration at some levels, other materials that fit as well, and mistakes of the reference."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fakes import TWO_FACTORS
from known_results import Known, known, spec_of
from planting import Law
from test_borrowed_material import CUTTER, SOURCE, cutter

from stemcal.errors import SpecError
from stemcal.runs.study_folder import StudyFolder
from stemcal.stages.fitting import fit_of_study
from stemcal.stages.optimise import material
from stemcal.stages.optimise.material import Borrowed, calibrated_sections
from stemcal.stages.results import Results
from stemcal.stages.rsm.result import RsmResult
from stemcal.study.model.shear_test import Relative
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study


def study_of(folder: Path, text: str) -> Study:
    (folder / "study.yaml").write_text(text, encoding="utf-8")
    return load_study(folder / "study.yaml")


ROWS = "targets: [{diameter: 8 mm, force: 110 N}, {diameter: 10 mm, force: 171 N}]\n"
GROWING = TWO_FACTORS.replace("factors:\n", "factors:\n  - {name: growth, low: -0.5, high: 1.5}\n").replace(
    "material: {", "material: {yield_stress: {at: 8 mm, exponent: growth}, "
)


def test_levels_become_values_and_exponents(tmp_path: Path) -> None:
    study = study_of(tmp_path, f"{GROWING}rsm: {{factors: [yield_stress, growth]}}\ninvert: {{diameters: all}}\n{ROWS}")
    found = calibrated_sections(study, {"yield_stress": 17.0, "failure_strain": 0.02, "growth": 0.75})
    assert set(found) == {"material", "layers", "contact"} and found["layers"] == ()
    grown = found["material"].yield_stress
    assert (grown.value, grown.at, grown.exponent) == (17.0, 8.0, 0.75)
    assert found["material"].failure_strain == 0.02 and found["material"].elastic_modulus == 1000.0
    fixed = GROWING.replace("exponent: growth", "exponent: 0.5").replace(
        "  - {name: growth, low: -0.5, high: 1.5}\n", ""
    )
    study = study_of(tmp_path, f"{fixed}rsm: {{factors: [yield_stress]}}\n{ROWS}")
    grown = calibrated_sections(study, {"yield_stress": 17.0, "failure_strain": 0.02})["material"].yield_stress
    assert (grown.value, grown.exponent) == (17.0, 0.5)


def test_friction_and_a_ratio_across_the_axis(tmp_path: Path) -> None:
    more = (
        "factors:\n  - {name: stem_friction, low: 0.1, high: 0.5}\n"
        "  - {name: transverse_yield_stress, low: 0.2, high: 0.5}\n"
        "  - {name: transverse_elastic_modulus, unit: MPa, low: 100, high: 300}\n"
    )
    text = TWO_FACTORS.replace("factors:\n", more).replace("material: {", "material: {transverse: {}, ")
    study = study_of(tmp_path, f"{text}rsm: {{factors: [yield_stress]}}\n{ROWS}")
    levels = {
        **study.midlevels(),
        "stem_friction": 0.4,
        "transverse_yield_stress": 0.25,
        "transverse_elastic_modulus": 200.0,
    }
    found = calibrated_sections(study, levels)
    assert (found["contact"].static_friction, found["contact"].dynamic_friction) == (0.4, 0.4)
    across = found["material"].transverse
    assert across.yield_stress == Relative(0.25, is_ratio=True)
    assert across.elastic_modulus == Relative(200.0, is_ratio=False)


@pytest.fixture(scope="module")
def joint(tmp_path_factory: pytest.TempPathFactory) -> Known:
    law = Law(growth=0.3)
    measured = {d: law.at(0.2, 0.3, d)[0] for d in (7.0, 8.0, 10.0)}
    spec = spec_of(measured, "invert: {diameters: all}\n", ", sd: 3 N, n: 9")
    return known(tmp_path_factory.mktemp("joint"), spec, law)


def test_other_materials_are_a_standard_deviation_away(joint: Known) -> None:
    """Along the axes of (JᵀWJ + 12/width²)⁻¹, the widest first; together they have the covariance."""
    surface: RsmResult = joint.of(RsmResult)
    levels = list(material._other_levels(joint.study, joint.results))
    width = surface.region.high - surface.region.low
    information = fit_of_study(joint.study, surface).tangents.information + np.diag(12.0 / width**2)
    best = surface.scales.to_coded([joint.results.parameters[name] for name in surface.names])
    away = [surface.scales.to_coded([each[name] for name in surface.names]) - best for each in levels]
    assert sum(np.outer(x, x) for x in away) == pytest.approx(np.linalg.inv(information), rel=1e-6)
    assert [np.linalg.norm(x) for x in away] == sorted((np.linalg.norm(x) for x in away), reverse=True)
    assert list(levels[0]) == list(joint.study.midlevels())
    without: Any = Results(tuple(result for result in joint.results.done if result.name != "rsm"))
    assert list(material._other_levels(joint.study, without)) == []


def test_a_step_beyond_the_ranges_goes_the_other_way(joint: Known) -> None:
    """At the end of a range the step inwards is longer, and no level is outside."""
    surface: RsmResult = joint.of(RsmResult)
    end = {**joint.results.parameters, "yield_stress": 20.0}
    moved: Any = SimpleNamespace(done=joint.results.done, parameters=end)
    for levels in material._other_levels(joint.study, moved):
        x = surface.scales.to_coded([levels[name] for name in surface.names])
        assert np.all((x >= surface.region.low - 1e-9) & (x <= surface.region.high + 1e-9))
        assert levels["yield_stress"] <= 20.0 + 1e-9


# ---- mistakes of the reference


def refused(folder: Path, text: str = CUTTER) -> str:
    with pytest.raises(SpecError) as error:
        cutter(folder, text)
    return str(error.value)


def test_a_reference_to_nothing(tmp_path: Path) -> None:
    run = "run the calibration that writes this folder with `stemcal run SPEC`"
    assert f"out does not exist; {run}" in refused(tmp_path)
    (tmp_path / "out").mkdir()
    assert f"out has no spec; {run}" in refused(tmp_path)
    (tmp_path / "out.yaml").write_text(SOURCE.replace("low: 10", "low: 30"), encoding="utf-8")
    message = refused(tmp_path)
    assert "the spec of the study has mistakes: " in message and message.endswith("; correct them")


def test_a_calibration_that_is_not_finished(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out.yaml").write_text(SOURCE, encoding="utf-8")
    message = refused(tmp_path)
    assert "the study is not calibrated yet; run `stemcal run " in message and "out.yaml`" in message


@pytest.mark.parametrize(
    ("stale", "calibrated", "holds", "message", "remedy"),
    [
        (("a.json is out of date (x changed). Run `stemcal a SPEC` again.", "b"), True, True,
         "the study is out of date: a.json is out of date (x changed)", "run `stemcal run out.yaml`"),
        ((), False, True, "the study is not calibrated yet", "run `stemcal run out.yaml`"),
        ((), True, False, "the study is not calibrated: It does not fit.",
         "correct it, then run `stemcal run out.yaml`"),
        ((), True, True, None, None),
    ],
)  # fmt: skip
def test_why_a_calibration_is_not_used(
    monkeypatch: pytest.MonkeyPatch, stale: tuple[str, ...], calibrated: bool, holds: bool, message: Any, remedy: Any
) -> None:
    results = SimpleNamespace(stale=stale, calibrated=calibrated)
    verdict = SimpleNamespace(holds=holds, reasons=[SimpleNamespace(text="It does not fit. More.")])
    monkeypatch.setattr(material, "fresh_results", lambda _source, _place: results)
    monkeypatch.setattr(material, "verdict_of", lambda _source, _place, _results: verdict)
    borrowed, unused = Borrowed(), None
    found = material._finished(borrowed, unused, unused, "out.yaml")  # type: ignore[arg-type]
    assert (found is results) is (message is None)
    assert [(one.message, one.remedy, one.path) for one in borrowed.findings] == (
        [] if message is None else [(message, remedy, ("material", "from"))]
    )


def test_a_folder_in_the_current_one_is_shown_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert material._shown(tmp_path / "a" / "b.yaml") == "a/b.yaml"
    assert material._shown(tmp_path.parent / "b.yaml") == str(tmp_path.parent / "b.yaml")


def test_the_paper_law_is_for_the_speed_of_the_calibration(tmp_path: Path) -> None:
    """Up to a hundred times 1.667 mm/s."""
    (tmp_path / "out.yaml").write_text(SOURCE, encoding="utf-8")
    source = load_study(tmp_path / "out.yaml")
    most = 100.0 * source.loading.speed

    def at(speed: str) -> str:
        return CUTTER.replace("stroke: d/1", f"stroke: d/1, speed: {speed}")

    assert cutter(tmp_path, at(f"{0.999 * most:.6g} mm/s")).loading.speed < most
    message = refused(tmp_path, at(f"{1.001 * most:.6g} mm/s"))
    assert (
        "`rate_law: paper` is valid near the speed of the calibration (1.67 mm/s), but the blade has up to " in message
    )
    assert message.endswith("calibrate the material with `solver: {rate_law: none}`")
    factor = CUTTER.replace("thickness, unit: mm, low: 1, high: 4}", "speed, unit: mm/s, low: 2, high: 200}")
    assert "but the blade has up to 200 mm/s" in refused(
        tmp_path, factor.replace("edge_angle, thickness", "edge_angle, speed")
    )
    (tmp_path / "out.yaml").write_text(SOURCE.replace("rate_law: paper", "rate_law: cowper_symonds"), encoding="utf-8")
    assert cutter(tmp_path, at("1 m/s")).solver.rate == "cowper_symonds"


def test_a_study_that_is_not_run_yet_has_the_middle_of_its_ranges(tmp_path: Path) -> None:
    (tmp_path / "out.yaml").write_text(SOURCE, encoding="utf-8")
    study = cutter(tmp_path)
    assert study.material.yield_stress == 15.0 and study.materials == ()
    assert study.pending.startswith("material.from: out does not exist. Run `stemcal run ")
    assert StudyFolder(tmp_path / "out").path == tmp_path / "out"
    assert replace(Borrowed(), pending="x").pending == "x"
