"""Coverage of the 95 % intervals of parameters and response surfaces in simulated studies.

python benchmarks/interval_coverage.py [studies] [seed] [laboratory] [rough] [unequal] [laws] [failed] [hypercube]
                                       [replicates] [solution] [priors] [surfaces] [fields] [conditions]

The first number is the number of studies per row, 200 by default, which gives a sampling error of ± 3 %. The second
number is the random seed. All rows except `solution`, `surfaces` and `fields` simulate studies of two parameters and
five diameters. These rows give the coverage of each parameter, the median widths, and how often the misfit test rejects
the model.

`laboratory`: exact surfaces and n specimens per diameter with 5 % scatter, also with different coefficients of
variation. `unequal`: one diameter has three times the scatter. `rough`: quadratics with an error of 3 %, at the design
points and at the true parameters. `laws`: a deterministic solver with power laws or saturating laws, nine runs, eight
specimens with 1.5 % scatter. `failed`: three of the nine runs failed, so the surfaces have as many coefficients as
runs. `hypercube`: the same with six and seven runs of a Latin hypercube. `replicates`: a program with 5 % scatter, r
replicates per design point, exact measurements. `solution`: coverage of the true mean of this program and of one
further run at the calibrated point. `priors`: a material drawn from normal priors, about as wide as the intervals from
the forces.

`surfaces`: a deterministic solver with a smooth response, drawn at random from three families (sums of cosines,
products of powers, sums of hyperbolic tangents), or with a rough but repeatable response. The row gives the coverage of
the mean and of one further run at points of the region. `fields`: error variance of ŷ for Gaussian fields with several
correlation lengths in half-steps, in units of the mean s², relative to h and to 1 + h: medians over the region.

`conditions`: one surface over one to three factors and the diameter, from one composite design. The rows give the least
coverage of a factor, the share of solutions at a limit of the region, the share of the surface in the error of a mean,
and, in every fifth study, the coverage of each measured mean by the interval predicted from the other diameters.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np
from scipy.stats.qmc import LatinHypercube

from stemcal.arrays import Array
from stemcal.doe.calibration import search_region
from stemcal.doe.calibration.confidence_intervals import _CLOUD, _held_at, predicted_interval, settled
from stemcal.doe.calibration.likelihood import Fit, Prior, fit
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.coding import Coding, term_columns
from stemcal.doe.designs import axial_distance, box_behnken, central_composite
from stemcal.doe.regression.section import Place, Section, fit_whole, left_out_percent
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.errors import StemcalError

SEED, STUDIES = 31_415, 200
SPECIMENS = (3, 6, 30)
DIAMETERS = np.array([7.0, 8.0, 9.0, 10.0, 11.0])
TRUTH, SIDE, VARIATION = np.array([0.3, -0.2]), 1.68, 0.05
SAME = np.full(len(DIAMETERS), VARIATION)
REGION = Region(np.full(2, -SIDE), np.full(2, SIDE), None)
BOX = Region(np.full(2, -1.0), np.full(2, 1.0), None)
KNOWN = 1e-5
Law = Callable[[Array, float], float]


def holds(fit: Fit, point: Array) -> list[bool]:
    """Return for each factor whether its interval holds the value at a point."""
    cloud, axes = fit.region.cloud(_CLOUD), np.eye(fit.region.k)
    rises = (fit.rise(_held_at(fit, j, float(v), fit.best, cloud)) for j, v in enumerate(point))
    return [rise <= fit.tangents.allowed(axis) for rise, axis in zip(rises, axes, strict=True)]


@dataclass(frozen=True)
class Laboratory:
    """Mean and standard deviation of n forces at each diameter, (diameters,)."""

    mean: Array
    sd: Array
    n: int


@dataclass(frozen=True)
class Planted:
    """What a study has measured, with its surfaces, and the truth."""

    observations: list[Observation]
    truth: Array
    region: Region = REGION
    priors: tuple[Prior, ...] = ()


def force(x: Array, diameter: float) -> float:
    """F = (d/8)²·(150 + 12a + 5b + ab + b²)·(1 + 0.06·b·(d − 8)): b also changes how force grows."""
    a, b = x
    return float((diameter / 8) ** 2 * (150 + 12 * a + 5 * b + a * b + b * b) * (1 + 0.06 * b * (diameter - 8)))


def surfaces(error: float, random: np.random.Generator, law: Law = force, coded: Array | None = None) -> list[Surface]:
    """Quadratics through the forces at a composite design; `error` is the part by which its runs miss them."""
    coded, found = central_composite(2, 1, "rotatable") if coded is None else coded, []
    for d in DIAMETERS:
        runs = np.array([law(x, d) for x in coded])
        found.append(fit_surface(coded, runs * (1.0 + error * random.standard_normal(len(runs))), ["a", "b"]))
    return found


def laboratory(
    n: int, variation: Array, error: float, random: np.random.Generator, law: Law = force, truth: Array = TRUTH
) -> Laboratory:
    """Break n stems of each diameter; the quadratic misses the simulated force at the truth as it does at the runs."""
    true = np.array([law(truth, d) for d in DIAMETERS]) * (1.0 + error * random.standard_normal(len(DIAMETERS)))
    broken = true[:, None] * (1.0 + variation[:, None] * random.standard_normal((len(true), n)))
    return Laboratory(broken.mean(axis=1), broken.std(axis=1, ddof=1), n)


def observations(lab: Laboratory, fitted: Sequence[Surface]) -> list[Observation]:
    """Return what was measured."""
    rows = zip(fitted, lab.mean.tolist(), lab.sd.tolist(), strict=True)
    return [Observation(surface, mean, sd, lab.n) for surface, mean, sd in rows]


def row(label: str, plant: Callable[[np.random.Generator], Planted], studies: int) -> None:
    """Print coverage, median widths by the tangents, and how often the misfit test rejects, of one kind of study."""
    held, rejected, widths = np.zeros(2), 0, []
    for study in range(studies):
        planted = plant(np.random.default_rng([SEED, study]))
        found = fit(planted.observations, planted.region, planted.priors)
        held += holds(found, planted.truth)
        rejected += (found.p_value or 1.0) < 0.05
        widths.append(width(found))
    (a, b), (wide_a, wide_b) = 100.0 * held / studies, np.median(widths, axis=0)
    share = 100.0 * rejected / studies
    print(f"{label:<44} {a:6.1f} {b:6.1f}   {wide_a:6.3f} {wide_b:6.3f}   {share:5.1f}", flush=True)


def width(found: Fit) -> list[float]:
    """Return the widths of the intervals of straight surfaces, coded."""
    spread = np.diag(np.linalg.pinv(found.tangents.information, hermitian=True)).clip(0.0)
    return [2.0 * float(np.sqrt(found.tangents.allowed(e) * v)) for e, v in zip(np.eye(2), spread, strict=True)]


def main() -> None:
    """Print one row per kind of study."""
    global SEED
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    studies, SEED = numbers + [STUDIES, SEED][len(numbers) :]
    wanted = [word for word in sys.argv[1:] if word in ROWS] or ["laboratory", "laws", "failed", "hypercube"]
    print("                                              holds a, b, %    width a, b      rejects, %")
    for name in wanted:
        ROWS[name](studies)


# ---- laboratories


def _of_laboratory(n: int, variation: Array, error: float, random: np.random.Generator) -> Planted:
    fitted = surfaces(error, random)
    return Planted(observations(laboratory(n, variation, error, random), fitted), TRUTH)


def laboratory_rows(studies: int) -> None:
    """Print studies whose diameters scatter alike, or not quite."""
    for label, variation in {"": SAME, ", cv × 0.7 to 1.4": SAME * np.array([0.7, 1.4, 0.8, 1.2, 1.0])}.items():
        for n in SPECIMENS:
            row(f"{n} specimens{label}", partial(_of_laboratory, n, variation, 0.0), studies)


def unequal_rows(studies: int) -> None:
    """Print studies in which one diameter scatters three times as much as the others."""
    for at in (0, 2, 4):
        variation = SAME * np.where(np.arange(len(SAME)) == at, 3.0, 1.0)
        for n in SPECIMENS:
            row(f"{n} specimens, cv × 3 at {DIAMETERS[at]:g} mm", partial(_of_laboratory, n, variation, 0.0), studies)


def rough_rows(studies: int) -> None:
    """Print studies of quadratics that miss by 3 %, with the truth near the centre and apart from it."""
    before = TRUTH.copy()
    for truth in (before, [-0.8, 0.7], [1.0, -0.9]):
        TRUTH[:] = truth
        for n in SPECIMENS:
            where = ", ".join(f"{x:g}" for x in truth)
            row(f"{n} specimens, surfaces 3 %, at {where}", partial(_of_laboratory, n, SAME, 0.03), studies)
    TRUTH[:] = before


# ---- deterministic laws


def power_law(random: np.random.Generator) -> Law:
    """F = 100·(d/8)^p·(1 + sa)^e·(1 + tb)^(f + g·ln(d/8)), constants drawn."""
    s, t = random.uniform(0.12, 0.3, 2)
    e, f, g, p = (
        random.uniform(0.4, 1.6),
        random.uniform(-1.2, -0.3),
        random.uniform(-2.0, -1.0),
        random.uniform(1.8, 2.6),
    )
    return lambda x, d: float(100 * (d / 8) ** p * (1 + s * x[0]) ** e * (1 + t * x[1]) ** (f + g * np.log(d / 8)))


def saturating_law(random: np.random.Generator) -> Law:
    """F = (d/8)^p·(100 + q·tanh(sa + 0.3) + r·tanh(tb − 0.2)·(1 + g·ln(d/8))), constants drawn."""
    (s, t), g, p = random.uniform(0.4, 0.8, 2), random.uniform(0.8, 2.0), random.uniform(1.8, 2.6)
    q, r = random.uniform(20.0, 35.0), random.uniform(10.0, 20.0)
    return lambda x, d: float(
        (d / 8) ** p * (100 + q * np.tanh(s * x[0] + 0.3) + r * np.tanh(t * x[1] - 0.2) * (1 + g * np.log(d / 8)))
    )


LAWS = {"power": power_law, "saturating": saturating_law}


def _of_law(
    kind: str, design: Callable[[np.random.Generator], Array], region: Region, random: np.random.Generator
) -> Planted:
    law, truth = LAWS[kind](random), random.uniform(-0.8, 0.8, 2)
    while True:
        try:
            fitted = surfaces(0.0, random, law, design(random))
        except StemcalError:  # these runs cannot estimate every term
            continue
        lab = laboratory(8, np.full(len(DIAMETERS), 0.015), 0.0, random, law, truth)
        return Planted(observations(lab, fitted), truth, region)


def _composite(failed: int, random: np.random.Generator) -> Array:
    design = central_composite(2, 1, "rotatable")
    return np.delete(design, random.choice(len(design), failed, replace=False), axis=0)


def _hypercube(runs: int, random: np.random.Generator) -> Array:
    return np.asarray(2.0 * LatinHypercube(2, rng=random).random(runs) - 1.0)


def law_rows(failed: int, studies: int) -> None:
    """Print studies of a deterministic solver whose composite design has lost some runs."""
    for kind in LAWS:
        row(f"{kind} law, {9 - failed} runs", partial(_of_law, kind, partial(_composite, failed), REGION), studies)


def hypercube_rows(studies: int) -> None:
    """Print studies of a deterministic solver and a small Latin hypercube."""
    for kind in LAWS:
        for runs in (6, 7):
            row(f"{kind} law, hypercube of {runs}", partial(_of_law, kind, partial(_hypercube, runs), BOX), studies)


# ---- a program with chance in it


def _of_program(replicates: int, n: int, variation: float, random: np.random.Generator) -> Planted:
    coded = np.repeat(central_composite(2, 3, "rotatable"), replicates, axis=0)
    fitted = surfaces(VARIATION, random, force, coded)
    return Planted(observations(laboratory(n, np.full(len(DIAMETERS), variation), 0.0, random), fitted), TRUTH)


def replicate_rows(studies: int) -> None:
    """Print studies of a program with a scatter of 5 %."""
    for replicates in (1, 3):
        row(f"program, {replicates} replicates", partial(_of_program, replicates, 30, KNOWN), studies)
    row("program, 3 replicates, 6 specimens", partial(_of_program, 3, 6, VARIATION), studies)


def solution_rows(studies: int) -> None:
    """Print coverage at the solution, where each run of the design is the mean of three of a program."""
    design, error, at = central_composite(2, 3, "rotatable"), VARIATION / 3**0.5, 1
    for label, n, variation in (("30 specimens, known", 30, KNOWN), ("6 specimens", 6, VARIATION)):
        held = np.zeros(2)
        for study in range(studies):
            random = np.random.default_rng([SEED, study])
            fitted = surfaces(error, random, force, design)
            lab = laboratory(n, np.full(len(DIAMETERS), variation), 0.0, random)
            x = fit(observations(lab, fitted), REGION).best
            true = force(x, DIAMETERS[at])
            run = true * (1.0 + error * random.standard_normal())
            ends = fitted[at].mean_interval(x)[0], fitted[at].prediction_interval(x)[0]
            held += [low <= value <= high for value, (low, high) in zip((true, run), ends, strict=True)]
        mean, one = 100.0 * held / studies
        print(f"at the solution: {label:<27} {mean:6.1f} {one:6.1f}   (mean, one more run)", flush=True)


# ---- a material that is drawn from its priors


def _of_priors(n: int, random: np.random.Generator) -> Planted:
    a, b = Prior(0, 0.3, 0.35, 0.0, 1.0), Prior(1, 0.0, 0.5, 0.0, 1.0)
    truth = np.array([prior.mean + prior.sd * random.standard_normal() for prior in (b, a)])[::-1]
    truth = np.clip(truth, -0.9 * SIDE, 0.9 * SIDE)
    lab = laboratory(n, 2.0 * SAME, 0.0, random, force, truth)
    return Planted(observations(lab, surfaces(0.0, random)), truth, REGION, (a, b))


def prior_rows(studies: int) -> None:
    """Print studies of a material that is drawn from its priors."""
    for n in SPECIMENS:
        row(f"{n} specimens and priors", partial(_of_priors, n), studies)


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


def coverage_of_surfaces(design: Array, side: float, family: str, studies: int) -> Array:
    """Return shares in per cent: the mean's interval, that of one more run."""
    random, held, tried = np.random.default_rng(SEED), np.zeros(2), 0
    for _ in range(studies):
        response = FAMILIES[family](design.shape[1], random)
        names = [f"x{j}" for j in range(design.shape[1])]
        surface = fit_surface(design, response(design), names)
        points = within_region(design, side, 60, random)
        true = response(points)
        for i, ends in enumerate((surface.mean_interval(points), surface.prediction_interval(points))):
            held[i] += np.sum((true >= ends[:, 0]) & (true <= ends[:, 1]))
        tried += len(points)
    return np.asarray(100.0 * held / tried)


