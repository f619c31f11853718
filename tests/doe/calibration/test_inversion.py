from itertools import product

import numpy as np
import pytest

from stemcal.doe.calibration.search_region import Region
from stemcal.doe.calibration.solution_ranges import assess_point, solve_target
from stemcal.doe.coding import term_columns, term_names
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import TargetUnreachable, UsageError

ALPHA = 8**0.25
TARGET = 159.2


def natural(calibration, coding):
    return [float(v) for v in coding.to_natural(calibration.point.coded)]


@pytest.fixture(scope="module")
def in_sphere(ccd, box):
    return solve_target(ccd, TARGET, *box, radius=ALPHA)


@pytest.fixture(scope="module")
def in_box(ccd, box):
    return solve_target(ccd, TARGET, *box)


def test_least_coded_distance(in_sphere, coding):
    assert natural(in_sphere, coding) == pytest.approx([18.3687, 0.031840, 90.0525], rel=2e-5)
    assert in_sphere.point.response == pytest.approx(TARGET, abs=1e-6)
    assert in_sphere.point.coded_radius == pytest.approx(1.14889, abs=1e-5)
    assert in_sphere.point.mean_interval == pytest.approx((153.93, 164.47), abs=0.01)
    assert in_sphere.point.prediction_interval == pytest.approx((147.10, 171.30), abs=0.01)


def test_nearest_point_satisfies_lagranges_condition(in_sphere, ccd):
    """At the nearest point of a level surface the way from the centre is along the gradient."""
    x, slope = np.array(in_sphere.point.coded), ccd.gradient(in_sphere.point.coded)
    assert float(x @ slope) / np.linalg.norm(x) / np.linalg.norm(slope) == pytest.approx(1.0, abs=1e-9)


def test_others_at_centre(ccd, box, coding):
    calibration = solve_target(ccd, TARGET, *box, radius=ALPHA, rule="others_at_centre")
    assert natural(calibration, coding) == pytest.approx([18.458, 0.03, 90.0], abs=5e-4)
    assert calibration.point.response == pytest.approx(TARGET, abs=1e-9)


def test_ranges_inside_the_sphere(in_sphere, coding):
    ranges = dict(zip(coding.names, coding.to_natural(np.array(in_sphere.ranges).T).T, strict=True))
    assert ranges["X4"] == pytest.approx([17.626, 18.964], abs=1e-3)
    assert ranges["X9"] == pytest.approx([0.01971, 0.04397], abs=1e-5)
    assert ranges["X7"] == pytest.approx([82.054, 98.259], abs=1e-3)


def test_ranges_inside_the_box(in_box, coding):
    ranges = dict(zip(coding.names, coding.to_natural(np.array(in_box.ranges).T).T, strict=True))
    assert ranges["X4"] == pytest.approx([16.334, 19.478], abs=1e-3)
    assert ranges["X9"] == pytest.approx([0.01, 0.05], abs=1e-9)
    assert ranges["X7"] == pytest.approx([80.0, 100.0], abs=1e-6)


def test_ranges_enclose_a_fine_grid_and_are_not_wider(in_sphere, ccd, box):
    """Scan X9 and X7, solve each row for X4 by the quadratic formula."""
    b = dict(zip(term_names("abc"), ccd.beta, strict=True))
    u, v = np.meshgrid(np.linspace(-ALPHA, ALPHA, 801), np.linspace(-ALPHA, ALPHA, 801))
    q2, q1 = b["a^2"], b["a"] + b["a:b"] * u + b["a:c"] * v
    q0 = b["1"] - TARGET + b["b"] * u + b["c"] * v + b["b:c"] * u * v + b["b^2"] * u**2 + b["c^2"] * v**2
    x = (-q1 + np.sqrt(q1**2 - 4 * q2 * q0)) / (2 * q2)
    points = np.column_stack([x.ravel(), u.ravel(), v.ravel()])
    points = points[Region(*box, ALPHA).contains(points)]
    for j, (low, high) in enumerate(in_sphere.ranges):
        assert low <= points[:, j].min() + 1e-9
        assert high >= points[:, j].max() - 1e-9
        assert (low, high) == pytest.approx((points[:, j].min(), points[:, j].max()), abs=0.01)
    assert in_sphere.point.coded_radius == pytest.approx(np.linalg.norm(points, axis=1).min(), abs=1e-4)


