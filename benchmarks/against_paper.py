"""Compare the forces of the embedded solver with the LS-DYNA forces of the paper, for both strain-rate laws.

    python benchmarks/against_paper.py [PICTURE]

The parity plot is written to docs/images/parity.png unless another file is given.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from cases import CONFIGS, Case, agreement, paper_cases, simulate_all, tests_of

from stemcal.cutting.result import CuttingResult
from stemcal.drawing.style import BLUE, FAINT, GREEN, ORANGE, new_figure

LAWS = {"paper": "the paper's law", "cowper_symonds": "Cowper and Symonds' law"}
TABLES = {"screen": ("Table 6", "o", BLUE), "rsm": ("Table 9", "s", ORANGE), "validate": ("Table 13", "^", GREEN)}
END = 400.0  # of both axes, N
PICTURE = CONFIGS.parent / "docs" / "images" / "parity.png"


def print_forces(law: str, cases: list[Case], results: list[CuttingResult]) -> None:
    """Print every case of one law, the agreement by table, and the quality of the runs."""
    paper, force = forces(cases, results)
    table = np.array([case.table for case in cases])
    print(f"strain-rate law: {law}")
    for case, result in zip(cases, results, strict=True):
        short = "" if result.stroke_was_enough else "  still rising at the end of the stroke"
        both = f"paper {case.paper:6.1f} N  here {result.peak_force:6.1f} N"
        print(f"  {case.table:8s} {case.diameter:4.0f} mm  {both}{short}")
    for name in TABLES:
        print(f"  {name:8s} {agreement(force[table == name], paper[table == name])}")
    print(f"  {'all 32':8s} {agreement(force, paper)}")
    print(
        f"  energy drift at most {max(r.energy_drift_percent for r in results):.2f} %, kinetic/internal at most "
        f"{max(r.kinetic_ratio_percent for r in results):.2f} %, hourglass/internal at most "
        f"{max(r.hourglass_ratio_percent for r in results):.1f} %",
        flush=True,
    )


def forces(cases: list[Case], results: list[CuttingResult]) -> tuple[np.ndarray, np.ndarray]:
    """Return the paper's and our peak forces, N."""
    return np.array([case.paper for case in cases]), np.array([result.peak_force for result in results])


def plot_parity(cases: list[Case], by_law: dict[str, list[CuttingResult]], picture: Path) -> None:
    """Draw our forces over the paper's, one panel per law, with the line of equality and a fifth to either side."""
    table = np.array([case.table for case in cases])
    with new_figure(7.2, 4.2) as figure:
        panels = figure.subplots(1, len(by_law), sharex=True, sharey=True)
        for axes, (law, results) in zip(panels, by_law.items(), strict=True):
            paper, force = forces(cases, results)
            ends = np.array([0.0, END])
            axes.fill_between(ends, 0.8 * ends, 1.2 * ends, color="#e6e9ed", linewidth=0)
            axes.plot(ends, ends, color=FAINT, linewidth=0.8)
            for name, (label, mark, colour) in TABLES.items():
                axes.plot(paper[table == name], force[table == name], mark, color=colour, markersize=4.5, label=label)
            axes.set_title(LAWS[law])
            axes.set_xlabel("paper's LS-DYNA force, N")
            axes.set(xlim=(0.0, END), ylim=(0.0, END), aspect="equal")
        panels[0].set_ylabel("embedded solver's force, N")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.savefig(picture, dpi=160)


def main() -> None:
    cases = paper_cases()
    by_law = {}
    for law in LAWS:
        tests = [replace(test, material=replace(test.material, rate_law=law)) for test in tests_of(cases)]
        by_law[law] = simulate_all(tests)
        print_forces(law, cases, by_law[law])
    plot_parity(cases, by_law, Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)


if __name__ == "__main__":
    main()
