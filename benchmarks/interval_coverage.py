"""Do the 95 % intervals of the parameters hold the truth in 95 of 100 studies, with n specimens at each diameter?

python benchmarks/interval_coverage.py [studies] [seed] [laboratory] [rough] [unequal] [surfaces] [fields]
                                       [replicates] [priors]

The first number is that of the studies of each row, 1000 by default: a share is then good to ±1.4. The second draws
others.

Draws laboratories at a known truth: five diameters, n forces at each about the true one with a coefficient of
variation of 5 %. Counts how often the interval of each of two parameters holds the truth, and how often the misfit test
rejects a model that is right (should be 5 %). Three ways to treat the standard deviations: each as if it were known, a
Student likelihood for each diameter, and the pooled coefficient of variation that stemcal takes. Then with quadratics
that miss the simulated forces by 3 %, at the runs of the design and at the truth alike, and with coefficients of
variation that differ between the diameters by a factor of two. Variances, degrees of freedom, allowed rise and test are
stemcal's; least misfits are found by Gauss and Newton's method from the truth, compared with stemcal's own search in
the first studies of each row.

`rough` places the truth at three points, with quadratics that miss by 3 %. Ten minutes.

`surfaces`: a deterministic solver whose response is a smooth function, drawn at random of three families (sums of
cosines, products of powers, sums of hyperbolic tangents), or rough but repeatable: how often the interval of the mean
and that of one more run hold it at points spread over the region, with six copies of the centre run counted each and
once. `fields`: the variance of ŷ about a Gaussian field whose correlation reaches so many half steps, in units of the
mean s², over h and over 1 + h: medians over the region. `replicates`: a program with a scatter of 5 %, each run of
the design made r times, the laboratory known: how often the profile holds the truth, and its median width.
`priors`: a material drawn from normal and lognormal priors, each about as wide as what the forces tell; how often the
profile holds it, the median width over that without priors, and how often a prior that is right is called contradicted
(should be 5 %). Some minutes each.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from stemcal.doe.calibration.joint_fit import chance_of
from stemcal.doe.calibration.misfit import Misfit, Observation, best_fit, misfit_of
from stemcal.doe.calibration.prior import Prior
from stemcal.doe.calibration.profile import allowed_rises, holds, profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.box_behnken import box_behnken
from stemcal.doe.designs.composite import central_composite
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.doe.regression.terms import term_columns, term_gradient

SEED, STUDIES, COMPARED = 31_415, 1000, 10
SPECIMENS = (3, 6, 30)
DIAMETERS = np.array([7.0, 8.0, 9.0, 10.0, 11.0])
TRUTH, SIDE, VARIATION = np.array([0.3, -0.2]), 1.68, 0.05
SAME = np.full(len(DIAMETERS), VARIATION)
REGION = Region(np.full(2, -SIDE), np.full(2, SIDE), None)
NODES = 101
KNOWN = 1e-5


@dataclass(frozen=True)
class Laboratory:
    """Mean and standard deviation of n forces at each diameter, (diameters,)."""

    mean: Array
    sd: Array
    n: int


@dataclass(frozen=True)
class Held:
    """Whether the intervals held the truth, and whether the misfit test rejected it."""

    profile: list[bool]
    rejected: bool


def force(x: Array, diameter: float) -> float:
    """F = (d/8)²·(150 + 12a + 5b + ab + b²)·(1 + 0.06·b·(d − 8)): b also changes how force grows."""
    a, b = x
    return float((diameter / 8) ** 2 * (150 + 12 * a + 5 * b + a * b + b * b) * (1 + 0.06 * b * (diameter - 8)))


def surfaces(error: float, random: np.random.Generator) -> list[Surface]:
    """Quadratics through the forces at a composite design; `error` is the part by which its runs miss them."""
    coded = central_composite(2, 1, "rotatable")
    found = []
    for d in DIAMETERS:
        runs = np.array([force(x, d) for x in coded])
        found.append(fit_surface(coded, runs * (1.0 + error * random.standard_normal(len(runs))), ["a", "b"]))
    return found


def laboratory(n: int, variation: Array, error: float, random: np.random.Generator) -> Laboratory:
    """Break n stems of each diameter; the quadratic misses the simulated force at the truth as it does at the runs."""
    true = np.array([force(TRUTH, d) for d in DIAMETERS]) * (1.0 + error * random.standard_normal(len(DIAMETERS)))
    broken = true[:, None] * (1.0 + variation[:, None] * random.standard_normal((len(true), n)))
    return Laboratory(broken.mean(axis=1), broken.std(axis=1, ddof=1), n)


def observations(lab: Laboratory, fitted: list[Surface], told: bool) -> list[Observation]:
    """Return what was measured; not told that there were n, sd/√n counts as known."""
    return [
        Observation(s, float(m), float(sd) if told else float(sd) / lab.n**0.5, lab.n if told else None)
        for s, m, sd in zip(fitted, lab.mean, lab.sd, strict=True)
    ]


def pooled(lab: Laboratory, fitted: list[Surface]) -> Held:
    """As stemcal does it."""
    misfit = misfit_of(observations(lab, fitted, told=True), REGION)
    return _by_misfit(misfit)


def as_known(lab: Laboratory, fitted: list[Surface]) -> Held:
    """Each standard deviation as if it were known."""
    return _by_misfit(misfit_of(observations(lab, fitted, told=False)))


def student(lab: Laboratory, fitted: list[Surface]) -> Held:
    """Deviance Σ n·ln(1 + n(mean − ŷ)²/((n − 1)sd²)) on the grid, its rise as χ²."""
    misfit = misfit_of(observations(lab, fitted, told=True))
    t_squared = lab.n * (lab.mean - misfit.predict(_points())) ** 2 / lab.sd**2
    deviance = (lab.n * np.log1p(t_squared / (lab.n - 1))).sum(axis=1).reshape(NODES, NODES)
    at = [int(np.argmin(np.abs(axis - value))) for axis, value in zip(_axes(), TRUTH, strict=True)]
    rise = [deviance[at[0], :].min() - deviance.min(), deviance[:, at[1]].min() - deviance.min()]
    return Held([bool(part <= 3.8415) for part in rise], bool(deviance.min() > 7.8147))


def _by_misfit(misfit: Misfit) -> Held:
    best = _least(misfit, [])
    least, allowed = misfit.value(best), allowed_rises(misfit, best)
    return Held([_rise(misfit, least, j) <= allowed[j] for j in range(2)], chance_of(misfit, best) < 0.05)


def _least(misfit: Misfit, held: list[int]) -> Array:
    """Return the point of least misfit with some factors held at the truth: x ← x + (JᵀJ)⁻¹Jᵀr."""
    x, free = TRUTH.copy(), [j for j in range(2) if j not in held]
    covariance = np.diag(misfit.variance) + misfit.shared.T @ misfit.shared
    whitened = np.linalg.inv(np.linalg.cholesky(covariance))
    for _ in range(12):
        slopes = whitened @ (misfit.beta @ term_gradient(x))[:, free]
        gap = whitened @ (misfit.measured - misfit.predict(x)[0])
        x[free] += np.linalg.lstsq(slopes, gap, rcond=None)[0]
        x = REGION.nearest(x)
    return x


def _rise(misfit: Misfit, least: float, j: int) -> float:
    """Return how much the misfit rises where factor j is held at the truth, by the variances there."""
    x = _least(misfit, [j])
    return (misfit.value(x) - least) / misfit.looseness(x)


def _axes() -> list[Array]:
    """Return the nodes of the grid along each factor; one of them is the truth."""
    grid = np.linspace(-SIDE, SIDE, NODES)
    return [grid + (value - grid[np.argmin(np.abs(grid - value))]) for value in TRUTH]


def _points() -> Array:
    return np.stack(np.meshgrid(*_axes(), indexing="ij"), axis=-1).reshape(-1, 2)


WAYS: dict[str, Callable[[Laboratory, list[Surface]], Held]] = {
    "sd as known": as_known,
    "Student": student,
    "pooled": pooled,
}


def coverage(way: str, n: int, variation: Array, error: float, studies: int) -> Array:
    """Return shares in per cent: interval of a, of b, rejected by the misfit test."""
    random = np.random.default_rng([SEED, n])
    exact = surfaces(0.0, random)
    counts = np.zeros(3)
    for study in range(studies):
        fitted = surfaces(error, random) if error else exact
        lab = laboratory(n, variation, error, random)
        held = WAYS[way](lab, fitted)
        if way == "pooled" and study < COMPARED:
            own = misfit_of(observations(lab, fitted, told=True), REGION)
            assert holds(own, REGION, TRUTH) == held.profile, f"stemcal's own search disagrees in study {study}"
        counts += [*held.profile, held.rejected]
    return np.asarray(100.0 * counts / studies)


def main() -> None:
    """Print one row per number of specimens and way."""
    global SEED
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    studies, SEED = numbers + [STUDIES, SEED][len(numbers) :]
    wanted = [word for word in sys.argv[1:] if not word.isdigit()] or ["laboratory"]
    print("                                              interval      misfit test")
    print("  n   standard deviations                     a      b      rejects, %")
    if "laboratory" in wanted:
        laboratory_rows(studies)
    more = {"rough": rough_rows, "unequal": unequal_rows, "surfaces": surface_rows, "replicates": replicate_rows}
    more |= {"priors": prior_rows}
    for name in wanted:
        if name in more:
            more[name](studies)
    if "fields" in wanted:
        field_rows()


def rough_rows(studies: int) -> None:
    """Print studies of quadratics that miss by 3 %, with the truth near the centre and apart from it."""
    before = TRUTH.copy()
    for truth in (before, [-0.8, 0.7], [1.0, -0.9]):
        TRUTH[:] = truth
        for n in SPECIMENS:
            row("pooled, surfaces 3 %, at " + ", ".join(f"{x:g}" for x in truth), n, SAME, 0.03, studies)
    TRUTH[:] = before


def unequal_rows(studies: int) -> None:
    """Print studies in which one diameter scatters three times as much as the others; `unequal` alone runs these."""
    for at in (0, 2, 4):
        variation = np.full(len(DIAMETERS), VARIATION)
        variation[at] *= 3.0
        for n in SPECIMENS:
            row(f"pooled, cv × 3 at {DIAMETERS[at]:g} mm", n, variation, 0.0, studies)


def laboratory_rows(studies: int) -> None:
    """Print how the laboratory's standard deviations are treated."""
    differing = VARIATION * np.array([0.7, 1.4, 0.8, 1.2, 1.0])
    for way in reversed(WAYS):
        for n in SPECIMENS:
            row(way, n, SAME, 0.0, studies)
    for n in SPECIMENS:
        row("pooled, cv × 0.7 to 1.4", n, differing, 0.0, studies)