def surface_rows(studies: int) -> None:
    """Print one row per design and family."""
    print("design and family                          mean  one run")
    for label, (design, side) in DESIGNS.items():
        for family in FAMILIES:
            mean, one = coverage_of_surfaces(design, side, family, studies)
            print(f"{label + ', ' + family:<42} {mean:6.1f} {one:6.1f}", flush=True)


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


# ---- one surface over factors and diameters


def exact_power(k: int, random: np.random.Generator) -> Law:
    """F = 100·(d/8)^p·Π(1 + sᵢxᵢ)^eᵢ·(1 + s_k x_k)^(g·ln(d/8)), constants drawn."""
    s, e = random.uniform(0.12, 0.3, k), np.array([0.8, 0.3, -0.4])[:k] * random.uniform(0.7, 1.3, k)
    p, g = random.uniform(1.8, 2.6), random.uniform(0.2, 0.5)
    return lambda x, d: float(
        100.0 * (d / 8) ** p * np.prod((1.0 + s * x) ** e) * (1.0 + s[-1] * x[-1]) ** (g * np.log(d / 8))
    )


def crossed(k: int, random: np.random.Generator) -> Law:
    """F = 100·(d/8)^(p + gx)·exp(bx + c·x₁x_k), constants drawn."""
    b, g = np.array([0.25, 0.12, 0.1])[:k] * random.uniform(0.7, 1.3, k), random.uniform(-0.2, 0.2, k)
    p, c = random.uniform(1.8, 2.6), random.uniform(-0.08, 0.08)
    return lambda x, d: float(100.0 * (d / 8) ** (p + g @ x) * np.exp(b @ x + c * x[0] * x[-1]))


