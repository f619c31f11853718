"""The virtual shear test: a hollow stem on two supports, a wedge that comes down across it, the force it meets.

The stem lies along x, the blade's edge along y at mid-span, the blade moves down along −z.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import MeshSize, build, mesh_size, placed, stem_mesh
from stemcal.cutting.end_state import Shape, shape_of
from stemcal.cutting.parts import (
    SHARES,
    Blade,
    Discretisation,
    Loading,
    ShearTest,
    Stem,
    Supports,
    Symmetry,
    rate_filter,
)
from stemcal.cutting.result import (
    BreakWatch,
    CuttingResult,
    ForceHistory,
    break_row,
    evaluate,
    filter_rows,
    force_history,
    travel_at,
)
from stemcal.fem.stepper import Inspect, simulate

__all__ = [
    "REVISION",
    "SHARES",
    "Blade",
    "CuttingResult",
    "Discretisation",
    "ForceHistory",
    "Loading",
    "MeshSize",
    "Shape",
    "ShearTest",
    "Stem",
    "Supports",
    "Symmetry",
    "build",
    "mesh_size",
    "placed",
    "rate_filter",
    "shear",
    "stem_mesh",
]

# Raised whenever a change makes the same test give another force, so that stored runs are not taken for new ones.
REVISION = 8


def shear(
    test: ShearTest, watch: Callable[[float, float], None] | None = None, inspect: Inspect | None = None
) -> CuttingResult:
    """Run a virtual shear test.

    Parameters
    ----------
    watch : callable, optional
        Called after every output with the travel (mm) and the force (N).
    inspect : callable, optional
        Called with time and solver state, see `fem.stepper.simulate`.

    Raises
    ------
    SimulationFailed
        If the solver's state stops being physical or the blade never meets the stem.
    """
    model = build(test)
    scale = 1.0 / SHARES[test.discretisation.symmetry]
    how = test.discretisation
    breaking = BreakWatch(how.break_drop, filter_rows(test))
    started = time.perf_counter()

    def report(t: float, forces: NDArray[np.float64], deleted: int) -> bool:
        force = scale * float(forces[0, 2])
        if watch is not None:
            watch(travel_at(test, t), force)
        return breaking.is_past(force, deleted) and how.stop_after_peak

    history = simulate(model, test.loading.duration, report, inspect)
    wall = time.perf_counter() - started
    curve = force_history(test, history, scale)
    broken = break_row(curve.force_filtered, curve.deleted, how.break_drop)
    result = evaluate(curve, history, broken, len(model.mesh.hexes), wall, filter_rows(test))
    return replace(result, shape=shape_of(model, history, how.symmetry))
