"""Simulation of a virtual shear test, from its input to its result."""

import time
from dataclasses import replace

from stemcal.arrays import Array
from stemcal.cutting.build import build
from stemcal.cutting.end_state import shape_of
from stemcal.cutting.parts import SHARES, ShearTest, Symmetry
from stemcal.cutting.result import BreakWatch, CuttingResult, break_row, evaluate, filter_rows, force_history
from stemcal.cutting.severing import Severing
from stemcal.cutting.whole_cut import mean_over_travel, of_whole_cut
from stemcal.fem.state import State
from stemcal.fem.stepper import Inspect, simulate


def shear(test: ShearTest, inspect: Inspect | None = None) -> CuttingResult:
    """Run a virtual shear test; `inspect` as in `fem.stepper.simulate`.

    Raises `SimulationFailed` for the reasons of `fem.stepper.simulate`, or if the blade exerts no force on the stem.
    """
    model = build(test)
    scale = 1.0 / SHARES[test.discretisation.symmetry]
    how, whole = test.discretisation, test.parts
    breaking = BreakWatch(how.break_drop, filter_rows(test.loading, how))
    severing = Severing(model.mesh)
    started = time.perf_counter()

    def report(t: float, forces: Array, deleted: int) -> bool:
        if whole:
            return severing.time is not None
        return breaking.is_past(scale * float(forces[0, 2]), deleted) and how.stop_after_peak

    def look(t: float, state: State) -> None:
        if inspect is not None:
            inspect(t, state)
        severing(t, state)

    history = simulate(model, test.loading.duration, report, look if whole else inspect)
    wall = time.perf_counter() - started
    curve = force_history(test.loading, mean_over_travel(test) if whole else how, history, scale)
    if test.supports.kind != "span" or test.loading.sliding_angle:  # no force on a clamp is computed
        curve = replace(curve, supports=curve.force_filtered)
    broken = None if whole else break_row(curve.force_filtered, curve.deleted, how.break_drop)
    result = evaluate(curve, history, test.material, broken, len(model.mesh.hexes), wall, parts=whole)
    result = of_whole_cut(result, test, severing) if whole else result
    return replace(result, shape=shape_of(model, history, how.symmetry))


def placed(test: ShearTest, shift: float) -> ShearTest:
    """Return the test in a half model whose mesh is shifted along the stem by a share of an element, 0 to ½.

    Whole elements are deleted, so the force depends on the position of the nodes. Shifts by s and −s elements are
    mirror images, so midpoints of equal intervals of [0, ½] represent all positions.
    """
    symmetry: Symmetry = "none" if test.loading.sliding_angle else "half"
    return replace(test, discretisation=replace(test.discretisation, symmetry=symmetry, shift=shift))
