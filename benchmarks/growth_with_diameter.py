"""Why the published ranges cannot fit all diameters: how fast the simulated force grows, and what changes that.

    python benchmarks/growth_with_diameter.py [--fits]

Prints the force at 7 and 11 mm and the exponent b of F ~ d^b for failure strains within and beyond the published
range, for two strokes, and for yield stresses that grow with the diameter; the measured forces grow as d^2.6. With
--fits also the joint fits of all five diameters, with one yield stress and with one that grows, beside F = a·d^b: the
largest error, and that of each diameter predicted from the others (5 minutes on one core).
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import stemcal
from stemcal import cutting
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[1] / "configs"
SPEC = CONFIGS / "wild-chrysanthemum.yaml"
DIAMETERS = (7.0, 11.0)
# stroke in s, failure strain, exponent of the yield stress
CASES = (
    *((0.5, 0.01, 0.0), (0.5, 0.03, 0.0), (0.5, 0.05, 0.0)),
    *((3.0, 0.05, 0.0), (3.0, 0.2, 0.0), (3.0, 0.4, 0.0), (3.0, 0.7, 0.0)),
    *((0.5, 0.03, 0.25), (0.5, 0.03, 0.5), (0.5, 0.03, 1.0)),
)


def main() -> None:
    """Print one line per case, and one per fit if they are asked for."""
    study = load_study(SPEC)
    for duration, strain, growth in CASES:
        forces = []
        for diameter in DIAMETERS:
            levels = {"yield_stress": 10.0, "failure_strain": strain}
            grown = study.with_(material={"yield_stress": {"at": "8 mm", "exponent": growth}})
            test = shear_test(grown, levels, diameter)
            forces.append(cutting.shear(replace(test, loading=replace(test.loading, duration=duration))).peak_force)
        exponent = np.log(forces[1] / forces[0]) / np.log(DIAMETERS[1] / DIAMETERS[0])
        way = duration * study.loading.speed
        print(
            f"failure strain {strain:g}, yield stress ~ d^{growth:g}, stroke {way:.2f} mm: "
            f"{forces[0]:.1f} and {forces[1]:.1f} N, d^{exponent:.2f}",
            flush=True,
        )
    if "--fits" in sys.argv[1:]:
        print_fits()


def print_fits() -> None:
    """Print the joint fits beside the formula through the same forces."""
    for name in ("wild-chrysanthemum-joint", "wild-chrysanthemum-growing"):
        found = stemcal.calibrate(stemcal.load_study(CONFIGS / f"{name}.yaml"), progress=False)
        joint = found.inversion.joint
        assert joint is not None and joint.null is not None
        print(f"{name}: {joint.max_abs_error_percent:.1f} %, left out {joint.max_abs_left_out_error_percent:.1f} %")
    null = joint.null
    print(f"F = a·d^{null.exponent:.2f}: {null.max_abs_error_percent:.1f} %, left out ", end="")
    print(f"{null.max_abs_left_out_error_percent:.1f} %")


if __name__ == "__main__":
    main()