def row(label: str, n: int, variation: Array, error: float, studies: int) -> None:
    """Print one row; its label begins with the way."""
    a, b, rejected = coverage(label.split(",")[0], n, variation, error, studies)
    print(f"{n:3d}   {label:<36} {a:6.1f} {b:6.1f}   {rejected:6.1f}", flush=True)


# ---- deterministic surfaces

Smooth = Callable[[Array], Array]


def waves(k: int, random: np.random.Generator) -> Smooth:
    """100 and twenty cosines whose waves are as long as the region or longer."""
    direction, phase, size = random.normal(size=(20, k)) / 2.0, random.uniform(0, 2 * np.pi, 20), random.normal(size=20)
    return lambda x: np.asarray(100.0 + 10.0 * np.cos(x @ direction.T + phase) @ size / 10**0.5)


def powers(k: int, random: np.random.Generator) -> Smooth:
    """100·Π(1 + sᵢxᵢ)^eᵢ·exp(xᵀGx/2)."""
    exponent, step = random.uniform(-2.4, 2.4, size=k), random.uniform(0.1, 0.35, size=k)
    bent = random.normal(size=(k, k)) * 0.05
    return lambda x: np.asarray(
        100.0 * np.prod((1.0 + step * x) ** exponent, axis=1) * np.exp(0.5 * np.einsum("ij,jk,ik->i", x, bent, x))
    )


