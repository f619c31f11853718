"""Number of simulations until two calibrations end: stemcal with and without a response surface, and other programs.

python benchmarks/runs_needed.py TABLE.json [seeds] [figure.png]

The model is a table of 175 coarse simulations of the embedded solver: five diameters, seven yield stresses, five
failure strains. If TABLE.json does not exist, it is computed first (some minutes). Cubic splines of ln F between its
points, with a repeatable roughness of 0.8 %, stand for a program whose runs take hours.

`one force`: 159.2 N at 8 mm, three factors (yield stress, its growth with the diameter, failure strain); runs until a
simulated force is within 1 %. `five forces`: five diameters, the same factors; runs until a set of parameters was
simulated whose root mean square error, without roughness, is at most 1.025 times the least one. Then the seeds that do
not get there, the runs of the whole procedure, and the error of its result without roughness. Medians of the seeds.
Programs that are not installed are left out (`pip install stemcal[bench]`).
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, partial
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import least_squares, minimize

from stemcal.arrays import Array
from stemcal.drawing.style import BLUE, FAINT, new_figure
from stemcal.runs.answer import watch_nothing
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.embedded import simulate_levels
from stemcal.solvers.protocol import Answer, Request, Solver
from stemcal.stages.results import fresh_results
from stemcal.stages.stage import stages_of
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

DIAMETERS = (7.0, 8.0, 9.0, 10.0, 11.0)
STRESSES = (7.0, 10.0, 13.0, 16.0, 19.0, 22.0, 26.0)
STRAINS = (0.01, 0.02, 0.03, 0.04, 0.05)
MEASURED = np.array([120.0, 159.2, 213.8, 300.0, 378.2])
LOW, HIGH = np.array([10.0, -0.25, 0.01]), np.array([20.0, 1.25, 0.05])
ROUGHNESS, GROWS_FROM = 0.008, 9.0
STEP = 0.1  # of the ranges: smaller differences are those of the roughness
CLOSE, WITHIN = 1.0, 1.025
MOST_POINTS = {1: 60, 5: 40}
MODEL = """\
name: coarse
factors:
  - {name: yield_stress, unit: MPa, low: 10, high: 20}
  - {name: growth, low: -0.25, high: 1.25}
  - {name: failure_strain, low: 0.01, high: 0.05}
material: {density: 1100 kg/m3, elastic_modulus: 1000 MPa, poisson_ratio: 0.3, tangent_modulus: 0.5 MPa,
  hardening_parameter: 0.05, internal_length: d/5, yield_stress: {at: 9 mm, exponent: growth}}
