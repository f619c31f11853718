"""Settings of the test as factors: equal to the same values in their sections."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.writer import deck_text
from stemcal.solvers.embedded import shear_test, simulate_levels
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.rules.factors import wrong_levels
from stemcal.study.types.factor import SETTINGS

SPEC = Path(__file__).parents[2] / "cases" / "good" / "settings.yaml"
LEVELS = {
    "edge_angle": (25.0, "25 deg"), "sliding_angle": (20.0, "20 deg"),
    "edge_radius": (0.2, "0.2 mm"), "thickness": (2.0, "2 mm"),
    "speed": (0.5, "500 mm/s"), "clearance": (12.0, "12 mm"), "outer_diameter": (8.5, "8.5 mm"),
    "diameter_ratio": (0.45, 0.45), "height": (12.0, "12 mm"), "fillet_radius": (0.5, "0.5 mm"),
}  # fmt: skip


def both(folder: Path, name: str) -> tuple[Study, dict[str, float], Study]:
    """Return a study with a setting as its factor, the level, and the study with the value in the section."""
    data: dict[str, Any] = yaml.safe_load(SPEC.read_text("utf-8"))
    if name == "height":
        data["supports"] = {"kind": "clamped"}
    strength = data["factors"][-1]
    varied = {"name": name, "unit": "deg" if "angle" in name else "mm", "low": 10, "high": 20}
    if name == "fillet_radius":
        varied |= {"low": 0.3, "high": 2}
    varied = next((one for one in data["factors"] if one["name"] == name), varied)
    level, written = LEVELS[name]
    fixed = {**data, "factors": [strength]}
    fixed[SETTINGS[name].section] = {**data.get(SETTINGS[name].section, {}), name: written}
    studies = []
    for called, one in {"varied": {**data, "factors": [varied, strength]}, "fixed": fixed}.items():
        (folder / f"{called}.yaml").write_text(yaml.safe_dump(one), "utf-8")
        studies.append(load_study(folder / f"{called}.yaml"))
    return studies[0], {name: level, "yield_stress": 15.0}, studies[1]


@pytest.mark.parametrize("name", SETTINGS)
def test_the_test_of_a_level_is_that_of_the_section(name: str, tmp_path: Path) -> None:
    varied, levels, fixed = both(tmp_path, name)
    diameter = fixed.specimen.outer_diameter
    test = shear_test(varied, levels, 8.0)
    assert test == shear_test(fixed, {"yield_stress": 15.0}, diameter)
    assert test != shear_test(varied, {}, 8.0)
    assert list(wrong_levels(varied, levels, 8.0)) == []


@pytest.mark.parametrize("name", SETTINGS)
def test_the_deck_of_a_level_is_that_of_the_section(name: str, tmp_path: Path) -> None:
    varied, levels, fixed = both(tmp_path, name)
    decks = [Deck.of(varied, levels, 8.0), Deck.of(fixed, {"yield_stress": 15.0}, fixed.specimen.outer_diameter)]
    first, second = (deck_text(deck).split("*KEYWORD", 1)[1] for deck in decks)
    assert first == second != deck_text(Deck.of(varied, {}, 8.0)).split("*KEYWORD", 1)[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", SETTINGS)
def test_the_force_of_a_level_is_that_of_the_section(name: str, tmp_path: Path) -> None:
    varied, levels, fixed = both(tmp_path, name)
    forces = [simulate_levels(varied, levels).peak_force, simulate_levels(fixed, {"yield_stress": 15.0}).peak_force]
    assert forces[0] == forces[1] > 0.0


def test_levels_beyond_physics_are_refused() -> None:
    study = load_study(SPEC)
    (wrong,) = wrong_levels(study, {**study.midlevels(), "edge_angle": 190.0})
    assert "edge_angle (190 deg) must be below 180 deg" in wrong
    (wrong,) = wrong_levels(study, study.midlevels(), 7.3)
    assert "outer_diameter" in wrong
