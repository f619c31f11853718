"""A goal instead of targets: its responses, units and the condition of its surfaces."""

from math import isnan
from pathlib import Path

import pytest

from stemcal.errors import SpecError
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

EMBEDDED = """\
name: cutter
factors:
  - {name: edge_angle, unit: deg, low: 15, high: 60}
  - {name: speed, unit: m/s, low: 0.5, high: 3}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, yield_stress: 15 MPa,
  tangent_modulus: 0.5 MPa, hardening_parameter: 0.05, failure_strain: 0.03}
specimen: {outer_diameter: 10 mm}
loading: {until: severed}
solver: {rate_law: none}
screen: {design: none}
rsm: {factors: [edge_angle, speed]}
"""
OWN = """\
name: own
responses: [{name: energy, unit: J}, {name: mass, unit: g}]
factors: [{name: a, low: 0, high: 1}, {name: b, low: 0, high: 1}]
solver: {kind: sheet}
screen: {design: none}
rsm: {factors: [a, b]}
"""


def read(folder: Path, text: str) -> Study:
    path = folder / "spec.yaml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


def test_goal_of_the_cutting_test(tmp_path: Path) -> None:
    """Responses have their places among those of a cut, limits their units, surfaces the diameter of the specimen."""
    goal = "goal: {minimise: [cutting_energy, force], at_most: {force: 0.15 kN, travel: 1 cm}}\n"
    study = read(tmp_path, EMBEDDED + goal)
    assert study.goal is not None
    assert study.goal.signs == {"cutting_energy": 1.0, "response": 1.0}
    assert study.goal.at_most == pytest.approx({"response": 150.0, "travel": 10.0})
    assert study.naming.response.name == "force"
    assert [one.name for one in study.naming.further] == ["travel", "work", "cutting_energy"]
    assert study.fitted_responses == ("response", "cutting_energy", "travel")
    (place,) = study.joint_targets
    assert place.condition == study.targets.calibrate_at == 10.0
    assert isnan(place.response)
    assert study.targets.means == ()


def test_goal_of_a_program(tmp_path: Path) -> None:
    """A declared response has its own unit; the study has no condition."""
    study = read(tmp_path, f"{OWN}goal: {{maximise: [mass], at_most: {{energy: 500 mJ}}}}\n")
    assert study.goal is not None
    assert study.goal.signs == {"mass": -1.0}
    assert study.goal.at_most == pytest.approx({"response": 0.5})
    assert study.targets.calibrate_at == 0.0
    assert study.naming.condition is None


def mistakes(folder: Path, text: str) -> list[str]:
    """Return the path of each mistake of a spec."""
    with pytest.raises(SpecError) as caught:
        read(folder, text)
    return [one.path for one in caught.value.problems]


def test_each_wrong_limit_is_found_at_its_key(tmp_path: Path) -> None:
    """All at once: an unknown response, a wrong unit, no number, a value of 0; and one that needs a whole cut."""
    limits = "{fource: 150 N, travel: 3 N, force: many, work: 0 mJ}"
    found = mistakes(tmp_path, f"{EMBEDDED}goal: {{minimise: [force], at_most: {limits}}}\n")
    assert found == [f"goal.at_most.{name}" for name in ("fource", "travel", "force", "work")]
    early = EMBEDDED.replace("until: severed", "until: first_fracture")
    found = mistakes(tmp_path, f"{early}goal: {{minimise: [force], at_most: {{cutting_energy: 1 J}}}}\n")
    assert [path for path in found if path.startswith("goal")] == ["goal.at_most.cutting_energy"]
    found = mistakes(tmp_path, f"{OWN}goal: {{minimise: [mass], at_most: {{energy: 5 N}}}}\n")
    assert found == ["goal.at_most.energy"]
