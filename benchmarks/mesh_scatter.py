"""How much of the force is the mesh's: its phase, its size, its random place.

python benchmarks/mesh_scatter.py diameters    7 to 11 mm with 1, 4 and 8 phases
python benchmarks/mesh_scatter.py seeds        the centre of the design over 20 random places of the mesh
python benchmarks/mesh_scatter.py sizes        element sizes 2 to 0.5 mm, plain and with a failure length of 1 mm
python benchmarks/mesh_scatter.py screening    Table 6's twelve runs over ten phases, against the paper
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
from cases import agreement, paper_cases, simulate_all, tests_of

from stemcal.cutting import CuttingResult, ShearTest, in_phases, mean_over_phases, perturbed


def over_phases(tests: list[ShearTest], count: int) -> list[CuttingResult]:
    """Return each test's mean over `count` phases."""
    results = simulate_all([phase for test in tests for phase in in_phases(test, count)])
    return [mean_over_phases(results[i : i + count]) for i in range(0, len(results), count)]


def diameters() -> None:
    """Print the force over the diameter for 1, 4 and 8 phases."""
    cases = paper_cases(["validate"])
    for count in (1, 4, 8):
        results = over_phases(tests_of(cases), count)
        force = np.array([result.peak_force for result in results])
        steps = " ".join(f"{100 * step:+.0f} %" for step in np.diff(force) / force[:-1])
        exponent = np.polyfit(np.log([case.diameter for case in cases]), np.log(force), 1)[0]
        listed = ", ".join(
            f"{case.diameter:g} mm {result.peak_force:.1f}" + (f" ± {result.peak_sd:.1f}" if result.peak_sd else "")
            for case, result in zip(cases, results, strict=True)
        )
        print(f"{count} phases: {listed} N; from one to the next {steps}; grows as d^{exponent:.2f}", flush=True)


def seeds() -> None:
    """Print the scatter of the centre of the design over random places of the mesh."""
    centre = tests_of(paper_cases(["rsm"])[:1])[0]
    force = np.array([result.peak_force for result in simulate_all([perturbed(centre, 1, i) for i in range(20)])])
    print(
        f"20 seeds: mean {force.mean():.1f} N, SD {force.std(ddof=1):.1f} N, {force.min():.1f} to {force.max():.1f} N"
    )


def sizes() -> None:
    """Print the force at the centre of the design over the element size."""
    centre = tests_of(paper_cases(["rsm"])[:1])[0]
    for length in (None, 1.0):
        material = replace(centre.material, failure_length=length)
        print("failure strain", "as it is" if length is None else f"meant for {length:g} mm elements")
        for size in (2.0, 4 / 3, 1.0, 0.75, 0.5):
            how = replace(centre.discretisation, element_size=size, through_wall=None)
            result = simulate_all([replace(centre, material=material, discretisation=how)])[0]
            print(f"  {size:.2f} mm: {result.elements:6d} elements, {result.peak_force:6.1f} N", flush=True)


def screening() -> None:
    """Print what ten phases say of the distance to the paper: scatter or model."""
    cases = paper_cases(["screen"])
    paper = np.array([case.paper for case in cases])
    results = over_phases(tests_of(cases), 10)
    peaks = np.array([result.phase_peaks for result in results])
    scatter = peaks.std(axis=1, ddof=1) / peaks.mean(axis=1)
    for phase in range(10):
        print(f"phase {phase}: {agreement(peaks[:, phase], paper)}")
    print(f"mean of ten: {agreement(peaks.mean(axis=1), paper)}")
    low, high = 100 * scatter.min(), 100 * scatter.max()
    print(f"SD over phases: {100 * scatter.mean():.0f} % of the mean ({low:.0f} to {high:.0f} %)")


if __name__ == "__main__":
    for name in sys.argv[1:] or ["diameters", "seeds", "sizes", "screening"]:
        {"diameters": diameters, "seeds": seeds, "sizes": sizes, "screening": screening}[name]()
