"""Material parameters that follow the diameter: value(d) = value·(d/at)^exponent."""

from pathlib import Path

import pytest

from stemcal.cli.simulate import require_material
from stemcal.errors import SpecError, UsageError
from stemcal.solvers.deck import Deck, deck_text
from stemcal.solvers.embedded import Embedded, shear_test
from stemcal.solvers.protocol import Request
from stemcal.study.model.growth import Growth
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study
from stemcal.study.rules.factors import wrong_levels

GROWING = Path(__file__).parents[2] / "cases" / "good" / "growing.yaml"


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(GROWING)


@pytest.mark.parametrize(("d", "value"), [(8.0, 15.0), (2.0, 7.5), (32.0, 30.0)])
def test_a_power_of_the_diameter(d: float, value: float) -> None:
    assert Growth(at=8.0, exponent=0.5, value=15.0).parameter_at(d, None, {}) == pytest.approx(value)
    assert Growth(at=8.0, exponent="g").parameter_at(d, 15.0, {"g": 0.5}) == pytest.approx(value)


def test_each_stem_has_its_own_material(study: Study) -> None:
    levels = {"yield_stress": 12.0, "growth": 1.0}
    thin, thick = (shear_test(study, levels, d).material for d in (7.0, 11.0))
    assert (thin.yield_stress, thick.yield_stress) == pytest.approx((12.0 * 7 / 8, 12.0 * 11 / 8))
    assert (thin.elastic_modulus, thick.elastic_modulus) == pytest.approx((1000 * 0.7**0.5, 1000 * 1.1**0.5))
    assert (thin.tangent_modulus, thick.tangent_modulus) == pytest.approx((0.5 * 7 / 9, 0.5 * 11 / 9))
    assert (thin.failure_strain, thick.failure_strain) == (0.03, 0.03)


def test_a_level_in_another_unit_grows_alike() -> None:
    other = load_study(GROWING, yield_stress={"unit": "kPa", "low": 10_000, "high": 20_000})
    assert other.parameters({"growth": 1.0}, 10.0)["yield_stress"] == pytest.approx(15.0 * 10 / 8)


def test_where_the_exponent_changes_nothing_its_runs_share_a_record(study: Study) -> None:
    def identity(growth: float, d: float) -> object:
        return Embedded(study).identity(Request("rsm", 0, {**study.midlevels(), "growth": growth}, d))

    assert identity(0.0, 8.0) == identity(1.0, 8.0)
    assert identity(0.0, 9.0) != identity(1.0, 9.0)


def test_a_deck_has_the_values_of_its_stem(study: Study) -> None:
    levels = {**study.midlevels(), "growth": 1.0}
    deck = Deck.of(study, levels, 10.0)
    assert deck.material["sigy"] == pytest.approx(15.0 * 10 / 8)
    assert deck.material["e"] == pytest.approx(1000.0)
    assert "18.75" in deck_text(deck) and "18.75" not in deck_text(Deck.of(study, levels, 8.0))


def test_levels_that_no_stem_of_this_diameter_can_have() -> None:
    steep = {"value": "100 MPa", "at": "8 mm", "exponent": 4}
    stiff = load_study(GROWING, material={"tangent_modulus": steep, "poisson_ratio": 0.3})
    levels = stiff.midlevels()
    assert list(wrong_levels(stiff, levels, 8.0)) == []
    with pytest.raises(UsageError, match="`tangent_modulus` must be below `elastic_modulus`"):
        require_material(stiff, levels, 16.0)


def test_a_screening_that_cannot_see_the_exponent_is_questioned(study: Study) -> None:
    given = load_study(GROWING, rsm={"factors": "significant"}).warnings
    found = [text for text in given if "growth has no effect at" in text]
    assert len(found) == 1 and "material.yield_stress.at" in found[0] and "rsm.factors" in found[0]
    assert not any("has no effect at" in text for text in study.warnings)


def test_what_no_exponent_can_be_is_refused(study: Study) -> None:
    (wrong,) = wrong_levels(study, {**study.midlevels(), "growth": 1e9}, 9.0)
    assert wrong.startswith("yield_stress (inf MPa) is not between -1e+30 and 1e+30")
    for change, said in (
        ({"unit": "MPa"}, "an exponent is dimensionless"),
        ({"high": 30}, "use values from -20 to 20"),
    ):
        with pytest.raises(SpecError, match=said):
            load_study(GROWING, growth=change)
