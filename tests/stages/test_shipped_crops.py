"""The shipped specs of other crops: a stalk with two layers and a cane with fibres, from check to verdict."""

from pathlib import Path

import pytest

import stemcal
from stemcal.python.results import StudyResults
from stemcal.study.model.layers import layers_at
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


def results_of(name: str, folder: Path) -> StudyResults:
    return stemcal.calibrate(CONFIGS / f"{name}.yaml", out=folder, progress=False)


def test_the_published_values_are_in_the_specs() -> None:
    phloem, xylem = layers_at(load_study(CONFIGS / "hemp-two-layers.yaml"), {}, 9.3)
    assert (phloem.along["elastic_modulus"], xylem.along["elastic_modulus"]) == (3607.5, 1343.5)
    assert phloem.across is None and phloem.thickness == 0.5
    (cane,) = layers_at(load_study(CONFIGS / "grapevine.yaml"), {"transverse_elastic_modulus": 79.8}, 8.0)
    assert cane.across is not None and cane.across["elastic_modulus"] == 79.8
    assert cane.across["yield_stress"] == pytest.approx(0.2 * cane.along["yield_stress"])


@pytest.mark.slow
def test_hemp_is_calibrated_to_its_force(tmp_path: Path) -> None:
    """One force and one unknown: the simulated force is within 2 % of 243 N, nothing is left to correct but data."""
    found = results_of("hemp-two-layers", tmp_path)
    assert 16.0 < found.parameters["phloem_yield_stress"] < 25.0
    (row,) = found.validation.judged(load_study(CONFIGS / "hemp-two-layers.yaml"))
    assert row.fitted and row.size < 2.0
    assert found.verdict.holds and not {reason.kind for reason in found.verdict.reasons} - {"unchecked"}


@pytest.mark.slow
def test_grapevine_has_the_planted_moduli(tmp_path: Path) -> None:
    found = results_of("grapevine", tmp_path)
    planted = {"elastic_modulus": 797.0, "transverse_elastic_modulus": 79.8, "yield_stress": 15.0}
    for name, value in planted.items():
        low, high = found.inversion.certainty.intervals[name]
        assert low < value < high and high - low < 0.4 * value, name
    assert found.verdict.holds and not {reason.kind for reason in found.verdict.reasons} - {"unchecked"}
