"""The one fit against closed answers: planes without error, so that what is planted is all that there is."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm, t

from stemcal.doe.calibration.confidence_intervals import (
    contradiction,
    left_out,
    left_out_intervals,
    missed_observations,
    profiles_of,
    settled,
)
from stemcal.doe.calibration.likelihood import Fit, Prior, fit
from stemcal.doe.calibration.observations import Contrasts, Observation, Uniforms, variances
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.coding import term_columns
from stemcal.doe.designs import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import UsageError

LINE = np.linspace(-2.0, 2.0, 7)[:, None]
RUNS = central_composite(2, centre_points=1)
FAR = Region(np.full(1, -40.0), np.full(1, 40.0), None)
PLANE = Region(np.full(2, -20.0), np.full(2, 20.0), None)
J = np.array([[10.0, 2.0], [1.0, 8.0], [4.0, -5.0], [3.0, 1.0]])
MEASURED, SD, N = np.array([103.6, 97.7, 103.4, 99.9]), np.array([9.0, 6.0, 7.0, 4.0]), 9


def line(slope: float = 2.0) -> Surface:
    return fit_surface(LINE, 100.0 + slope * LINE[:, 0], ["x"])


def planes(count: int) -> list[Surface]:
    return [fit_surface(RUNS, 100.0 + RUNS @ J[i], ("x", "y")) for i in range(count)]


def ends(found: Fit, j: int = 0) -> tuple[float, float]:
    profile = profiles_of(found)[j]
    return profile.low, profile.high


@pytest.mark.parametrize("n", [None, 3, 6])
def test_one_mean_has_a_normal_interval_or_students(n: int | None) -> None:
    """x̂ ± 1.96 s/2 of a known s; ± t(n − 1) s/(2 √n) of n specimens."""
    found = fit([Observation(line(), 103.0, 2.0, n)], FAR)
    half = norm.ppf(0.975) if n is None else t.ppf(0.975, n - 1) / n**0.5
    assert found.best == pytest.approx([1.5], abs=1e-6)
    assert ends(found) == pytest.approx((1.5 - half, 1.5 + half), rel=4e-3)


def test_the_likelihood_of_one_mean_is_students() -> None:
    found = fit([Observation(line(), 103.0, 2.0, 4)], FAR)
    x = np.array([[1.5], [2.5], [4.5], [-3.5]])
    expected = t.logpdf((3.0 - 2.0 * x[:, 0]) / (2.0 / 4**0.5), 3)
    log = found.log_likelihood(x)
    np.testing.assert_allclose(log - log[0], expected - expected[0], atol=0.03)


def test_known_means_are_weighed_by_their_variances() -> None:
    """x̂ = Σ (y/σ²)/Σ (1/σ²) and the p-value of χ²(1)."""
    found = fit([Observation(line(), 103.0, 2.0), Observation(line(), 100.0, 1.0)], FAR)
    weights = np.array([1.0 / 4.0, 1.0])
    assert found.best == pytest.approx([0.5 * (3.0 * weights[0]) / weights.sum()], abs=2e-3)
    low, high = ends(found)
    assert high - low == pytest.approx(norm.ppf(0.975) / weights.sum() ** 0.5, rel=2e-3)
    assert found.p_value == pytest.approx(chi2.sf(9.0 / 5.0, 1), rel=2e-3)


def test_means_without_a_standard_deviation_tell_it_by_their_misfit() -> None:
    """Four equal surfaces: x̂ ± t(3) s/(2 √4), s of the four means, relative."""
    measured = np.array([101.0, 103.0, 104.0, 100.0])
    found = fit([Observation(line(), y) for y in measured], FAR)
    low, high = ends(found)
    assert found.best == pytest.approx([0.976], abs=0.005)
    assert high - low == pytest.approx(t.ppf(0.975, 3) * measured.std(ddof=1) / 4**0.5, rel=0.04)
    assert found.p_value is None


def test_a_prior_is_one_more_observation() -> None:
    """Normal with normal: precisions add. A prior alone in a flat direction keeps its own quantiles."""
    mean = Observation(line(), 103.0, 2.0)
    found = fit([mean], FAR, [Prior(0, 0.0, 0.5, 0.0, 1.0)])
    precision = 1.0 + 4.0
    assert found.best == pytest.approx([1.5 / precision], abs=2e-3)
    low, high = ends(found)
    assert high - low == pytest.approx(2.0 * norm.ppf(0.975) / precision**0.5, rel=2e-3)
    assert found.p_value == pytest.approx(chi2.sf(1.5**2 / 1.25, 1), rel=2e-3)
    known = Prior(1, 11.0, 0.2, 10.0, 1.0)
    flat = fit([Observation(fit_surface(RUNS, 100.0 + RUNS[:, 0], ["x", "y"]), 100.0, 1.0)], PLANE, [known])
    assert ends(flat, 1) == pytest.approx(norm.ppf([0.025, 0.975], 1.0, 0.2), abs=0.005)


def of_specimens(p: int) -> list[Observation]:
    rows = enumerate(zip(planes(p), MEASURED, SD, strict=False))
    return [Observation(*row, N, f"r{i}", "8") for i, row in rows]


@pytest.mark.parametrize("p", [2, 4])
def test_responses_of_the_same_specimens_have_the_interval_of_a_growth_curve(p: int) -> None:
    """C. R. Rao: θ̂ ± t(n − 1 − p + k)·√((n − 1)/(n − 1 − p + k)·(1 + T²/(n − 1))·Cⱼⱼ/n), T² of what the fit leaves."""
    j, gap = J[:p], (MEASURED - 100.0)[:p]
    c = np.linalg.inv(j.T @ (j / SD[:p, None] ** 2))
    solution = c @ j.T @ (gap / SD[:p] ** 2)
    left = N * float(np.sum(((gap - j @ solution) / SD[:p]) ** 2))
    df = N - 1 - p + 2
    half = t.ppf(0.975, df) * np.sqrt((N - 1) / df * (1.0 + left / (N - 1)) * np.diag(c) / N)
    found = fit(of_specimens(p), PLANE)
    width = np.array([np.subtract(*ends(found, k)[::-1]) for k in range(2)])
    np.testing.assert_allclose(width, 2.0 * half, rtol=0.04)
    np.testing.assert_allclose(found.best, solution, atol=0.1 * half.min())


def test_too_few_specimens_are_refused() -> None:
    with pytest.raises(UsageError, match="2 specimens are too few to estimate the covariance of 2 responses"):
        fit([replace(o, n=2) for o in of_specimens(2)], PLANE)


def test_variances_are_alike_as_far_as_the_estimates_are() -> None:
    """Equal estimates are pooled; one that is nine times the others is not."""
    df = np.full(5, 29.0)
    equal, apart = (variances(s2, df, Uniforms()) for s2 in (np.ones(5), np.array([1.0, 1.0, 9.0, 1.0, 1.0])))
    assert np.std(np.log(equal[:, 0])) < 0.75 * (2.0 / 29.0) ** 0.5
    assert np.median(apart[:, 2]) == pytest.approx(9.0, rel=0.15)
    assert np.median(variances(np.array([1.0, np.nan]), df[:2], Uniforms())[:, 1]) == pytest.approx(1.0, rel=0.15)


def test_the_error_of_surfaces_is_split_into_a_common_and_a_separate_part() -> None:
    """Runs that all conditions miss alike, and runs that each misses by itself: 2 % and 0.3 %."""
    random = np.random.default_rng(3)
    design = central_composite(2, 1, "rotatable")
    design = np.vstack([design, 0.5 * design, random.uniform(-1.2, 1.2, (12, 2))])
    alike = 0.02 * random.standard_normal(len(design))
    found = []
    for _ in range(5):
        own = 0.003 * random.standard_normal(len(design))
        found.append(fit_surface(design, (100.0 + 8.0 * design[:, 0]) * (1.0 + alike + own), ["a", "b"]))
    common, separate = Contrasts.of(found).missed(np.zeros((512, 5)), Uniforms())
    assert np.median(common) ** 0.5 == pytest.approx(0.02, rel=0.25)
    assert np.median(separate) ** 0.5 == pytest.approx(0.003, rel=0.25)


@pytest.mark.parametrize("lost", [(), (2, 7, 11)])
def test_groups_of_contrasts_have_the_density_of_all_of_them(lost: tuple[int, ...]) -> None:
    """ln N(z; 0, σ_c² QᵀQ + σ_u²) with Q, the whole basis of what each surface cannot follow, by a dense inverse."""
    random, design = np.random.default_rng(8), central_composite(2, 1, "rotatable")
    design = np.vstack([design, random.uniform(-1.0, 1.0, (5, 2))])
    surfaces, bases, z = [], [], []
    for i in range(3):
        kept = np.delete(np.arange(len(design)), [lost[i]] if lost else [])
        y = (100.0 + 8.0 * design[:, 0]) * (1.0 + 0.03 * random.standard_normal(len(design)))
        surfaces.append(fit_surface(design[kept], y[kept], ["a", "b"]))
        q = np.linalg.qr(term_columns(design[kept]), mode="complete")[0][:, 6:]
        bases.append(np.zeros((len(design), q.shape[1])))
        bases[-1][kept] = q
        z.append(q.T @ y[kept] / y[kept].mean())
    together, every, found = np.hstack(bases), np.concatenate(z), Contrasts.of(surfaces)
    for common, separate in ((0.02, 0.01), (0.001, 0.03), (0.05, 0.002)):
        v = common**2 * together.T @ together + separate**2 * np.eye(len(every))
        dense = np.linalg.slogdet(v)[1] + every @ np.linalg.solve(v, every)
        grouped = common**2 * found.common + separate**2
        assert found.counts @ np.log(grouped) + (found.z2 / grouped).sum() == pytest.approx(dense, rel=1e-9)


def test_many_runs_need_no_square_matrix() -> None:
    """8,000 runs: an n × n matrix has 512 MB."""
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (8_000, 2))
    y = 100.0 + points @ [8.0, 3.0] + np.random.default_rng(2).standard_normal(8_000)
    tracemalloc.start()
    found = Contrasts.of([fit_surface(points, y, ["a", "b"])])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6
    assert found.counts == pytest.approx(8_000 - 6)
    assert found.z2 / found.counts == pytest.approx(y.mean() ** -2, rel=0.05)  # scatter of 1


def test_without_residual_degrees_of_freedom_the_error_is_unknown_not_zero() -> None:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [0.0, 0.0], [1.4, 0.0], [0.0, 1.4]])
    slopes = np.array([[10.0, 2.0], [1.0, 8.0]])
    region = Region(np.full(2, -3.0), np.full(2, 3.0), None)
    width = []
    for design in (corners, RUNS):
        surfaces = [fit_surface(design, 100.0 + design @ slope, ["a", "b"]) for slope in slopes]
        found = fit([Observation(s, 100.0, 0.5, 8) for s in surfaces], region)
        width.append(np.subtract(*ends(found)[::-1]))
        assert found.errors.surface_error_known is (design is RUNS)
    assert width[0] > 3.0 * width[1]


def test_a_mean_at_odds_is_named_and_others_predict_it() -> None:
    means = [Observation(line(), y, 1.0) for y in (101.0, 101.5, 110.0, 100.5)]
    found = fit(means, FAR)
    odd = contradiction(found)
    assert odd is not None and odd.index == 2 and odd.allowed[0] < 101.0 < odd.allowed[1] and found.p_value < 1e-6
    errors, intervals = left_out(found, range(4)), left_out_intervals(found, range(4))
    assert errors[2] == pytest.approx(100.0 * (110.0 - 101.0) / 110.0, abs=0.05)
    half = norm.ppf(0.975) * (1.0 / 3.0) ** 0.5
    assert intervals[2] == pytest.approx((101.0 - np.hypot(half, 1.96), 101.0 + np.hypot(half, 1.96)), abs=0.05)
    assert contradiction(fit([*means[:2], means[3]], FAR)) is None


@pytest.mark.parametrize("ignored", [(2,), (0, 3)])
def test_a_mean_without_weight_leaves_the_fit_to_the_others(ignored: tuple[int, ...]) -> None:
    """The Schur complement of the mean precision against V of the other means, inverted."""
    wide = Region(np.full(2, -3.0), np.full(2, 3.0), None)
    slopes = ((20.0, 8.0), (18.0, 11.0), (22.0, 3.0), (15.0, 9.0))
    surfaces = [fit_surface(RUNS, 100.0 + RUNS @ np.array(slope), ("x", "y")) for slope in slopes]
    noisy = [replace(s, response=s.response + 0.3 * np.cos(7.0 * np.arange(len(RUNS)))) for s in surfaces]
    found = fit([Observation(s, y, 1.5, 5) for s, y in zip(noisy, (101.0, 104.0, 99.0, 97.0), strict=True)], wide)
    direct, quick = found.without(*ignored), found.ignoring(*ignored)
    assert quick.best == pytest.approx(direct.best, abs=1e-6)
    assert quick.least == pytest.approx(direct.least, rel=1e-8, abs=1e-10)
    points = np.array([[0.3, -0.4], [-1.0, 0.8]])
    assert quick.many(points) == pytest.approx(direct.many(points), rel=1e-9)


def test_without_degrees_of_freedom_means_may_contradict_each_other() -> None:
    """The region keeps x and y from meeting both."""
    inside = Region(np.full(2, -1.0), np.full(2, 1.0), None)
    surfaces = [fit_surface(RUNS, 100.0 + RUNS @ np.array(slope), ("x", "y")) for slope in ((10.0, 1.0), (9.0, 1.2))]
    apart = fit([Observation(s, y, 1.0) for s, y in zip(surfaces, (106.0, 94.0), strict=True)], inside)
    assert contradiction(apart) is not None and missed_observations(apart) == []
    beyond = fit([Observation(s, 130.0, 1.0) for s in surfaces], inside)
    assert contradiction(beyond) is None and missed_observations(beyond) == [0, 1]


def test_in_a_flat_valley_the_point_nearest_to_the_centre_is_taken() -> None:
    inside = Region(np.full(2, -1.5), np.full(2, 1.5), None)
    surfaces = [fit_surface(RUNS, 100.0 + RUNS @ np.array(slope), ("x", "y")) for slope in ((10.0, 10.0), (10.0, 10.1))]
    found, flat = settled(fit([Observation(s, y, 2.0) for s, y in zip(surfaces, (108.0, 107.0), strict=True)], inside))
    assert len(flat) == 1 and abs(flat[0] @ [1.0, 1.0]) < 0.02
    assert found.best == pytest.approx([0.375, 0.375], abs=0.08)


SIDES = [(1.05, 0.1), (-1.05, -0.2), (0.15, 1.05), (0.0, -1.05), (1.1, 1.1), (-1.1, 1.1)]


@pytest.mark.parametrize("truth", SIDES)
@pytest.mark.parametrize("radius", [None, 2.0**0.5])
def test_an_interval_that_the_region_ends_is_open_there(truth: tuple[float, float], radius: float | None) -> None:
    """Truths 5 % beyond a limit, or beyond a corner: no interval claims to exclude them, and none is open elsewhere."""
    region = Region(np.full(2, -1.0), np.full(2, 1.0), radius)
    means = 100.0 + J @ np.array(truth)
    found = fit([Observation(s, y, 0.3, 9) for s, y in zip(planes(4), means.tolist(), strict=True)], region)
    for profile, value in zip(profiles_of(found), truth, strict=True):
        assert profile.low <= value or not profile.bounded[0]
        assert value <= profile.high or not profile.bounded[1]
        away = profile.bounded[0] if value > 1.0 else profile.bounded[1]
        assert away or abs(value) <= 1.0


def test_an_interval_that_another_factor_ends_is_open() -> None:
    """x + y = 0 is all that one mean fixes: x ends at ±1 where y does, well within its range of ±2."""
    surface = fit_surface(RUNS, 100.0 + RUNS @ np.array([5.0, 5.0]), ("x", "y"))
    inside = Region(np.array([-2.0, -1.0]), np.array([2.0, 1.0]), None)
    x, y = profiles_of(fit([Observation(surface, 100.0, 0.1, 9)], inside))
    assert (x.low, x.high) == pytest.approx((-1.0, 1.0), abs=0.05) and x.bounded == y.bounded == (False, False)
    both = [Observation(s, 100.0, 0.1, 9) for s in planes(2)]
    assert all(profile.bounded == (True, True) for profile in profiles_of(fit(both, inside)))
