"""The first screen of the page: what the parameters are valid for, and what was assumed."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fakes import TWO_FACTORS

from stemcal.report.page.headline import scope
from stemcal.stages.invert.result import InvertResult
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"
PRIOR = SimpleNamespace(factor="skin_yield_stress", mean=15.0, sd=2.5, unit="MPa", source="Table 5")


def scope_of(path: Path, fitted: tuple[str, ...], settings: dict[str, str] | None = None, priors: Any = ()) -> Any:
    solved = SimpleNamespace(point=SimpleNamespace(solution=dict.fromkeys(fitted, 1.0)), depends_on=settings)
    solved.priors = priors
    return dict(scope(load_study(path), SimpleNamespace(of={InvertResult: solved}.get)))


def test_the_first_study_names_its_test_and_every_fixed_value() -> None:
    fitted, settings = (
        ("skin_yield_stress", "pith_yield_stress"),
        {"edge_spread": "d/7 (1.29 mm)", "skin_thickness": "d/9 (1 mm)"},
    )
    both = scope_of(CONFIGS / "wild-chrysanthemum.yaml", fitted, settings, [PRIOR])
    for part in (
        "stem diameter 7 to 11 mm",
        "the whole cut",
        "clearance between the supports 20 mm",
        "edge angle 37.5°",
        "100 mm/min",
    ):
        assert part in both["Valid for"]
    assert both["Valid for"].endswith("blade speed 100 mm/min and edge_spread d/7.")
    for part in ("density 1100 kg/m³", "elastic_modulus 1000 MPa", "poisson_ratio 0.3", "failure_strain 0.055"):
        assert part in both["Assumed"]
    for part in (
        "prior for skin_yield_stress of 15 MPa (standard deviation 2.5 MPa)",
        "friction 0.15 (static) and 0.1 (dynamic)",
        "0.41 times",
    ):
        assert part in both["Assumed"]
    assert "no effect of the strain rate" in both["Assumed"] and both["Assumed"].count("skin_thickness d/9") == 1


def test_material_keys_and_further_tests_are_named() -> None:
    both = scope_of(CONFIGS / "three-tests.yaml", ("elastic_modulus", "yield_stress", "failure_strain"))
    study = load_study(CONFIGS / "three-tests.yaml")
    assert all(f"the test `{test.name}`" in both["Valid for"] for test in study.tests)
    assert "poisson" in both["Assumed"].lower() and "density" in both["Assumed"]
    assert "elastic modulus" not in both["Assumed"]


@pytest.mark.parametrize(
    ("supports", "has", "lacks"),
    [
        ("kind: clamped, height: 40 mm", "cutting height 40 mm", "clearance"),
        (
            "kind: counter_edge, height: 40 mm, clearance: 0.5 mm",
            "clearance between the supports 0.5 mm, cutting height 40 mm",
            "20 mm",
        ),
    ],
)
def test_a_clamped_stem_has_a_height_instead_of_a_gap(tmp_path: Path, supports: str, has: str, lacks: str) -> None:
    cut = f"supports: {{{supports}}}\nloading: {{until: severed, speed: 3 m/s}}\n"
    (tmp_path / "cutter.yaml").write_text(TWO_FACTORS + cut + "targets:\n  - {diameter: 8 mm, force: 110 N}\n", "utf-8")
    both = scope_of(tmp_path / "cutter.yaml", ("yield_stress", "failure_strain"))
    assert has in both["Valid for"] and "blade speed 3000 mm/s" in both["Valid for"] and lacks not in both["Valid for"]
    assert "stem diameter 8 mm" in both["Valid for"]


def test_another_program_has_no_blade(tmp_path: Path) -> None:
    spec = """\
name: stove
factors: [{name: k, low: 1, high: 3}, {name: h, unit: kg, low: 2, high: 4}]
conditions: [{name: warmth, label: Warmth, unit: degC}]
responses: [{name: power, unit: W}]
solver: {kind: command, command: [none, "{{k}}", "{{h}}", "{{warmth}}"], result: {file: out.json, path: power}}
targets: [{warmth: 20, power: 5 W}, {warmth: 60, power: 9 W}]
"""
    (tmp_path / "stove.yaml").write_text(spec, "utf-8")
    both = scope_of(tmp_path / "stove.yaml", ("k",))
    assert both == {
        "Valid for": "warmth 20 to 60 degC.",
        "Assumed": "the middle of the ranges of all other factors (h 3 kg).",
    }


def test_before_a_calibration_there_is_none() -> None:
    nothing: Any = SimpleNamespace(of={}.get)
    assert scope(load_study(CONFIGS / "wild-chrysanthemum.yaml"), nothing) == []
