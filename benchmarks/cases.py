"""The 32 distinct cases that the wild chrysanthemum paper simulated with LS-DYNA, and functions that run them.

Table 6 has 12 cases (screening), Table 9 has 15 (centre runs averaged), Table 13 has 5 (diameters).
"""

from __future__ import annotations

import csv
import multiprocessing
import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stemcal.cutting.parts import ShearTest
from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear
from stemcal.fem.warm import warm
from stemcal.solvers.embedded import shear_test
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).resolve().parent.parent / "configs"
SPEC = CONFIGS / "wild-chrysanthemum-as-published.yaml"


@dataclass(frozen=True)
class Case:
    """One case: its table, factor levels in the units of the spec, diameter in mm, the paper's force in N."""

    table: str
    levels: dict[str, float]
    diameter: float
    paper: float


def paper_cases(tables: Iterable[str] = ("screen", "rsm", "validate")) -> list[Case]:
    """Return the cases of the named tables."""
    makers = {"screen": _screening, "rsm": _surface, "validate": _validation}
    return [case for table in tables for case in makers[table]()]


def _rows(stage: str) -> list[tuple[dict[str, float], float, float]]:
    """Return levels, diameter and force of each printed run of a stage."""
    with (CONFIGS / "data" / "paper-forces.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row.pop("run").startswith(stage)]
    cells = [{name: float(cell) for name, cell in row.items() if cell} for row in rows]
    return [(row, row.pop("diameter"), row.pop("force")) for row in cells]


def _screening() -> list[Case]:
    return [Case("screen", levels, diameter, force) for levels, diameter, force in _rows("screen")]


def _surface() -> list[Case]:
    forces: dict[tuple[tuple[str, float], ...], list[float]] = {}
    for levels, _, force in _rows("rsm"):
        forces.setdefault(tuple(levels.items()), []).append(force)
    return [Case("rsm", dict(levels), 8.0, float(np.mean(found))) for levels, found in forces.items()]


def _validation() -> list[Case]:
    calibrated = {"yield_stress": 17.96, "failure_strain": 0.0387, "strain_rate_c": 87.27}
    return [Case("validate", calibrated, diameter, force) for _, diameter, force in _rows("validate")]


def tests_of(cases: list[Case]) -> list[ShearTest]:
    """Return the shear tests of the cases with the shipped study's choices."""
    study = load_study(SPEC)
    return [shear_test(study, case.levels, case.diameter) for case in cases]


def simulate_all(tests: list[ShearTest]) -> list[CuttingResult]:
    """Run shear tests on all cores, one process each; same order."""
    warm()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(os.cpu_count(), mp_context=context) as pool:
        return list(pool.map(shear, tests))


def agreement(simulated: np.ndarray, reference: np.ndarray) -> str:
    """Return correlation, mean ratio and mean absolute error in one line."""
    ratio = simulated / reference
    return (
        f"correlation {np.corrcoef(simulated, reference)[0, 1]:.3f}, mean ratio {ratio.mean():.3f}, "
        f"mean absolute error {100 * np.abs(ratio - 1).mean():.1f} %"
    )
