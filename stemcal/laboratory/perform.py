"""Simulation of a laboratory test: force over travel without the compliance of the contact, responses and checks."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from stemcal.arrays import Array
from stemcal.cutting.checks import MOST_BUCKLING, STROKE_TOO_SHORT, buckles, maximum_not_passed
from stemcal.cutting.end_state import shape_of
from stemcal.cutting.parts import SHARES, ShearTest
from stemcal.cutting.result import BreakWatch, CuttingResult, break_row, evaluate, filter_rows, force_history
from stemcal.cutting.simulate import shear
from stemcal.fem.model import Model
from stemcal.fem.state import State
from stemcal.fem.stepper import Inspect, simulate
from stemcal.laboratory.build import LaboratoryTest, build_piece, rounded
from stemcal.notes import Note
from stemcal.responses import FURTHER_CUT, PIECE, ForceTravel, Response, responses_in

# Below this relative widening, a piece counts as not widened.
_WIDENED = 1e-6


@dataclass(frozen=True)
class LaboratoryResult(CuttingResult):
    """Result of a virtual laboratory test; the other fields as in `CuttingResult`.

    until_break: Force over travel until the break, or to the end of the stroke.
    responses: Responses by name, in their units; a response that the curve does not determine is missing.
    """

    until_break: ForceTravel | None = None
    responses: dict[str, float] = field(default_factory=dict)

    def with_responses(self, responses: Iterable[Response]) -> LaboratoryResult:
        """Return the result with the values of those `responses` that the curve determines."""
        if self.until_break is None:
            return self
        values = {kind.name: value for kind in responses if (value := kind.value(self.until_break)) is not None}
        return replace(self, responses=values)


class Gauges:
    """Callable for `simulate(inspect=…)` that records the deflection of the contact and the buckling of the piece.

    Contact acts through springs (`fem.kernels.contact`). Their `deflection` depends on the mesh, not on the stem. It is
    the sum over the tools of the mean penetration of the skin, weighted by the forces (mm).
    """

    def __init__(self, test: LaboratoryTest, model: Model) -> None:
        self._start = model.mesh.nodes
        self._widening = test.kind.widens_evenly
        self.deflection: list[float] = []
        self.buckling: list[float] = []

    def __call__(self, _time: float, state: State) -> None:
        weighted, force = state.tools.sunk.T
        depths = np.divide(weighted, force, out=np.zeros_like(force), where=force > 0.0).tolist()
        # the supports count once, by their mean: with a mirror plane there is one, otherwise two with equal penetration
        self.deflection.append(depths[0] + float(np.mean(depths[1:] or [0.0])) if depths else 0.0)
        if self._widening:
            self.buckling.append(_unevenness(self._start[:, 1:], state.body.x[:, 1:]))


def _unevenness(before: Array, after: Array) -> float:
    """Return the largest deviation of nodes (N, 2) from a uniform widening by 1 + g, relative to the widening g R.

    The result is 0 for a piece that has not widened (Poisson's ratio 0): the quotient would be round-off.
    """
    moved = after - before
    widening = float(np.vdot(before, moved) / np.vdot(before, before))
    if abs(widening) < _WIDENED:
        return 0.0
    off = np.linalg.norm(moved - widening * before, axis=1).max()
    return float(off / (abs(widening) * np.linalg.norm(before, axis=1).max()))


# Incremented by every change that alters the responses of a test, so that stored runs are not reused after it.
REVISION = 8


def perform(test: LaboratoryTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Run a virtual laboratory test; arguments and errors as in `cutting.simulate.shear`."""
    diameter = test.stem.outer_diameter  # `rounded` changes the diameter of the mesh
    test = rounded(test)
    model, how = build_piece(test), test.discretisation
    scale = 1.0 / SHARES[how.symmetry]
    gauges, breaking = Gauges(test, model), BreakWatch(how.break_drop, filter_rows(test.loading, how))
    worked = [0.0]
    started = time.perf_counter()

    def look(t: float, state: State) -> None:
        gauges(t, state)
        worked.append(float(state.ledger.external_work[0]))
        if inspect is not None:
            inspect(t, state)

    def report(t: float, forces: Array, deleted: int) -> bool:
        step = test.loading.duration / how.integration.outputs
        driven = (worked[-1] - worked[-2]) / (test.loading.speed * step)
        force = scale * (float(forces[0, 2]) if len(forces) else driven)
        return how.stop_after_peak and breaking.is_past(force, deleted)

    history = simulate(model, test.loading.duration, report, look)
    wall = time.perf_counter() - started
    curve = force_history(test.loading, how, history, scale)
    curve = replace(curve, travel=curve.travel - np.array(gauges.deflection))
    broken = break_row(curve.force_filtered, curve.deleted, how.break_drop)
    result = evaluate(curve, history, test.material, broken, len(model.mesh.hexes), wall, balanced=broken)
    until_break = ForceTravel.until_break(curve.travel[:broken], curve.force_filtered[:broken], diameter, PIECE)
    shape = shape_of(model, history, how.symmetry)
    percent = 100.0 * gauges.buckling[np.flatnonzero(curve.deleted == 0)[-1]] if gauges.buckling else 0.0
    warnings = (*_of_tests(result), *([buckles(percent)] if percent > MOST_BUCKLING else ()))
    more = {"shape": shape, "until_break": until_break, "warnings": warnings}
    return LaboratoryResult(**{**vars(result), **more}).with_responses(responses_in(PIECE))


def cut(test: ShearTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Run a cutting test that is one of the laboratory tests; `inspect` and errors as in `perform`."""
    result = shear(test, inspect)
    curve, whole = result.history, result.history.travel < (result.break_travel or np.inf)
    own = ForceTravel.until_break(
        curve.travel[whole], curve.force_filtered[whole], test.stem.outer_diameter, FURTHER_CUT
    )
    further = LaboratoryResult(**{**vars(result), "until_break": own, "warnings": _of_tests(result)})
    return further.with_responses(responses_in(FURTHER_CUT))


def _of_tests(result: CuttingResult) -> tuple[Note, ...]:
    """Return the warnings of a test; that of a short stroke is replaced by one worded for laboratory tests."""
    stroke = float(result.history.travel[-1])
    return tuple(maximum_not_passed(stroke) if note.kind == STROKE_TOO_SHORT else note for note in result.warnings)
