"""Coverage of the 95 % intervals of fits to whole curves, and their width with a finer sampling of the curves.

python benchmarks/curve_coverage.py [laboratories] [bend|flat|hill …]

To allow hundreds of synthetic laboratories, the solver is replaced by three force laws over the travel u. Each law has
an initial stiffness a, a strength b and a travel c:

    bend   b (1 − e^(−a u/b)) until the break at u = c (b/a + 0.3), where the force still rises
    flat   b (1 − (1 − u/e)^(a e/b)) until the break at u = e = 0.7 c, where the force is constant
    hill   b tanh((a u/b)^1.3) (1 + u/4)/(1 + e^((u − 0.9 c)/0.04)), with a maximum

At other diameters than 8 mm, a and c scale with the diameter and b with its square. The specimens of a laboratory
scatter in a, b and c, with a smooth error of 1 % along each curve and noise at each point, on a machine of known
stiffness. The curves are evaluated and fitted as in a study, on surfaces of 15 runs. Each line of the output gives the
coverage for one setting, without intervals that a range cuts off. The last lines give the widths for twice the points
per curve.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from interval_coverage import holds

from stemcal.doe.calibration.confidence_intervals import profiles_of
from stemcal.doe.calibration.likelihood import Fit, fit
from stemcal.doe.calibration.observations import Observation
from stemcal.doe.calibration.region import Region
from stemcal.doe.coding import Array
from stemcal.doe.composite import central_composite
from stemcal.doe.regression.surface import Surface, fit_surface
from stemcal.measured.curve_modes import Curve, modes_of, smoothed
from stemcal.measured.shear_curves import contact_begins

LABORATORIES, FIRST, POINTS, SMOOTH, WIDTHS = 200, 1000, 250, 0.01, 40  # those before the first were looked at
MIDDLE, HALF_STEP, NAMES = np.array([400.0, 180.0, 1.0]), np.array([40.0, 15.0, 0.1]), ("a", "b", "c")
STIFFNESS = 1500.0
REGION = Region(np.full(3, -1.68), np.full(3, 1.68), None)
RUNS = central_composite(3, centre_points=1)


@dataclass(frozen=True)
class Setting:
    """A laboratory: specimens, their scatter, noise (N), diameters (mm)."""

    specimens: int = 10
    scatter: float = 0.06
    noise: float = 0.5
    diameters: tuple[float, ...] = (8.0,)


USUAL = Setting()
SETTINGS = {
    "n = 10": USUAL,
    "n = 5": replace(USUAL, specimens=5),
    "n = 20": replace(USUAL, specimens=20),
    "7, 8, 10 mm": replace(USUAL, diameters=(7.0, 8.0, 10.0)),
}


def bend(a: float, b: float, c: float, points: int) -> Curve:
    """Return a curve that breaks while it rises."""
    u = np.linspace(0.0, c * (b / a + 0.3), points)
    return np.append(u, u[-1] + 1e-3), np.append(b * (1.0 - np.exp(-a * u / b)), 0.0)


def flat(a: float, b: float, c: float, points: int) -> Curve:
    """Return a curve that breaks when it no longer rises."""
    end = 0.7 * c
    u = np.linspace(0.0, end, points)
    return np.append(u, end + 1e-3), np.append(b * (1.0 - (1.0 - u / end) ** (a * end / b)), 0.0)


def hill(a: float, b: float, c: float, points: int) -> Curve:
    """Return a curve with a round maximum."""
    u = np.linspace(0.0, 1.3 * c, points)
    return u, b * np.tanh((a * u / b) ** 1.3) * (1.0 + 0.25 * u) / (1.0 + np.exp((u - 0.9 * c) / 0.04))


SIMULATORS: dict[str, Callable[..., Curve]] = {"bend": bend, "flat": flat, "hill": hill}


@dataclass(frozen=True)
class Runs:
    """The curves of the runs at a diameter (mm), and the surface of their maxima."""

    diameter: float
    simulate: Callable[..., Curve]
    curves: list[Curve]
    forces: Surface

    @classmethod
    def of(cls, simulate: Callable[..., Curve], diameter: float = 8.0) -> Runs:
        """Simulate the design."""
        size = diameter / 8.0
        at_size = partial(_at_size, simulate, np.array([size, size**2, size]))
        curves = [at_size(MIDDLE + HALF_STEP * run, POINTS) for run in RUNS]
        return cls(diameter, at_size, curves, fit_surface(RUNS, [force.max() for _, force in curves], NAMES))


def _at_size(simulate: Callable[..., Curve], factors: Array, stem: Array, points: int) -> Curve:
    return simulate(*(factors * stem), points)


def laboratory(runs: Runs, setting: Setting, truth: Array, seed: int, every: int = 2) -> list[Curve]:
    """Return the curves of a laboratory as its machine writes them, `every` point, smoothed as a study's are."""
    random = np.random.default_rng([seed, int(10 * runs.diameter)])
    found = []
    for _ in range(setting.specimens):
        own = np.exp(setting.scatter * random.standard_normal(3) - 0.5 * setting.scatter**2)
        travel, force = runs.simulate(truth * own, 2 * POINTS)
        along = np.linspace(0.0, 1.0, len(force))
        waves = random.standard_normal(3) * SMOOTH
        force = force * (1.0 + sum(wave * np.sin((j + 1) * np.pi * along) for j, wave in enumerate(waves)))
        way = (travel + force / STIFFNESS)[::every]
        force = (force + setting.noise * random.standard_normal(len(force)))[::every]
        begin = contact_begins(force, 0.0)
        found.append(smoothed(way[begin:] - way[begin], force[begin:]))
    return found


