"""Stepping from a surface that is a little off to the point that simulates the target."""

from collections.abc import Callable

import numpy as np
import pytest

from stemcal.arrays import Array
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.calibration.solution_ranges import solve_target
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.stages.refine.steps import FIRST_RADIUS, Trial, nearest_trial, next_trial, toward

Response = Callable[[Array], float]
TARGET = 160.0


def fitted(response: Response, trials: list[Trial] | None = None) -> Surface:
    coded = [*central_composite(2, 3, "rotatable"), *(trial.coded for trial in trials or [])]
    return fit_surface(coded, [response(x) for x in coded], ["a", "b"])


def region() -> Region:
    return Region(np.full(2, -2.0), np.full(2, 2.0), 2.0**0.5)


def steps_needed(response: Response, tolerance: float, budget: int = 30) -> int:
    start = np.array(solve_target(fitted(response), TARGET, [-2.0, -2.0], [2.0, 2.0], 2.0**0.5).point.coded)
    trials, radius = [Trial(start, np.array([response(start)]))], FIRST_RADIUS
    while abs(nearest_trial(trials, TARGET).response - TARGET) > tolerance and len(trials) < budget:
        coded, _, radius = next_trial(fitted(response, trials), TARGET, region(), trials, radius)
        assert region().contains(coded[None, :], 1e-9)[0]
        trials.append(Trial(coded, np.array([response(coded)])))
    return len(trials)


def smooth(x: Array) -> float:
    """Exponential, so that no quadratic is right: 120·exp(0.3a + 0.1b + 0.05ab)."""
    return float(120.0 * np.exp(0.3 * x[0] + 0.1 * x[1] + 0.05 * x[0] * x[1]))


def kinked(x: Array) -> float:
    """The slope changes fivefold near the target."""
    return float(150.0 + 10.0 * x[0] + (50.0 * (x[0] - 0.8) if x[0] > 0.8 else 0.0) + x[1])


def stepped(x: Array) -> float:
    """Jumps of 0.4, as of elements that break one by one."""
    return 0.4 * round(smooth(x) / 0.4)


@pytest.mark.parametrize(("response", "tolerance", "most"), [(smooth, 1e-6, 5), (kinked, 1e-3, 12), (stepped, 0.21, 4)])
def test_converges_to_the_simulated_target(response: Response, tolerance: float, most: int) -> None:
    assert steps_needed(response, tolerance) <= most


def test_toward_is_the_nearest_point_of_a_plane() -> None:
    """ŷ = 100 + 3a + 4b; from the origin the nearest point with ŷ = 105 is (3, 4)/5."""
    surface = fitted(lambda x: 100.0 + 3.0 * x[0] + 4.0 * x[1])
    assert toward(surface, 105.0, region(), np.zeros(2), 2.0) == pytest.approx([0.6, 0.8], abs=1e-9)
    assert toward(surface, 105.0, region(), np.zeros(2), 0.5) == pytest.approx([0.3, 0.4], abs=1e-9)
    assert np.linalg.norm(toward(surface, 120.0, region(), np.zeros(2), 9.0)) == pytest.approx(2.0**0.5)


def test_a_step_that_did_not_help_halves_the_radius_and_uses_the_bracket() -> None:
    surface = fitted(lambda x: 100.0 + 10.0 * x[0])
    trials = [Trial(np.array([a, 0.0]), np.array([force])) for a, force in ((0.0, 150.0), (1.0, 180.0))]
    coded, how, radius = next_trial(surface, TARGET, region(), trials, 1.0)
    assert (how, radius) == ("bracket", 0.5)
    assert coded == pytest.approx([1.0 / 3.0, 0.0])


def test_nearest_point_of_a_region_off_centre() -> None:
    cut = Region(np.array([0.5, -1.0]), np.array([3.0, 3.0]), 1.0)
    point = cut.nearest(np.array([3.0, 3.0]))
    assert np.linalg.norm(point) == pytest.approx(1.0)
    assert cut.contains(point[None, :], 1e-9)[0]
    assert cut.nearest(np.array([0.6, 0.1])) == pytest.approx([0.6, 0.1])
