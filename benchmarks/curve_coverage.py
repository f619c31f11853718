"""Do intervals hold the truth where whole curves are fitted, and does sampling them more finely narrow the intervals?

python benchmarks/curve_coverage.py [laboratories]

Planted: a force that rises with the stiffness a, bends at the strength b and ends where the stem breaks, at c,

    F(u) = b (1 − e^(−a u/b)),  0 ≤ u ≤ c (b/a + 0.3),

in place of a solver, so that hundreds of laboratories can be had. A laboratory tests ten specimens whose a, b, c
scatter by 3 %, with a smooth error along each curve of 1 % and noise at each point, on a machine whose stiffness and
toe are drawn from what is said to be known of them. Its curves are scored and fitted as a study's are, on the surfaces
of 15 runs; a line tells how often the 95 % intervals hold the truth and how wide they are, the next one the same from
the maximum alone, another what becomes of the same laboratories if every curve has twice the points.
"""

from __future__ import annotations

import sys

import numpy as np

from stemcal.doe.calibration.misfit import Misfit, Observation, best_fit, misfit_of
from stemcal.doe.calibration.profile import holds, profiles_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.composite import central_composite
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import fit_surface
from stemcal.measured.curve_modes import Curve, Machine, modes_of
from stemcal.measured.shear_curves import PRELOAD, contact_begins

LABORATORIES, SPECIMENS, POINTS, SCATTER, SMOOTH, NOISE = 300, 10, 250, 0.03, 0.01, 0.1
MIDDLE, HALF_STEP, NAMES = np.array([400.0, 180.0, 1.0]), np.array([40.0, 15.0, 0.1]), ("a", "b", "c")
MACHINE = Machine(stiffness=1500.0, stiffness_sd=60.0, toe_sd=0.005)
REGION = Region(np.full(3, -1.68), np.full(3, 1.68), None)
RUNS = central_composite(3, centre_points=1)


def curve(parameters: Array, points: int) -> Curve:
    """Return the planted curve, which falls at once when the stem breaks."""
    a, b, c = parameters
    travel = np.linspace(0.0, c * (b / a + 0.3), points)
    return np.append(travel, travel[-1] + 1e-3), np.append(b * (1.0 - np.exp(-a * travel / b)), 0.0)


def laboratory(truth: Array, seed: int, every: int) -> list[Curve]:
    """Return the curves of a laboratory as its machine writes them, `every` point, from where the preload is passed."""
    random = np.random.default_rng(seed)
    give = 1.0 / (MACHINE.stiffness + MACHINE.stiffness_sd * random.standard_normal())
    toe = MACHINE.toe_sd * random.standard_normal()
    found = []
    for _ in range(SPECIMENS):
        travel, force = curve(truth * np.exp(SCATTER * random.standard_normal(3) - 0.5 * SCATTER**2), 2 * POINTS)
        along = np.linspace(0.0, 1.0, len(force))
        waves = random.standard_normal(3) * SMOOTH
        force = force * (1.0 + sum(wave * np.sin((j + 1) * np.pi * along) for j, wave in enumerate(waves)))
        way = (travel + give * force)[::every]
        force = (force + NOISE * random.standard_normal(len(force)))[::every]
        begin = contact_begins(force, PRELOAD)
        found.append((np.maximum(way[begin:] - way[begin] + toe, 0.0), force[begin:]))
    return found


def misfits(curves: list[Curve]) -> tuple[Misfit, Misfit]:
    """Return what is fitted: the maximum with the scores of the curves, and the maximum alone."""
    modes = modes_of(curves, MACHINE)
    simulated = [curve(MIDDLE + HALF_STEP * run, POINTS) for run in RUNS]
    forces = np.array([force.max() for _, force in curves])
    surface = fit_surface(RUNS, [force.max() for _, force in simulated], NAMES)
    observed = [Observation(surface, float(forces.mean()), float(forces.std(ddof=1)), len(forces), "force")]
    scores = np.array([modes.scores(*one) for one in simulated])
    for j, sd in enumerate(modes.scatter):
        observed.append(Observation(fit_surface(RUNS, scores[:, j], NAMES), modes.force, sd, len(forces), f"c{j}"))
    return misfit_of(observed, REGION), misfit_of(observed[:1], REGION)


def widths(misfit: Misfit) -> Array:
    """Return how wide the intervals are, coded."""
    return np.array([one.high - one.low for one in profiles_of(misfit, REGION, best_fit(misfit, REGION))])


def main(laboratories: int) -> None:
    """Print what came of the laboratories."""
    held, wide, ratio, modes = [], [], [], []
    for seed in range(laboratories):
        coded = np.random.default_rng([27, seed]).uniform(-0.8, 0.8, 3)
        truth = MIDDLE + HALF_STEP * coded
        both = misfits(laboratory(truth, seed, 2))
        held.append([holds(misfit, REGION, coded) for misfit in both])
        modes.append(len(both[0].observations) - 1)
        if seed < laboratories // 4:
            wide.append([widths(misfit) for misfit in both])
            finer, _ = misfits(laboratory(truth, seed, 1))
            ratio.append(widths(finer) / wide[-1][0])
    shares, coded_widths = 100.0 * np.mean(held, axis=0), np.mean(wide, axis=0)
    for label, share, width in zip(("with curves", "maximum alone"), shares, coded_widths, strict=True):
        told = (f"{n} held {s:5.1f} %, {w:.2f} half steps wide" for n, s, w in zip(NAMES, share, width, strict=True))
        print(f"{label:14s} " + "; ".join(told))
    finer_ratio = np.exp(np.mean(np.log(ratio), axis=0))
    print(
        "widths with twice the points over these: "
        + ", ".join(f"{n} {r:.3f}" for n, r in zip(NAMES, finer_ratio, strict=True))
    )
    print(f"{laboratories} laboratories, {np.mean(modes):.2f} modes")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else LABORATORIES)