def two_mechanisms(k: int, random: np.random.Generator) -> Law:
    """F = a·(1 + s₁x₁)·(d/8)^2.4 + (100 − a)·(1 + s₂x₂)^0.7·(1 + s_k x_k)^(−0.5)·(d/8)^1.6, constants drawn."""
    s, share = random.uniform(0.12, 0.3, k), random.uniform(30.0, 70.0)

    def law(x: Array, d: float) -> float:
        u = 1.0 + s * x
        other = (u[-1] ** -0.5 if k > 1 else 1.0) * (u[1] ** 0.7 if k > 2 else 1.0)
        return float(share * u[0] * (d / 8) ** 2.4 + (100.0 - share) * other * (d / 8) ** 1.6)

    return law


OVER_LAWS = {"power": exact_power, "crossed": crossed, "two mechanisms": two_mechanisms}
_PREDICTED = 5  # studies of which one has its means predicted from each other
SITUATIONS: dict[str, dict[str, float]] = {
    "two factors": {},
    "one factor": {"k": 1},
    "three factors": {"k": 3},
    "rough by 0.4 %": {"rough": 0.004},
    "rough by 2 %": {"rough": 0.02},
    "3 specimens": {"n": 3},
    "one diameter with cv × 3": {"odd": 1},
    "a failed run": {"failed": 1},
}


