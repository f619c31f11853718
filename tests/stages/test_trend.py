"""The advice for an error that follows the diameter, on forces that are known power laws."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from stemcal.doe.calibration.search_region import Region
from stemcal.doe.coding import Coding
from stemcal.stages.verdict.trend_advice import Fitted, _other_stems, remedies_of, trend_of

DIAMETERS = np.array([7.0, 8.0, 9.0, 10.0, 11.0])
CODING = Coding.from_ranges(("yield_stress", "failure_strain"), [10.0, 0.01], [20.0, 0.05])
NATURAL = 15.0, 0.03


@dataclass(frozen=True)
class Law:
    """F = 10 σ ε^(0.35 + s ln(d/8)) (d/8)²: the elasticity of ε changes with the diameter if s is not 0."""

    d: float
    s: float = 0.0

    def predict(self, coded: np.ndarray) -> np.ndarray:
        sigma, strain = CODING.to_natural(np.atleast_2d(coded)).T
        return self.force(sigma, strain)

    def force(self, sigma: np.ndarray | float, strain: np.ndarray | float) -> np.ndarray:
        return 10.0 * sigma * strain ** (0.35 + self.s * np.log(self.d / 8.0)) * (self.d / 8.0) ** 2

    def gradient(self, coded: np.ndarray) -> np.ndarray:
        step = 1e-6 * np.eye(2)
        return (self.predict(coded + step) - self.predict(coded - step)) / 2e-6


def fitted(measured: np.ndarray, s: float = 0.0) -> Fitted:
    region = Region(np.array([-1.0, -1.0]), np.array([1.0, 1.0]), None)
    laws = [Law(d, s) for d in DIAMETERS]
    solution = CODING.to_coded(NATURAL)
    return Fitted(DIAMETERS, measured, laws, CODING, region, 8.0, np.asarray(solution))  # type: ignore[arg-type]


@pytest.mark.parametrize("n", [-0.6, 0.3, 0.8])
def test_a_yield_stress_that_grows_is_found_with_its_exponent(n: float) -> None:
    measured = np.array([Law(d).force(14.0 * (d / 8.0) ** n, 0.03) for d in DIAMETERS])
    case = fitted(measured)
    law = trend_of(DIAMETERS.tolist(), measured.tolist(), case.predicted.tolist())
    assert law is not None and law.exponent == pytest.approx(n, abs=1e-6)
    best = next(one for one in remedies_of(case, CODING.names) if one.factor == "yield_stress")
    assert best.exponent == pytest.approx(n, abs=1e-3) and best.worst_percent < 0.01


def test_the_failure_strain_needs_the_exponent_over_its_elasticity() -> None:
    """F ~ ε^0.35: to grow as d^0.3 the failure strain grows as d^(0.3/0.35)."""
    measured = np.array([Law(d).force(14.0 * (d / 8.0) ** 0.3, 0.03) for d in DIAMETERS])
    best = next(one for one in remedies_of(fitted(measured), CODING.names) if one.factor == "failure_strain")
    assert best.exponent == pytest.approx(0.3 / 0.35, abs=0.01)


def test_a_common_factor_is_no_trend_and_needs_no_growth() -> None:
    rng = np.random.default_rng(41)
    for _ in range(6):
        simulated = fitted(DIAMETERS).predicted
        measured = 1.1 * simulated * (1.0 + 0.01 * rng.standard_normal(5))
        assert trend_of(DIAMETERS.tolist(), measured.tolist(), simulated.tolist()) is None


def test_levels_outside_the_ranges_are_not_advised() -> None:
    """d^2.5 more over 7 to 11 mm needs yield stresses over a factor of 3.1, and the range has 2."""
    measured = np.array([Law(d).force(14.0 * (d / 8.0) ** 2.5, 0.03) for d in DIAMETERS])
    assert all(one.worst_percent > 5.0 for one in remedies_of(fitted(measured), CODING.names))


def test_values_that_have_no_logarithm_are_left_out_with_their_diameter() -> None:
    """d^2.5 over d^2 at 8 to 11 mm, whatever a program returned at 7 mm."""
    d = [7.0, 8.0, 9.0, 10.0, 11.0]
    measured, simulated = [x**2.5 for x in d], [-1.0, *(x**2.0 for x in d[1:])]
    assert trend_of(d, measured, simulated, [1.0] * 5).exponent == pytest.approx(0.5)
    assert trend_of(d[:3], measured[:3], simulated[:3]) is None


def test_a_trend_within_the_known_scatter_is_none() -> None:
    """Means known to s are compatible with exponents up to 1.96 s/‖ln d − mean‖: d^0.5 needs s below 9.05 %."""
    d = [7.0, 8.0, 9.0, 10.0, 11.0]
    measured, simulated = [x**2.5 for x in d], [x**2.0 for x in d]
    most = 100.0 * 0.5 * float(np.std(np.log(d)) * 5**0.5) / 1.96
    assert most == pytest.approx(9.05, abs=0.1)
    assert trend_of(d, measured, simulated, [0.99 * most] * 5) is not None
    assert trend_of(d, measured, simulated, [1.01 * most] * 5) is None


@pytest.mark.parametrize(("growth", "missing"), [(0.5, "0.50 too low"), (-0.3, "0.30 too high")])
def test_other_stems_are_advised_only_where_they_can_be_simulated(growth: float, missing: str) -> None:
    ratio = SimpleNamespace(diameters=DIAMETERS, predicted=np.ones(len(DIAMETERS)), measured=DIAMETERS**growth)
    able, unable = SimpleNamespace(has_layers=True), SimpleNamespace(has_layers=False)
    assert missing in _other_stems(SimpleNamespace(is_layered=False, kind=able), ratio)  # type: ignore[arg-type]
    for study in (SimpleNamespace(is_layered=True, kind=able), SimpleNamespace(is_layered=False, kind=unable)):
        assert _other_stems(study, ratio) == ""  # type: ignore[arg-type]
