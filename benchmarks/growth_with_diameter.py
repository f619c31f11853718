"""Why the published ranges cannot fit all diameters: how fast the simulated force grows, and what changes that.

python benchmarks/growth_with_diameter.py

Prints the force at 7 and 11 mm and the exponent b of F ~ d^b for failure strains within and beyond the published
range and for two strokes; the measured forces grow as d^2.6.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from stemcal import cutting
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

SPEC = Path(__file__).parents[1] / "configs" / "wild-chrysanthemum.yaml"
DIAMETERS = (7.0, 11.0)
CASES = ((0.5, 0.01), (0.5, 0.03), (0.5, 0.05), (3.0, 0.05), (3.0, 0.2), (3.0, 0.4), (3.0, 0.7))


def main() -> None:
    """Print one line per case."""
    study = load_study(SPEC)
    for duration, strain in CASES:
        forces = []
        for diameter in DIAMETERS:
            test = shear_test(study, {"yield_stress": 10.0, "failure_strain": strain}, diameter)
            forces.append(cutting.shear(replace(test, loading=replace(test.loading, duration=duration))).peak_force)
        exponent = np.log(forces[1] / forces[0]) / np.log(DIAMETERS[1] / DIAMETERS[0])
        way = duration * study.loading.speed
        print(
            f"failure strain {strain:g}, stroke {way:.2f} mm: {forces[0]:.1f} and {forces[1]:.1f} N, d^{exponent:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
