"""The virtual shear test: a hollow stem on two supports, a wedge that comes down across it, the force it meets.

The stem lies along x, the blade's edge along y at mid-span, the blade moves down along −z.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import build, stem_mesh
from stemcal.cutting.parts import SHARES, Blade, Discretisation, Loading, ShearTest, Stem, Supports, Symmetry
from stemcal.cutting.result import CuttingResult, ForceHistory, evaluate, force_history, travel_at
from stemcal.fem.stepper import simulate

__all__ = [
    "REVISION",
    "SHARES",
    "Blade",
    "CuttingResult",
    "Discretisation",
    "ForceHistory",
    "Loading",
    "ShearTest",
    "Stem",
    "Supports",
    "Symmetry",
    "build",
    "shear",
    "stem_mesh",
]

# Raised whenever a change makes the same test give another force, so that stored runs are not taken for new ones.
REVISION = 1


def shear(test: ShearTest, watch: Callable[[float, float], None] | None = None) -> CuttingResult:
    """Run a virtual shear test.

    Parameters
    ----------
    watch : callable, optional
        Called after every output with the travel (mm) and the force (N).

    Raises
    ------
    SimulationFailed
        If the solver's state stops being physical or the blade never meets the stem.
    """
    model = build(test)
    scale = 1.0 / SHARES[test.discretisation.symmetry]
    started = time.perf_counter()

    def report(t: float, forces: NDArray[np.float64]) -> None:
        if watch is not None:
            watch(travel_at(test, t), scale * float(forces[0, 2]))

    history = simulate(model, test.loading.duration, report)
    wall = time.perf_counter() - started
    return evaluate(force_history(test, history, scale), history, len(model.mesh.hexes), wall)
