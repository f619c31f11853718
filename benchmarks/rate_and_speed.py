"""Peak force versus added mass and versus blade speed, with and without a rate law.

python benchmarks/rate_and_speed.py mass       mass scaling 1e4, 1e3, 1e2, 10, true mass; 50 to 200 mm/min (an hour)
python benchmarks/rate_and_speed.py field      0.5, 1, 5 m/s at the true mass, four element sizes
python benchmarks/rate_and_speed.py machine    50 to 200 mm/min, and the effect of the rate law alone
python benchmarks/rate_and_speed.py filter     a third of and three times the travel per filter time of the strain rate

All runs are at the centre of the design, 8 mm, with a travel of 1.17 mm. Without a name, the last three rows are run.
"""

from __future__ import annotations

import itertools
import sys
from dataclasses import replace

from cases import SPEC, paper_cases

from stemcal.cutting.parts import ShearTest
from stemcal.cutting.simulate import shear
from stemcal.fem.warm import warm
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

LAWS = ("none", "paper", "cowper_symonds")
STROKE = 1.17  # mm
SPEEDS = (50.0, 100.0, 200.0)  # of testing machines, mm/min


def at(speed: float, law: str, divisor: int = 16) -> ShearTest:
    """Return the centre's test at a speed (mm/s) with elements of d over a divisor, as a spec would have it."""
    study = load_study(SPEC)
    solver = study.solver.model_copy(update={"rate_law": law})
    loading = study.loading.model_copy(update={"speed": speed, "duration": STROKE / speed})
    study = study.model_copy(update={"solver": solver, "loading": loading})
    test = shear_test(study, paper_cases(["rsm"])[0].levels, 8.0)
    if law == "none":
        test = replace(test, material=replace(test.material, strain_rate_c=0.0))
    how = test.discretisation
    size, step = 8.0 / divisor, how.integration.time_step
    integration = replace(how.integration, time_step=None if step is None else step * size / how.element_size)
    return replace(test, discretisation=replace(how, element_size=size, integration=integration))


def told(name: str, test: ShearTest) -> None:
    """Run a test and print what it says."""
    result = shear(test)
    print(
        f"{name}: {result.peak_force:.2f} N at {result.peak_travel:.3f} mm, {result.steps} steps, drift "
        f"{result.energy_drift_percent:.2f} %, contact at least {result.contact_energy_percent:.1f} %, kinetic at most "
        f"{result.kinetic_ratio_percent:.1f} %, blade against supports {result.inertia_percent:.1f} %",
        flush=True,
    )


def mass() -> None:
    """Print the force with less and less mass added, at each speed of a testing machine."""
    for speed, law, scaling in itertools.product(SPEEDS, LAWS[1:], (1.0e4, 1.0e3, 1.0e2, 10.0, 1.0)):
        told(f"{law}, {speed:g} mm/min, mass scaling {scaling:g}", weighing(at(speed / 60.0, law), scaling))


def weighing(test: ShearTest, scaling: float) -> ShearTest:
    """Return a test with so many times the stem's mass, and the time step that goes with it."""
    step = 40.0e-6 * (scaling / 1.0e4) ** 0.5
    how = replace(test.discretisation.integration, mass_scaling=scaling, time_step=step if scaling > 1.0 else None)
    return replace(test, discretisation=replace(test.discretisation, integration=how))


def field() -> None:
    """Print the force at speeds of the field."""
    for law in ("none", "cowper_symonds"):
        for speed in (500.0, 1000.0, 5000.0):
            for divisor in (12, 16, 20, 24):
                told(f"{law}, {speed / 1000.0:g} m/s, d/{divisor}", at(speed, law, divisor))


def machine() -> None:
    """Print the force at speeds of a testing machine, and at 100 mm/min with a C that makes the law's effect the same.

    A law of ε̇/C knows no speed but by the rate, which goes with it: k times the speed is C/k but for inertia.
    """
    for law in LAWS:
        for speed in SPEEDS:
            told(f"{law}, {speed:g} mm/min", at(speed / 60.0, law))
            if law == "cowper_symonds" and speed != 100.0:
                same = at(100.0 / 60.0, law)
                c = same.material.strain_rate_c * 100.0 / speed
                told("  100 mm/min, C for it", replace(same, material=replace(same.material, strain_rate_c=c)))


def smoothing() -> None:
    """Print the force with the rate smoothed over a third of the travel as shipped, as shipped, and three times it."""
    for speed in (50.0 / 60.0, 100.0 / 60.0, 200.0 / 60.0, 1000.0):
        for share in (0.3, 1.0, 3.0):
            test = at(speed, "cowper_symonds")
            time = share * test.material.rate_filter
            told(f"{speed:.3g} mm/s, {share:g} times", replace(test, material=replace(test.material, rate_filter=time)))


ROWS = {"mass": mass, "field": field, "machine": machine, "filter": smoothing}

if __name__ == "__main__":
    warm(precision="mixed")
    for row in sys.argv[1:] or ["field", "machine", "filter"]:
        ROWS[row]()
