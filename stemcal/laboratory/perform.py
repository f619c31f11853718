"""The simulation of a laboratory test: mesh, contact, integration, curve and doubts are those of the shear test."""

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting import ShearTest, shear
from stemcal.cutting.end_state import shape_of
from stemcal.cutting.parts import SHARES
from stemcal.cutting.result import (
    BreakWatch,
    CuttingResult,
    ForceHistory,
    break_row,
    evaluate,
    filter_rows,
    force_history,
)
from stemcal.fem.state import State
from stemcal.fem.stepper import Inspect, simulate
from stemcal.laboratory.build import build, rounded
from stemcal.laboratory.parts import LaboratoryTest
from stemcal.laboratory.result import Gauges, LaboratoryResult, curve_responses, responses_of
from stemcal.note import Note
from stemcal.run_warnings import MOST_BUCKLING, STROKE_TOO_SHORT, buckles, maximum_not_passed

# Raised whenever a change makes the same test give other responses, so that stored runs are not taken for new ones.
REVISION = 7


def perform(test: LaboratoryTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Run a virtual laboratory test; arguments and errors as of `cutting.shear`."""
    test = rounded(test)
    model, how = build(test), test.discretisation
    scale = 1.0 / SHARES[how.symmetry]
    gauges, breaking = Gauges(test, model), BreakWatch(how.break_drop, filter_rows(test))
    worked = [0.0]
    started = time.perf_counter()

    def look(t: float, state: State) -> None:
        gauges(t, state)
        worked.append(float(state.ledger.external_work[0]))
        if inspect is not None:
            inspect(t, state)

    def report(t: float, forces: NDArray[np.float64], deleted: int) -> bool:
        step = test.loading.duration / how.integration.outputs
        driven = (worked[-1] - worked[-2]) / (test.loading.speed * step)
        force = scale * (float(forces[0, 2]) if len(forces) else driven)
        return how.stop_after_peak and breaking.is_past(force, deleted)

    history = simulate(model, test.loading.duration, report, look)
    wall = time.perf_counter() - started
    curve = force_history(test, history, scale)
    curve = replace(curve, travel=curve.travel - np.array(gauges.give))
    broken = break_row(curve.force_filtered, curve.deleted, how.break_drop)
    result = evaluate(curve, history, broken, len(model.mesh.hexes), wall, filter_rows(test), balanced=broken)
    responses, r2 = responses_of(curve, result, broken)
    shape = shape_of(model, history, how.symmetry)
    warnings = _of_tests(result) + _buckling(gauges, curve)
    more = {"shape": shape, "responses": responses, "slope_r2": r2, "warnings": warnings}
    return LaboratoryResult(**{**vars(result), **more})


def _buckling(gauges: Gauges, curve: ForceHistory) -> tuple[Note, ...]:
    """Return the doubt about a pressed piece that is out of shape when the first element fails."""
    whole = np.flatnonzero(curve.deleted == 0)[-1]
    percent = 100.0 * gauges.buckling[whole] if gauges.buckling else 0.0
    return (buckles(percent),) if percent > MOST_BUCKLING else ()


def cut(test: ShearTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Run a virtual shear test as one of the laboratory's; the rest as in `perform`.

    Its responses are those that the give of the contact, a matter of the mesh, does not decide.
    """
    result = shear(test, inspect)
    curve, whole = result.history, result.history.travel < (result.break_travel or np.inf)
    responses = curve_responses(curve.travel[whole], curve.force_filtered[whole], None)
    return LaboratoryResult(**{**vars(result), "responses": responses, "warnings": _of_tests(result)})


def _of_tests(result: CuttingResult) -> tuple[Note, ...]:
    """Return the warnings, that of a stroke in terms of these tests."""
    stroke = float(result.history.travel[-1])
    return tuple(maximum_not_passed(stroke) if one.kind == STROKE_TOO_SHORT else one for one in result.warnings)