blade: {edge_spread: d/5}
specimen: {outer_diameter: 8 mm, diameter_ratio: 0.41, length: 30 mm}
loading: {duration: 2.5 s}
solver: {kind: embedded, element_size: d/10, mass_scaling: 3e4, coarsening: 2, outputs: 200, rate_law: none}
screen: {design: none}
"""
LIST = "factors: [yield_stress, growth, failure_strain], centre_points: 1"
SURFACE = f"rsm: {{{LIST}}}\nrefine: {{budget: {{budget}}}}\n"
OVER = f"rsm: {{{LIST}, over: conditions}}\nrefine: {{budget: {{budget}}}}\n"
QUICK = "rsm: {design: none}\n"


# ---- the model


def computed_table() -> dict[str, float]:
    """Simulate the 175 points; returns force, N, by "diameter|yield stress|failure strain"."""
    study, forces = _study(1, SURFACE.replace("{budget}", "1")), {}
    for d, y, e in product(DIAMETERS, STRESSES, STRAINS):
        levels = {"yield_stress": y, "growth": 0.0, "failure_strain": e}
        forces[f"{d:g}|{y:g}|{e:g}"] = float(simulate_levels(study, levels, d).peak_force)
        print(f"\r{len(forces)} of 175", end="", file=sys.stderr, flush=True)
    return forces


@dataclass
class Model:
    """The splines of the table with roughness: counts its distinct runs, in order."""

    table: Mapping[str, float]
    seed: int
    runs: dict[tuple[float, ...], float] = field(default_factory=dict)

    @cached_property
    def _splines(self) -> RegularGridInterpolator:
        logs = [[[np.log(self.table[f"{d:g}|{y:g}|{e:g}"]) for e in STRAINS] for y in STRESSES] for d in DIAMETERS]
        axes = np.log(DIAMETERS), np.log(STRESSES), STRAINS
        return RegularGridInterpolator(axes, np.array(logs), method="cubic", bounds_error=False, fill_value=None)

    def smooth(self, x: Array, d: float) -> float:
        """Return the force without roughness of yield stress at 9 mm, growth and failure strain."""
        stress = x[0] * (d / GROWS_FROM) ** x[1]
        return float(np.exp(self._splines([[np.log(d), np.log(stress), x[2]]])[0]))

    def run(self, x: Array, d: float) -> float:
        """Simulate once; equal points have equal forces."""
        key = tuple(float(f"{value:.9g}") for value in (*x, d))
        if key not in self.runs:
            rough = np.random.default_rng([self.seed, *(int(abs(value) * 1e9) for value in key)]).standard_normal()
            self.runs[key] = self.smooth(np.asarray(x), d) * float(np.exp(ROUGHNESS * rough))
        return self.runs[key]


@dataclass(frozen=True)
class Simulated(Solver):
    """The model as a solver of stemcal."""

    model: Model

    def identity(self, request: Request) -> dict[str, Any]:
        return {"levels": dict(request.levels), "condition": request.condition}

    def solve(self, request: Request) -> Answer:
        levels = (request.levels[name] for name in ("yield_stress", "growth", "failure_strain"))
        return Answer("ok", response=self.model.run(np.array(list(levels)), request.condition))


def errors(forces: Array) -> Array:
    """Return 100·(measured − simulated)/measured at the last of the diameters."""
    wanted = MEASURED if len(forces) == len(MEASURED) else MEASURED[1:2]
    return np.asarray(100.0 * (wanted - forces) / wanted)


def rms(forces: Array) -> float:
    """Return the root mean square error, %."""
    return float(np.sqrt(np.mean(errors(forces) ** 2)))


# ---- who calibrates


def _study(diameters: int, stages: str) -> Study:
    places = DIAMETERS if diameters > 1 else (8.0,)
    forces = MEASURED if diameters > 1 else MEASURED[1:2]
    rows = "".join(f"  - {{diameter: {d:g} mm, force: {f} N}}\n" for d, f in zip(places, forces, strict=True))
    joint = "invert: {diameters: all}\n" if diameters > 1 else ""
    path = Path(tempfile.mkdtemp()) / "coarse.yaml"
    path.write_text(f"{MODEL}{stages}{joint}targets:\n{rows}", encoding="utf-8")
    return load_study(path)


def by_stemcal(stages: str, model: Model, diameters: int) -> Array | None:
    """Take a study through its stages up to the last that calibrates; returns the parameters."""
    study = _study(diameters, stages.replace("{budget}", str(10 * diameters if "over" not in stages else 10)))
    folder = StudyFolder(study.source.parent / "out")
    made = [
        stage.making()(study, folder, InlineExecutor(), watch_nothing, Simulated(model))
        for stage in stages_of(study)
        if stage.name != "validate"
    ]
    found = fresh_results(study, folder, made).parameters
    return np.array([found["yield_stress"], found["growth"], found["failure_strain"]])


def _at(model: Model, diameters: int, z: Array) -> Array:
    """Return the errors at a point of the unit cube."""
    x = LOW + (HIGH - LOW) * np.clip(z, 0.0, 1.0)
    return errors(np.array([model.run(x, d) for d in (DIAMETERS if diameters > 1 else (8.0,))]))


def by_least_squares(model: Model, diameters: int) -> None:
    """SciPy's trust-region reflective method from the middle, differences over a tenth of the ranges."""
    gaps, most = partial(_at, model, diameters), MOST_POINTS[diameters]
    least_squares(gaps, np.full(3, 0.5), bounds=(0.0, 1.0), diff_step=2.0 * STEP, max_nfev=most)


def by_simplex(model: Model, diameters: int) -> None:
    """The simplex of Nelder and Mead from the middle, as in SciPy."""

    def size(z: Array) -> float:
        return float(np.sum(_at(model, diameters, z) ** 2))

    options = {"maxfev": MOST_POINTS[diameters], "xatol": 1e-3, "fatol": 1e-3}
    minimize(size, np.full(3, 0.5), method="Nelder-Mead", bounds=[(0.0, 1.0)] * 3, options=options)


def by_lmfit(model: Model, diameters: int) -> None:
    """Levenberg–Marquardt with bounds as in lmfit, differences over a tenth of the ranges."""
    import lmfit

    names = ("a", "b", "c")
    start = lmfit.Parameters()
    for name in names:
        start.add(name, value=0.5, min=0.0, max=1.0)

    def gaps(found: Any) -> Array:
        z = np.array([found[name].value for name in names])
        return np.append(_at(model, diameters, z), [0.0] * (3 if diameters == 1 else 0))

    lmfit.minimize(gaps, start, max_nfev=MOST_POINTS[diameters], epsfcn=STEP**2)


