"""Print the embedded solver's forces beside the paper's LS-DYNA forces, for both strain-rate laws.

python benchmarks/against_paper.py
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from cases import agreement, paper_cases, simulate_all, tests_of


def main() -> None:
    cases = paper_cases()
    paper = np.array([case.paper for case in cases])
    table = np.array([case.table for case in cases])
    for law in ("paper", "cowper_symonds"):
        tests = [replace(test, material=replace(test.material, rate_law=law)) for test in tests_of(cases)]
        results = simulate_all(tests)
        force = np.array([result.peak_force for result in results])
        print(f"strain-rate law: {law}")
        for case, result in zip(cases, results, strict=True):
            short = "" if result.stroke_was_enough else "  still rising at the end of the stroke"
            forces = f"paper {case.paper:6.1f} N  here {result.peak_force:6.1f} N"
            print(f"  {case.table:8s} {case.diameter:4.0f} mm  {forces}{short}")
        for name in ("screen", "rsm", "validate"):
            print(f"  {name:8s} {agreement(force[table == name], paper[table == name])}")
        print(f"  {'all 32':8s} {agreement(force, paper)}")
        print(
            f"  energy drift at most {max(r.energy_drift_percent for r in results):.2f} %, kinetic/internal at most "
            f"{max(r.kinetic_ratio_percent for r in results):.2f} %, hourglass/internal at most "
            f"{max(r.hourglass_ratio_percent for r in results):.1f} %"
        )


if __name__ == "__main__":
    main()