def test_reachable_by_a_grid(ccd, box, in_sphere):
    axis = np.linspace(-ALPHA, ALPHA, 81)
    points = np.array(list(product(axis, axis, axis)))
    values = ccd.predict(points[Region(*box, ALPHA).contains(points)])
    low, high = in_sphere.reachable
    assert low <= values.min() and high >= values.max()
    assert (low, high) == pytest.approx((values.min(), values.max()), abs=1.5)


@pytest.mark.parametrize("target", [40.0, 500.0])
def test_an_unreachable_target_names_what_is_reachable(ccd, box, target, in_sphere):
    with pytest.raises(TargetUnreachable) as caught:
        solve_target(ccd, target, *box, radius=ALPHA)
    assert (caught.value.low, caught.value.high) == pytest.approx(in_sphere.reachable)
    assert caught.value.exit_code == 4


def test_a_target_just_below_the_greatest_value(ccd, box, in_sphere):
    top = in_sphere.reachable[1]
    calibration = solve_target(ccd, top - 1e-4, *box, radius=ALPHA)
    assert calibration.point.response == pytest.approx(top - 1e-4, abs=1e-5)
    assert all(high - low < 0.05 for low, high in calibration.ranges)


def test_the_published_solution(ccd, box, coding):
    point = assess_point(ccd, coding.to_coded([17.96, 0.0387, 87.27]), *box, radius=ALPHA)
    assert point.response == pytest.approx(159.26, abs=0.01)
    assert point.coded_radius == pytest.approx(1.40025, abs=1e-5)
    assert point.inside
    assert not assess_point(ccd, coding.to_coded([15.0, 0.05, 90.0]), *box, radius=ALPHA).inside
    assert not assess_point(ccd, [2.0, 0.0, 0.0]).inside
    low, high = point.mean_interval
    assert not low <= 169.0 <= high  # the article's own confirming simulation gave 169 N


def test_a_solution_beyond_the_design_is_flagged(ccd, box):
    calibration = solve_target(ccd, 190.0, *box)
    assert calibration.point.coded_radius > ALPHA
    assert not calibration.point.inside


def surface_of(k, beta, noise=0.0):
    design = central_composite(k, 4)
    y = term_columns(design) @ np.asarray(beta)
    return fit_surface(design, y + np.random.default_rng(k).normal(0.0, noise, len(y)), [f"f{i}" for i in range(k)])


def test_one_factor_has_two_roots():
    """10 + x² = 11 at x = ±1; the tie goes to the higher level."""
    surface = surface_of(1, [10.0, 0.0, 1.0])
    calibration = solve_target(surface, 11.0, [-2.0], [2.0])
    assert calibration.point.coded == pytest.approx((1.0,), abs=1e-7)
    assert calibration.ranges[0] == pytest.approx((-1.0, 1.0), abs=1e-7)