def saturating(k: int, random: np.random.Generator) -> Smooth:
    """150 and four hyperbolic tangents."""
    slope, middle, size = random.normal(size=(4, k)) * 0.6, random.normal(size=4), random.normal(size=4) * 20.0
    return lambda x: np.asarray(150.0 + np.tanh(x @ slope.T + middle) @ size)


def rough(k: int, random: np.random.Generator, by: float = 3.0) -> Smooth:
    """Powers, and answers that are rough by so many N: the same at a point whenever it is asked for."""
    smooth, own = powers(k, random), int(random.integers(2**31))

    def at(x: Array) -> float:
        return float(np.random.default_rng([own, *np.round(1e6 * (x + 5.0)).astype(int)]).standard_normal())

    return lambda x: np.asarray(smooth(x) + by * np.array([at(point) for point in x]))


FAMILIES: dict[str, Callable[[int, np.random.Generator], Smooth]] = {
    "waves": waves,
    "powers": powers,
    "saturating": saturating,
    "rough by 3": rough,
    "rough by 5": partial(rough, by=5.0),
}
DESIGNS = {
    "two factors, rotatable": (central_composite(2, 6, "rotatable"), np.inf),
    "two factors, face": (central_composite(2, 6, "face"), 1.0),
    "three factors, rotatable": (central_composite(3, 6, "rotatable"), np.inf),
    "three factors, face": (central_composite(3, 6, "face"), 1.0),
    "three factors, Box-Behnken": (box_behnken(3, 6), 1.0),
}