def of_one_surface(
    kind: str, random: np.random.Generator, k: int = 2, rough: float = 0.0, n: int = 6, odd: int = 0, failed: int = 0
) -> Planted:
    """Plant a study whose surface of the response, or of its logarithm, is over k factors and the diameter."""
    law, reach = OVER_LAWS[kind](k, random), axial_distance(k + 1)
    design = central_composite(k + 1, 1)
    middle, half = np.log(77.0) / 2.0, np.log(11.0 / 7.0) / 2.0 / reach
    simulated = [float(f"{np.exp(middle + half * z):.4g}") for z in design[:, -1]]
    design[:, -1] = (np.log(simulated) - middle) / half
    runs = np.array([law(z[:-1], d) for z, d in zip(design, simulated, strict=True)])
    runs *= np.exp(rough * random.standard_normal(len(runs)))
    runs[random.choice(len(design) - 1, failed, replace=False)] = np.nan
    names = [f"x{j}" for j in range(k)]
    fits = {log: fit_whole(design, runs, [*names, "d"], None, log) for log in (True, False)}
    errors = {log: left_out_percent(fits[log], log) for log in fits}
    logarithm = errors[True] is not None and (errors[False] is None or errors[True] < errors[False])
    coding = Coding(tuple(names), (0.0,) * k, (1.0,) * k)
    places = [Place(coding, float((np.log(d) - middle) / half)) for d in DIAMETERS]
    truth = random.uniform(-0.9, 0.9, k)
    variation = SAME * np.where(odd * (np.arange(5) == random.integers(5)), 3.0, 1.0)
    true = np.array([law(truth, d) for d in DIAMETERS]) * np.exp(rough * random.standard_normal(5))
    broken = true[:, None] * (1.0 + variation[:, None] * random.standard_normal((5, n)))
    means = zip(places, broken.mean(axis=1).tolist(), broken.std(axis=1, ddof=1).tolist(), strict=True)
    whole = replace(fits[logarithm], deterministic=True)
    seen = [Observation(Section(whole, place, logarithm), mean, sd, n) for place, mean, sd in means]
    return Planted(seen, truth, Region(np.full(k, -reach), np.full(k, reach), reach))