def observed(runs: Runs, curves: list[Curve]) -> list[Observation]:
    """Return what is fitted at a diameter: the maximum with the scores of the curves."""
    modes = modes_of(curves, STIFFNESS)
    forces = np.array([force.max() for _, force in curves])
    n, scores = len(curves), np.array([modes.scores(*one) for one in runs.curves])
    of = f"{runs.diameter:g}"
    found = [Observation(runs.forces, modes.force, float(forces.std(ddof=1)), n, "force", of)]
    for j, sd in enumerate(modes.scatter):
        surface = fit_surface(RUNS, scores[:, j], NAMES)
        found.append(Observation(surface, modes.force, sd, n, f"curve_{j}", of))
    return found


def fitted_to(runs: list[Runs], setting: Setting, truth: Array, seed: int, every: int = 2) -> Fit:
    """Return the fit to a laboratory at all its diameters."""
    at = [one for one in runs if one.diameter in setting.diameters]
    observations = [observed(one, laboratory(one, setting, truth, seed, every)) for one in at]
    return fit([o for each in observations for o in each], REGION)


def widths(fitted: Fit) -> Array:
    """Return how wide the intervals are, coded."""
    return np.array([one.high - one.low for one in profiles_of(fitted)])


def truth_of(seed: int) -> Array:
    """Return the coded parameters of a laboratory's stems."""
    return np.random.default_rng([27, seed]).uniform(-0.8, 0.8, 3)


def coverage(runs: list[Runs], setting: Setting, laboratories: int) -> Array:
    """Return how often the intervals hold the truth, per cent."""
    held = []
    for seed in range(FIRST, FIRST + laboratories):
        coded = truth_of(seed)
        fitted = fitted_to(runs, setting, MIDDLE + HALF_STEP * coded, seed)
        held.append(holds(fitted, coded))
    return np.asarray(100.0 * np.mean(held, axis=0))


def finer(runs: list[Runs], setting: Setting) -> tuple[Array, Array, Array]:
    """Return widths (half steps), those with twice the points over these, and those of the maximum alone."""
    usual, ratio, alone = [], [], []
    for seed in range(FIRST, FIRST + WIDTHS):
        truth = MIDDLE + HALF_STEP * truth_of(seed)
        coarse, fine = (fitted_to(runs, setting, truth, seed, every) for every in (2, 1))
        usual.append(widths(coarse))
        ratio.append(widths(fine) / usual[-1])
        alone.append(widths(coarse.without(*range(1, len(coarse.observations)))))
    return np.mean(usual, axis=0), np.exp(np.mean(np.log(ratio), axis=0)), np.mean(alone, axis=0)


def main(laboratories: int, names: list[str]) -> None:
    """Print what came of the laboratories."""
    runs = {name: [Runs.of(SIMULATORS[name], diameter) for diameter in (7.0, 8.0, 10.0)] for name in names}
    for name in names:
        for label, setting in SETTINGS.items():
            shares = coverage(runs[name], setting, laboratories)
            told = ", ".join(f"{which} {share:5.1f}" for which, share in zip(NAMES, shares, strict=True))
            print(f"{name:5s} {label:22s} held {told} %", flush=True)
    for name in names:
        usual, ratio, alone = finer(runs[name], USUAL)
        rows = zip(NAMES, usual, alone, ratio, strict=True)
        told = "; ".join(f"{which} {u:.2f} (maximum alone {one:.2f}), × {r:.3f}" for which, u, one, r in rows)
        print(f"{name:5s} half steps wide, × with twice the points: {told}", flush=True)
    print(f"{laboratories} laboratories a line: ± {100.0 * np.sqrt(0.95 * 0.05 / laboratories):.1f} by chance (1 SE)")


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else LABORATORIES, sys.argv[2:] or list(SIMULATORS))
