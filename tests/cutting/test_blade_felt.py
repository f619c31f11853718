"""The blade's profile in the cutting force where elements fail by their strain."""

from dataclasses import replace
from math import cos, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest

from stemcal.cutting.build import build
from stemcal.cutting.parts import Loading, ShearTest
from stemcal.cutting.simulate import shear
from stemcal.fem.mesh import brick
from stemcal.fem.stepper import simulate
from stemcal.fem.tools import _gap_beside, _reach_beside, spread_edge
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

SPEC = Path(__file__).resolve().parents[2] / "configs" / "wild-chrysanthemum-as-published.yaml"


def shipped(**blade: object) -> ShearTest:
    """Return the centre of the shipped study with another blade."""
    study = load_study(SPEC)
    test = shear_test(study, study.midlevels(), 8.0)
    return replace(test, blade=replace(test.blade, **blade))


@pytest.mark.parametrize(("angle", "radius"), [(15.0, 0.1), (37.5, 0.02), (60.0, 0.5)])
def test_the_gap_is_that_from_rounding_and_flank(angle: float, radius: float) -> None:
    """√(s² + r²) − r beside the rounding, s cos β − r (1 − sin β) beside the flank; the bell reaches where it is a."""
    tool = build(shipped(edge_angle=angle, edge_radius=radius, edge_spread=1.0)).tools[0]
    half, s = radians(0.5 * angle), np.linspace(0.0, 1.5, 31)
    beside_flank = s * sin(half) > radius * cos(half)
    expected = np.where(
        beside_flank, s * cos(half) - radius * (1.0 - sin(half)), np.sqrt(s * s + radius * radius) - radius
    )
    np.testing.assert_allclose(_gap_beside(tool, s), expected, atol=1e-12)
    round_, flank = sqrt((1.0 + radius) ** 2 - radius**2), (1.0 + radius * (1.0 - sin(half))) / cos(half)
    reach = flank if flank * sin(half) > radius * cos(half) else round_
    assert _reach_beside(tool) == pytest.approx((reach, reach), abs=2e-3)


def test_an_edge_ground_on_one_side_bears_farther_on_that_side() -> None:
    left, right = _reach_beside(build(shipped(bevel="one", edge_spread=1.0)).tools[0])
    assert left == pytest.approx(sqrt(1.1**2 - 0.1**2), abs=2e-3)
    assert right == pytest.approx((1.0 + 0.1 * (1.0 - sin(radians(37.5)))) / cos(radians(37.5)), abs=2e-3)


@pytest.mark.parametrize("bevel", ["both", "one"])
def test_what_nodes_feel_is_as_wide_on_all_elements_of_up_to_0_56_spreads(bevel: str) -> None:
    """Each node between two samples takes its share of both: with h²/6 for that, the bell's variance is the same."""
    tool = build(shipped(bevel=bevel, edge_spread=1.0)).tools[0]

    def felt(h: float) -> tuple[float, float]:
        mesh = brick((8.0 * h, 1.0, 1.0), (8, 1, 1))
        nodes = mesh.nodes - np.array([4.0 * h, 0.0, 0.0])
        edge = spread_edge((tool,), nodes, mesh.hexes, h)
        middle = np.average(edge.across, weights=edge.weight)
        return float(middle), float(np.average((edge.across - middle) ** 2, weights=edge.weight)) + h * h / 6.0

    middle, variance = felt(0.56)
    assert felt(0.4) == pytest.approx((middle, variance), rel=1e-9, abs=1e-12)
    assert felt(0.1) == pytest.approx((middle, variance), rel=1e-9, abs=1e-12)
    assert felt(0.8)[1] - variance == pytest.approx((0.8**2 - 0.56**2) / 6.0, rel=1e-9)
    assert variance - 0.56**2 / 6.0 > 1.0 / 7.0  # that of (1 − s²)², which flanks make wider


@pytest.mark.slow
def test_force_rises_with_angle_and_radius() -> None:
    """At the centre of the shipped study."""

    def force(**blade: object) -> float:
        return shear(shipped(**blade)).peak_force

    angles = [force(edge_angle=angle) for angle in (15.0, 37.5, 60.0)]
    radii = [force(edge_radius=radius) for radius in (0.02, 0.1, 0.5)]
    assert np.all(np.diff(angles) > 0.0) and angles[2] > 1.02 * angles[0]
    assert np.all(np.diff(radii) > 0.0) and radii[2] > 1.08 * radii[0]


@pytest.mark.slow
def test_one_bevel_pushes_sideways_and_two_do_not() -> None:
    """By a few tenths of a percent of the force only: what the edge bears on lies mostly flat."""

    def sideways(bevel: str) -> float:
        test = shipped(bevel=bevel)
        how = replace(test.discretisation, symmetry="half")
        history = simulate(build(replace(test, discretisation=how, loading=Loading(duration=0.25))), 0.25)
        late = history.time > 0.2
        return float(np.abs(history.force[late, 0, 0]).mean() / history.force[late, 0, 2].mean())

    assert sideways("both") < 1e-5
    assert 1e-4 < sideways("one") < 1e-2