def by_optuna(model: Model, diameters: int) -> None:
    """Tree-structured Parzen estimators, optuna's default."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)

    def size(trial: Any) -> float:
        z = np.array([trial.suggest_float(name, 0.0, 1.0) for name in ("a", "b", "c")])
        return float(np.sum(_at(model, diameters, z) ** 2))

    sampler = optuna.samplers.TPESampler(seed=model.seed)
    optuna.create_study(sampler=sampler).optimize(size, n_trials=MOST_POINTS[diameters])


Calibration = Callable[[Model, int], Array | None]
WAYS: dict[str, tuple[tuple[int, ...], Calibration]] = {
    "stemcal, quick": ((1, 5), partial(by_stemcal, QUICK)),
    "stemcal, one surface over diameters": ((5,), partial(by_stemcal, OVER)),
    "stemcal, response surface and refinement": ((1, 5), partial(by_stemcal, SURFACE)),
    "scipy least_squares": ((1, 5), by_least_squares),
    "scipy Nelder–Mead": ((1, 5), by_simplex),
    "lmfit": ((1, 5), by_lmfit),
    "optuna TPE": ((1, 5), by_optuna),
}


# ---- counting


@dataclass(frozen=True)
class Count:
    """Runs until the aim (None: never), of the whole procedure, and the error of the result without roughness."""

    until: int | None
    whole: int
    result: float | None


def counted(way: Calibration, table: Mapping[str, float], seed: int, diameters: int, aim: float) -> Count:
    """Calibrate once and count the runs."""
    model = Model(table, seed)
    found = way(model, diameters)
    places = DIAMETERS if diameters > 1 else (8.0,)

    def smooth(x: Array) -> Array:
        return np.array([model.smooth(x, d) for d in places])

    sets: dict[tuple[float, ...], dict[float, float]] = {}
    until = None
    for number, (key, force) in enumerate(model.runs.items(), 1):
        forces = sets.setdefault(key[:-1], {})
        forces[key[-1]] = force
        if until is None and len(forces) == diameters:
            x = np.array(key[:-1])
            until = number if rms(smooth(x) if diameters > 1 else np.array(list(forces.values()))) <= aim else None
    result = None if found is None else rms(smooth(found))
    return Count(until, len(model.runs), result)


def optimum(table: Mapping[str, float]) -> float:
    """Return the least root mean square error over five diameters without roughness, %."""
    model = Model(table, 0)

    def gaps(z: Array) -> Array:
        return errors(np.array([model.smooth(LOW + (HIGH - LOW) * z, d) for d in DIAMETERS]))

    starts = np.random.default_rng(1).random((8, 3))
    return min(float(np.sqrt(np.mean(least_squares(gaps, z, bounds=(0.0, 1.0)).fun ** 2))) for z in starts)


def _row(name: str, counts: list[Count]) -> str:
    there = [one.until for one in counts if one.until is not None]
    until = f"{median(there):5g}" if 2 * len(there) > len(counts) else "    –"
    results = [one.result for one in counts if one.result is not None]
    result = f"{median(results):6.2f} (worst {max(results):.2f})" if results else ""
    return f"  {name:42}{until}{len(counts) - len(there):8}{median(one.whole for one in counts):8g}   {result}"


def drawn(found: Mapping[str, list[Count]], path: Path) -> None:
    """Draw the runs of five forces until the aim, a point per seed and a bar to the median of those that get there."""
    with new_figure(6.2, 2.9) as figure:
        axes = figure.add_subplot()
        for row, (name, counts) in enumerate(reversed(found.items())):
            there = sorted(one.until for one in counts if one.until is not None)
            axes.barh(row, median(there) if there else 0, color=BLUE if "stemcal" in name else FAINT, height=0.55)
            axes.plot(there, [row] * len(there), "k.", markersize=3)
            if len(there) < len(counts):
                text = f"  {len(counts) - len(there)} of {len(counts)} not"
                axes.annotate(text, (max(there, default=0), row), fontsize=7, va="center")
        axes.set_yticks(range(len(found)), list(reversed(found)), fontsize=8)
        axes.set_xlabel("runs until the error is at most the optimum + 2.5 %")
        figure.savefig(path, dpi=150, facecolor="white")


def main(table: Path, seeds: int = 5, figure: Path | None = None) -> None:
    """Print both tables."""
    if not table.exists():
        table.write_text(json.dumps(computed_table()), encoding="utf-8")
    forces = json.loads(table.read_text(encoding="utf-8"))
    modules = {name: name.split()[0].removesuffix(",") for name in WAYS}
    known = {name: way for name, way in WAYS.items() if find_spec(modules[name])}
    least = optimum(forces)
    for diameters, title, aim in ((1, "one force", CLOSE), (5, f"five forces, optimum {least:.2f} %", WITHIN * least)):
        print(f"{title}: until {aim:.2f} %, failed, whole procedure, error of the result in %", flush=True)
        found: dict[str, list[Count]] = {}
        for name, (jobs, way) in known.items():
            if diameters in jobs:
                found[name] = [counted(way, forces, seed, diameters, aim) for seed in range(seeds)]
                print(_row(name, found[name]), flush=True)
    if figure is not None:
        drawn(found, figure)


if __name__ == "__main__":
    place, *more = sys.argv[1:]
    with suppress(KeyboardInterrupt):
        main(Path(place), int(more[0]) if more else 5, Path(more[1]) if len(more) > 1 else None)
