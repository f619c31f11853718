"""Check whether contact creates energy: print the smallest contact energy, relative to the work of the blade.

python benchmarks/contact_energy.py            hard, soft and fine cases, and six crops
python benchmarks/contact_energy.py sizes      centre, yield stress 60, chickpea with elements of d/12 to d/32

Friction and damping only dissipate energy, so a negative contact energy is numerical. The script takes a minute on one
core, `sizes` several minutes.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from cases import paper_cases, tests_of

from stemcal.cli.spec import spec_text
from stemcal.cutting.parts import ShearTest
from stemcal.cutting.simulate import shear
from stemcal.fem.warm import warm
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

# Published ranges of elastic modulus and yield stress, MPa: docs/reference/crops.md.
CROPS = {
    "wheat": ((4760, 6580), (8.5, 31.2)),
    "rice": ((200, 720), (7.2, 24.8)),
    "rape": ((1570, 2040), (1.6, 48.1)),
    "sugarcane": ((86, 1172), (5.2, 46)),
    "chickpea": ((303, 695), (17.1, 39.2)),
    "maize": ((10, 674), (10, 20)),
}
LONGER = 1.2  # s, enough for all but the softest to break


def centre(divisor: int = 16, **changes: float) -> ShearTest:
    """Return the centre of the design, 8 mm, with elements of d over a divisor and material parameters changed."""
    test = tests_of(paper_cases(["rsm"])[:1])[0]
    how = test.discretisation
    ratio = 16 / divisor
    integration = replace(how.integration, outputs=1000, time_step=(how.integration.time_step or 0.0) * ratio)
    return replace(
        test,
        material=replace(test.material, **changes),
        loading=replace(test.loading, duration=LONGER),
        discretisation=replace(how, element_size=how.element_size * ratio, integration=integration),
    )


HARD = {
    "centre": {},
    "yield stress 60 MPa": {"yield_stress": 60.0},
    "E 499, yield stress 28.1 (chickpea)": {"elastic_modulus": 499.0, "yield_stress": 28.1},
    "E 629, yield stress 25.6 (sugarcane)": {"elastic_modulus": 629.0, "yield_stress": 25.6},
}
SOFT = {"yield_stress": 12.0, "failure_strain": 0.045, "elastic_modulus": 1500.0, "poisson_ratio": 0.25}
STRONG = {"yield_stress": 20.0, "failure_strain": 0.05, "elastic_modulus": 1200.0}


def crops() -> dict[str, ShearTest]:
    """Return the middle and the corners of each crop's ranges of elastic modulus and yield stress."""
    tests = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "crop.yaml"
        for crop, ranges in CROPS.items():
            text = spec_text("crop", full=True)
            for old, new in zip(("800, high: 1200", "10, high: 20"), ranges, strict=True):
                text = text.replace(f"low: {old}", f"low: {new[0]}, high: {new[1]}")
            for old, new in (("coarsening: 6", "coarsening: 2"), ("around: 2", "around: 1"), ("0.25", "0.75")):
                text = text.replace(old, new)
            path.write_text(text, encoding="utf-8")
            study = load_study(path)
            middle = {factor.name: 0.5 * (factor.low + factor.high) for factor in study.factors}
            tests[f"{crop}, middle"] = shear_test(study, middle, 8.0)
            ends = [(study.factor(name).low, study.factor(name).high) for name in ("elastic_modulus", "yield_stress")]
            for modulus, strength in itertools.product(*ends):
                levels = {**middle, "elastic_modulus": modulus, "yield_stress": strength}
                tests[f"{crop}, E {modulus:g}, yield stress {strength:g}"] = shear_test(study, levels, 8.0)
    return tests


def told(name: str, test: ShearTest) -> None:
    """Run a test and print its force, what contact holds at least, and the checks."""
    result = shear(test)
    print(
        f"{name}: {result.peak_force:.1f} N, contact at least {result.contact_energy_percent:.1f} % of the work, drift "
        f"{result.energy_drift_percent:.2f} %, kinetic {result.kinetic_ratio_percent:.1f} %, hourglass "
        f"{result.hourglass_ratio_percent:.1f} %",
        flush=True,
    )


def points() -> None:
    for name, changes in HARD.items():
        told(name, centre(**changes))
    for divisor in (16, 32, 40):
        told(f"yield stress 12, failure strain 0.045, E 1500, d/{divisor}", centre(divisor, **SOFT))
    for name, test in crops().items():
        told(name, test)


def sizes() -> None:
    for name, changes in list(HARD.items())[:3]:
        for divisor in (12, 16, 24, 32):
            told(f"{name}, d/{divisor}", centre(divisor, **changes))


ROWS = {"points": points, "sizes": sizes}

if __name__ == "__main__":
    warm()
    for row in sys.argv[1:] or ["points"]:
        ROWS[row]()