def within_region(design: Array, side: float, count: int, random: np.random.Generator) -> Array:
    """Return points that fill the sphere of a design evenly, and its box."""
    k = design.shape[1]
    way = random.normal(size=(count, k))
    way /= np.linalg.norm(way, axis=1)[:, None]
    points = way * np.linalg.norm(design, axis=1).max() * random.uniform(size=(count, 1)) ** (1.0 / k)
    return np.asarray(points[np.all(np.abs(points) <= side, axis=1)])


def coverage_of_surfaces(design: Array, side: float, family: str, each_once: bool, studies: int) -> Array:
    """Return shares in per cent: the mean's interval, that of one more run."""
    random, held, tried = np.random.default_rng(SEED), np.zeros(2), 0
    for _ in range(studies):
        response = FAMILIES[family](design.shape[1], random)
        names = [f"x{j}" for j in range(design.shape[1])]
        surface = fit_surface(design, response(design), names, each_once=each_once)
        points = within_region(design, side, 60, random)
        true = response(points)
        for i, ends in enumerate((surface.mean_interval(points), surface.prediction_interval(points))):
            held[i] += np.sum((true >= ends[:, 0]) & (true <= ends[:, 1]))
        tried += len(points)
    return np.asarray(100.0 * held / tried)


def surface_rows(studies: int) -> None:
    """Print one row per design and family."""
    print("design and family                        copies: mean, one run   once: mean, one run")
    for label, (design, side) in DESIGNS.items():
        for family in FAMILIES:
            shares = [*coverage_of_surfaces(design, side, family, False, studies)]
            shares += [*coverage_of_surfaces(design, side, family, True, studies)]
            print(f"{label + ', ' + family:<42}" + " ".join(f"{share:8.1f}" for share in shares), flush=True)


def field_rows() -> None:
    """Print v/h and v/(1 + h): v = k(x, x) − 2aᵀk + aᵀKa over tr(MK)/(n − p), a = X(XᵀX)⁻¹φ, M = 1 − X(XᵀX)⁻¹Xᵀ."""
    print("design                       length   v/h   v/(1 + h)")
    for label, (design, side) in DESIGNS.items():
        runs = np.unique(np.round(design, 9), axis=0)
        points = within_region(design, side, 4000, np.random.default_rng(SEED))
        x, phi = term_columns(runs), term_columns(points)
        a = phi @ np.linalg.inv(x.T @ x) @ x.T
        h, m = np.sum(a**2, axis=1), np.eye(len(runs)) - x @ np.linalg.pinv(x)
        for length in (1.0, 2.0, 4.0):
            k, across = _correlation(runs, runs, length), _correlation(points, runs, length)
            v = 1.0 - 2.0 * np.sum(a * across, axis=1) + np.sum(a @ k * a, axis=1)
            v *= (len(runs) - x.shape[1]) / np.trace(m @ k)
            print(f"{label:<28} {length:6g} {np.median(v / h):5.2f} {np.median(v / (1.0 + h)):8.2f}", flush=True)