def test_a_circle():
    """x² + y² = 1 inside a box cut at y = 0.5."""
    surface = surface_of(2, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    calibration = solve_target(surface, 1.0, [-2.0, -2.0], [2.0, 0.5])
    assert calibration.point.coded_radius == pytest.approx(1.0, abs=1e-6)
    assert calibration.ranges[0] == pytest.approx((-1.0, 1.0), abs=1e-6)
    assert calibration.ranges[1] == pytest.approx((-1.0, 0.5), abs=1e-6)


def test_two_sheets_of_a_hyperbola():
    """x² − y² = 1 with |x|, |y| ≤ 2: both sheets count, x in ±[1, 2], y in ±√3."""
    surface = surface_of(2, [0.0, 0.0, 0.0, 0.0, 1.0, -1.0])
    calibration = solve_target(surface, 1.0, [-2.0, -2.0], [2.0, 2.0])
    assert calibration.ranges[0] == pytest.approx((-2.0, 2.0), abs=1e-6)
    assert calibration.ranges[1] == pytest.approx((-(3**0.5), 3**0.5), abs=1e-6)
    assert calibration.point.coded_radius == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("k", [4, 5])
def test_a_plane_in_more_factors(k):
    """Σx = 1: nearest point 1/k each; in a unit box each factor reaches both ends."""
    beta = np.zeros(len(term_names(["f"] * k)))
    beta[1 : k + 1] = 1.0
    surface = surface_of(k, beta)
    calibration = solve_target(surface, 1.0, [-1.0] * k, [1.0] * k)
    assert calibration.point.coded == pytest.approx((1.0 / k,) * k, abs=1e-6)
    for low, high in calibration.ranges:
        assert (low, high) == pytest.approx((-1.0, 1.0), abs=1e-6)
    ball = solve_target(surface, 1.0, [-2.0] * k, [2.0] * k, radius=1.0)
    reach = ((1.0 - 1.0 / k) * (1.0 - 1.0 / k)) ** 0.5  # √((1 − 1/k)(r² − 1/k)) about 1/k, with r = 1
    for low, high in ball.ranges:
        assert (low, high) == pytest.approx((1.0 / k - reach, 1.0 / k + reach), abs=1e-6)


def test_a_surface_without_error_still_inverts():
    design = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    surface = fit_surface(design, design @ [3.0, 1.0] + 5.0, ["a", "b"])
    calibration = solve_target(surface, 6.0, [-1.0, -1.0], [1.0, 1.0])
    assert calibration.point.coded == pytest.approx((0.3, 0.1), abs=1e-6)
    assert calibration.point.mean_interval is None


def test_senseless_requests_are_refused(ccd, box):
    with pytest.raises(UsageError, match=r"invert\.rule"):
        solve_target(ccd, TARGET, *box, rule="best")
    with pytest.raises(UsageError, match="lower limit"):
        solve_target(ccd, TARGET, [1.0] * 3, [0.0] * 3)
    with pytest.raises(UsageError, match="contain no point"):
        solve_target(ccd, TARGET, [3.0] * 3, [4.0] * 3, radius=ALPHA)
    with pytest.raises(UsageError, match="`others_at_centre` has no solution"):
        solve_target(ccd, 190.0, *box, rule="others_at_centre")


@pytest.mark.parametrize("trial", [*range(4), *(pytest.param(trial, marks=pytest.mark.slow) for trial in range(4, 12))])
def test_nothing_found_by_chance_beats_the_search(trial):
    """Random quadratics: no point of the solution set lies outside the ranges or nearer to the centre."""
    generator = np.random.default_rng(100 + trial)
    k = 2 + trial % 4
    radius = 2.0 ** (k / 4) if trial % 2 else None
    region = Region(np.full(k, -1.5), np.full(k, 1.6), radius)
    surface = surface_of(k, generator.normal(0.0, 10.0, len(term_names(["f"] * k))), noise=1.0)
    points = generator.uniform(-1.5, 1.6, (20_000, k))
    points = points[region.contains(points)]
    target = float(np.quantile(surface.predict(points), generator.uniform(0.05, 0.95)))
    calibration = solve_target(surface, target, region.low, region.high, radius)
    below, above = (points[side] for side in np.array([surface.predict(points) < target] * 2) ^ [[False], [True]])
    n = min(len(below), len(above))
    start, end = below[:n].copy(), above[:n].copy()
    for _ in range(50):  # bisection, one pair of points per row
        middle = 0.5 * (start + end)
        low = (surface.predict(middle) < target)[:, None]
        start, end = np.where(low, middle, start), np.where(low, end, middle)
    assert calibration.point.response == pytest.approx(target, abs=1e-5)
    assert calibration.point.coded_radius <= np.linalg.norm(start, axis=1).min() + 1e-6
    for j, (least, greatest) in enumerate(calibration.ranges):
        assert least <= start[:, j].min() + 1e-6
        assert greatest >= start[:, j].max() - 1e-6
