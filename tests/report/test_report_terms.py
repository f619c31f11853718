from typing import Any

import pytest


def test_surface_at_the_published_point(stages: dict[str, Any]) -> None:
    """The printed solution in coded units: the surface gives 159.26 N there."""
    at = {"yield_stress": 0.9966386554621854, "failure_strain": 0.87, "strain_rate_c": -0.45882352941176535}
    assert stages["rsm"].response_at(at) == pytest.approx(159.26003795, abs=1e-7)


def test_surface_at_the_solution_is_the_target(stages: dict[str, Any]) -> None:
    value = stages["rsm"].response_at(stages["invert"].point.coded)
    assert value == pytest.approx(159.2, abs=1e-9)