def _correlation(a: Array, b: Array, length: float) -> Array:
    return np.asarray(np.exp(-0.5 * np.sum((a[:, None] - b[None]) ** 2, axis=2) / length**2))


# ---- a program with chance in it


def noisy_surfaces(replicates: int, random: np.random.Generator) -> list[Surface]:
    """Quadratics through runs made so many times over, each with its own scatter."""
    coded = np.repeat(central_composite(2, 3, "rotatable"), replicates, axis=0)
    found = []
    for d in DIAMETERS:
        runs = np.array([force(x, d) for x in coded])
        found.append(fit_surface(coded, runs * (1.0 + VARIATION * random.standard_normal(len(runs))), ["a", "b"]))
    return found


def replicate_rows(studies: int) -> None:
    """Print coverage and median width of the profile's intervals over the replicates."""
    print("  r   holds a, b, %    width a, b")
    for replicates in (1, 3, 10):
        random = np.random.default_rng([SEED, replicates])
        held, widths = np.zeros(2), []
        for _ in range(studies):
            fitted = noisy_surfaces(replicates, random)
            lab = laboratory(30, np.full(len(DIAMETERS), KNOWN), 0.0, random)
            misfit = misfit_of(observations(lab, fitted, told=True), REGION)
            best = _least(misfit, [])
            least, allowed = misfit.value(best), allowed_rises(misfit, best)
            held += [_rise(misfit, least, j) <= allowed[j] for j in range(2)]
            slopes = misfit.beta @ term_gradient(best)
            spread = np.diag(np.linalg.inv(slopes.T @ (slopes / misfit.variance[:, None])))
            widths.append(2.0 * np.sqrt(np.array(allowed) * spread))
        (a, b), (wide_a, wide_b) = 100.0 * held / studies, np.median(widths, axis=0)
        print(f"{replicates:3d}   {a:6.1f} {b:6.1f}    {wide_a:6.3f} {wide_b:6.3f}", flush=True)


# ---- a material that is drawn from its priors


def prior_rows(studies: int) -> None:
    """Print coverage, width against that without priors, and how often the misfit test rejects true priors."""
    a, b = Prior(0, "normal", 0.3, 0.35, 0.0, 1.0), Prior(1, "lognormal", 10.0, 2.0, 10.0, 4.0)
    m, s = a.mean, float(np.sqrt(np.log1p((b.sd / b.mean) ** 2)))
    exact = surfaces(0.0, np.random.default_rng(SEED))
    print("  n   holds a, b, %   width over that without priors   misfit test rejects, %")
    for n in SPECIMENS:
        random = np.random.default_rng([SEED, n, 7])
        held, rejected, widths = np.zeros(2), 0, []
        for _ in range(studies):
            value = b.mean * np.exp(s * random.standard_normal() - 0.5 * s**2)
            truth = np.array([m + a.sd * random.standard_normal(), (value - b.centre) / b.half_step])
            truth = np.clip(truth, -0.9 * SIDE, 0.9 * SIDE)
            broken = np.array([force(truth, d) for d in DIAMETERS])[:, None]
            broken = broken * (1.0 + 2.0 * VARIATION * random.standard_normal((len(DIAMETERS), n)))
            lab = Laboratory(broken.mean(axis=1), broken.std(axis=1, ddof=1), n)
            bare = misfit_of(observations(lab, exact, told=True), REGION)
            known = bare.with_priors((a, b), REGION)
            held += holds(known, REGION, truth)
            rejected += int(chance_of(known, best_fit(known, REGION)) < 0.05)
            widths.append([_width(known), _width(bare)])
        share = np.median(np.array(widths)[:, 0] / np.array(widths)[:, 1], axis=0)
        (a_held, b_held), off = 100.0 * held / studies, 100.0 * rejected / studies
        print(f"{n:3d}   {a_held:6.1f} {b_held:6.1f}   {share[0]:8.2f} {share[1]:8.2f}   {off:8.1f}", flush=True)


def _width(misfit: Misfit) -> list[float]:
    return [p.high - p.low for p in profiles_of(misfit, REGION, best_fit(misfit, REGION))]


if __name__ == "__main__":
    main()