def condition_rows(studies: int) -> None:
    """Print studies of one surface over factors and diameters; two starts find the optimum that eight find."""
    search_region._STARTS = 2
    wanted = [word for word in sys.argv[1:] if not word.isdigit() and word not in ROWS]
    print("one surface over factors and diameters    factors              predicted  at limit    surface    rejects")
    for kind, (label, options) in product(OVER_LAWS, SITUATIONS.items()):
        name = f"{kind}, {label}"
        if wanted and kind not in wanted and name not in wanted:
            continue
        held, inside, rejected, limits, of_surface = [], [], 0, [], []
        for study in range(studies):
            planted = of_one_surface(kind, np.random.default_rng([SEED, study]), **options)  # type: ignore[arg-type]
            found, _ = settled(fit(planted.observations, planted.region))
            held.append(holds(found, planted.truth))
            limits.append(bool(np.any(np.abs(found.best) > 0.999 * planted.region.high)))
            of_surface.append(float(np.median(found._share)))
            i = study % len(DIAMETERS)
            low, high = predicted_interval(found, found.without(i), i)
            inside.append(low <= planted.observations[i].measured <= high)
            rejected += (found.p_value or 1.0) < 0.05
        factors = "".join(f"{value:6.1f}" for value in 100.0 * np.mean(held, axis=0))
        more = (100.0 * float(np.mean(one)) for one in (inside, limits, of_surface))
        numbers = "".join(f"{value:11.1f}" for value in more)
        print(f"{name:<40}{factors:<20}{numbers}{100.0 * rejected / studies:11.1f}", flush=True)


ROWS: dict[str, Callable[[int], None]] = {
    "conditions": condition_rows,
    "laboratory": laboratory_rows,
    "unequal": unequal_rows,
    "rough": rough_rows,
    "laws": partial(law_rows, 0),
    "failed": partial(law_rows, 3),
    "hypercube": hypercube_rows,
    "replicates": replicate_rows,
    "solution": solution_rows,
    "priors": prior_rows,
    "surfaces": surface_rows,
    "fields": lambda _: field_rows(),
}


if __name__ == "__main__":
    main()
