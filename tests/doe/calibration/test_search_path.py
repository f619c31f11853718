"""The search along a path: laws whose answers are known, and the measured force of a mesh without lengths."""

from collections.abc import Callable
from math import exp, inf, log, nan

import numpy as np
import pytest

from stemcal.doe.calibration.search_path import Mover, SearchPath, Tried, best_of, ends_of, next_step
from stemcal.errors import UsageError

# ŷ ∝ ε^0.4 at ε = 0.04 (its range without zero), ŷ ∝ exp(0.1 σ)
STRAIN = Mover("strain", 0.04, 0.004, 1.0, 0.4 / 0.04)
STRESS = Mover("stress", 15.0, -20.0, 20.0, 0.1)
# 8 mm, 17.44 MPa, elements of 1 mm that fail each by itself, stroke 1.5 s: force over failure strain, as simulated.
STRAINS = (0.01, 0.02, 0.03524, 0.05, 0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5)
FORCES = (51.09, 58.53, 66.95, 74.34, 94.85, 119.61, 150.92, 180.54, 194.29, 199.63, 208.94)


def search(law: Callable[[dict[str, float]], float], aim: float, path: SearchPath, most: int = 30) -> list[Tried]:
    """Search until the response is within 0.1 %."""
    tried = [Tried(0.0, law(path.at(0.0)))]
    while not abs(tried[-1].response / aim - 1.0) <= 1e-3 and len(tried) < most:
        step = next_step(tried, aim, path)
        if step is None:
            break
        tried.append(Tried(step[0], law(path.at(step[0]))))
    return tried


def test_places_are_what_the_surface_expects() -> None:
    """ln ŷ grows by 0.4·ln(2) where the strain doubles, by 0.1 for each MPa."""
    path = SearchPath((STRAIN, STRESS))
    assert path.at(0.4 * log(2.0)) == {"strain": pytest.approx(0.08), "stress": 15.0}
    whole = 0.4 * log(1.0 / 0.04)
    assert path.ends == pytest.approx((-0.4 * log(10.0) - 3.5, whole + 0.5))
    assert path.at(whole + 0.3) == {"strain": pytest.approx(1.0), "stress": pytest.approx(18.0)}
    assert path.at(path.ends[0]) == {"strain": pytest.approx(0.004), "stress": pytest.approx(-20.0)}


def test_a_factor_that_lowers_the_response_goes_the_other_way() -> None:
    path = SearchPath((Mover("c", 90.0, 80.0, 100.0, -0.02),))
    assert path.at(0.02 * 90.0 * log(90.0 / 85.0)) == {"c": pytest.approx(85.0)}


def test_a_scale_alone_is_met_in_two_runs() -> None:
    """A response that is 0.8 times what the surface has, everywhere: the second run is right."""
    tried = search(lambda x: 0.8 * 100.0 * (x["strain"] / 0.04) ** 0.4, 100.0, SearchPath((STRAIN,)))
    assert len(tried) == 2 and tried[-1].response == pytest.approx(100.0)


def test_a_power_is_met_in_three_runs() -> None:
    """y = 70 (ε/0.04)^0.7: the second run determines the slope, the third is right."""
    tried = search(lambda x: 70.0 * (x["strain"] / 0.04) ** 0.7, 100.0, SearchPath((STRAIN,)))
    assert len(tried) == 3 and tried[-1].response == pytest.approx(100.0)


def test_what_is_expected_is_told() -> None:
    path = SearchPath((STRAIN,))
    first = next_step([Tried(0.0, 80.0)], 100.0, path)
    assert first is not None and first[1] == pytest.approx(100.0)
    far = next_step([Tried(0.0, 10.0)], 100.0, path)  # drawn in to three times the strain
    assert far is not None and far[1] == pytest.approx(10.0 * 3.0**0.4)


def test_the_measured_force_of_a_mesh_without_lengths() -> None:
    """From 67 to 159.2 N, where neither slope nor curvature is that of the surface: within 0.1 % in six runs."""
    strain = Mover("strain", 0.03524, 0.001, 1.0, 0.35 / 0.03524)
    tried = search(lambda x: float(np.interp(x["strain"], STRAINS, FORCES)), 159.2, SearchPath((strain,)))
    assert len(tried) <= 6 and tried[-1].response == pytest.approx(159.2, rel=1e-3)
    within = next(i for i, one in enumerate(tried, 1) if abs(one.response / 159.2 - 1.0) <= 0.02)
    assert within <= 5


def test_a_jump_is_bracketed() -> None:
    """Below ε = 0.3 80 N, above 200 N: 100 N is nowhere. Every step stays between the two sides."""
    tried = search(lambda x: 80.0 if x["strain"] < 0.3 else 200.0, 100.0, SearchPath((STRAIN,)), most=20)
    edge = 0.4 * log(0.3 / 0.04)
    below = max(one.place for one in tried if one.response == 80.0)
    above = min(one.place for one in tried if one.response == 200.0)
    assert below < edge <= above and above - below < 0.05


def test_the_end_of_the_range_is_the_end() -> None:
    tried = search(lambda x: 10.0 * (x["strain"] / 0.04) ** 0.1, 100.0, SearchPath((STRAIN,)))
    assert tried[-1].place == SearchPath((STRAIN,)).ends[1] and next_step(tried, 100.0, SearchPath((STRAIN,))) is None


def test_after_a_failed_run_it_goes_half_way_back() -> None:
    step = next_step([Tried(0.0, 80.0), Tried(0.4, nan)], 100.0, SearchPath((STRAIN,)))
    assert step == (0.2, None)
    aside = next_step([Tried(0.0, nan)], 100.0, SearchPath((STRAIN,)))
    assert aside == (0.1, None)
    assert next_step([Tried(0.0, nan), Tried(0.1, nan), Tried(-0.1, nan)], 100.0, SearchPath((STRAIN,))) is None
    assert best_of([Tried(0.0, nan)], 100.0) is None


def test_the_interval_is_that_of_the_measured_mean() -> None:
    """ε ∝ y^(1/0.5): a mean known by 3 % (as exact sd) leaves ε within ±1.96·3 %/0.5, by ratio."""
    tried = [Tried(0.0, 90.0), Tried(0.4 * log(1.2), 90.0 * 1.2**0.5)]
    low, high = ends_of(tried, tried[1], SearchPath((STRAIN,)), 0.03, inf)["strain"]
    assert (low, high) == pytest.approx((0.048 * exp(-1.959964 * 0.06), 0.048 * exp(1.959964 * 0.06)), rel=1e-6)


def test_a_factor_without_effect_is_refused() -> None:
    with pytest.raises(UsageError, match="density has no effect on the response surface"):
        SearchPath((Mover("density", 1100.0, 1000.0, 1200.0, 0.0),))
