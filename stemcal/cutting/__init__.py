"""The virtual shear test: a hollow stem on two supports, a wedge that comes down across it, the force it meets.

The stem is along x, the blade's edge along y at mid-span, the blade moves down along −z.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.blade import Blade
from stemcal.cutting.build import MeshSize, build, mesh_size, stem_mesh
from stemcal.cutting.end_state import Shape, shape_of
from stemcal.cutting.parts import (
    SHARES,
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
    "in_phases",
    "mean_over_phases",
    "mesh_size",
    "placed",
    "rate_filter",
    "shear",
    "stem_mesh",
]

# Raised whenever a change makes the same test give another force, so that stored runs are not taken for new ones.
REVISION = 8


def shear(test: ShearTest, inspect: Inspect | None = None) -> CuttingResult:
    """Run a virtual shear test.

    Parameters
    ----------
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
        return breaking.is_past(scale * float(forces[0, 2]), deleted) and how.stop_after_peak

    history = simulate(model, test.loading.duration, report, inspect)
    wall = time.perf_counter() - started
    curve = force_history(test, history, scale)
    broken = break_row(curve.force_filtered, curve.deleted, how.break_drop)
    result = evaluate(curve, history, broken, len(model.mesh.hexes), wall, filter_rows(test))
    return replace(result, shape=shape_of(model, history, how.symmetry))


# ---- the mesh in other places: erosion takes whole elements, so the force depends on where the nodes lie


def in_phases(test: ShearTest, count: int) -> tuple[ShearTest, ...]:
    """Return the test with the mesh shifted along the stem to `count` places; one phase is the test as it is.

    A shift by s elements mirrors one by −s, so the midpoints of `count` equal parts of [0, ½] represent all.
    """
    return (test,) if count == 1 else tuple(placed(test, (i + 0.5) / (2 * count)) for i in range(count))


def placed(test: ShearTest, shift: float) -> ShearTest:
    """Return the half model with its mesh shifted along the stem by a share of an element, 0 to ½."""
    return replace(test, discretisation=replace(test.discretisation, symmetry="half", shift=shift))


def mean_over_phases(results: Sequence[CuttingResult]) -> CuttingResult:
    """Return the first result with the mean peak force of all, their standard deviation, and the worst of each check.

    Curves stay those of the first phase.
    """
    if len(results) == 1:
        return results[0]
    peaks = np.array([result.peak_force for result in results])
    return replace(
        results[0],
        peak_force=float(peaks.mean()),
        peak_force_raw=float(np.mean([result.peak_force_raw for result in results])),
        peak_sd=float(peaks.std(ddof=1)),
        phase_peaks=tuple(float(peak) for peak in peaks),
        steps=sum(result.steps for result in results),
        wall_seconds=sum(result.wall_seconds for result in results),
        energy_drift_percent=max(result.energy_drift_percent for result in results),
        kinetic_ratio_percent=max(result.kinetic_ratio_percent for result in results),
        hourglass_ratio_percent=max(result.hourglass_ratio_percent for result in results),
        inertia_percent=max(result.inertia_percent for result in results),
        contact_energy_percent=min(result.contact_energy_percent for result in results),
        stroke_was_enough=all(result.stroke_was_enough for result in results),
        stroke_end=next((r.stroke_end for r in results if not r.stroke_was_enough), results[0].stroke_end),
        warnings=tuple(dict.fromkeys(warning for result in results for warning in result.warnings)),
    )
