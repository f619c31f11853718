"""A laboratory test simulated: its curve over a travel without the give of the contact, and how far to trust it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

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

Array = NDArray[np.float64]

# A piece that has widened by less than this share has not widened.
_WIDENED = 1e-6


@dataclass(frozen=True)
class LaboratoryResult(CuttingResult):
    """What a virtual laboratory test gives, besides those of every run.

    until_break: Force over travel until the break, or to the end of the stroke.
    responses: Its responses by name, in their units; those that the curve does not have are left out.
    """

    until_break: ForceTravel | None = None
    responses: dict[str, float] = field(default_factory=dict)

    def giving(self, responses: Iterable[Response]) -> LaboratoryResult:
        """Return it with these responses of the table, as far as the curve has them."""
        if self.until_break is None:
            return self
        found = {one.name: value for one in responses if (value := one.value(self.until_break)) is not None}
        return replace(self, responses=found)


class Gauges:
    """Called at the outputs of a simulation, reads how far contact gives and a pressed piece buckles.

    Contact is by springs (`fem.kernels.contact`) whose compliance depends on the mesh, not on the stem: for a
    tool it is the mean depth of the skin in it, weighted by the forces.
    """

    def __init__(self, test: LaboratoryTest, model: Model) -> None:
        self._start = model.mesh.nodes
        self._widening = test.kind.widens_evenly
        self.give: list[float] = []
        self.buckling: list[float] = []

    def __call__(self, _time: float, state: State) -> None:
        """Take a reading."""
        weighted, force = state.tools.sunk.T
        depths = np.divide(weighted, force, out=np.zeros_like(force), where=force > 0.0).tolist()
        # on one side of a mirror, or on both: the supports give alike
        self.give.append(depths[0] + float(np.mean(depths[1:] or [0.0])) if depths else 0.0)
        if self._widening:
            self.buckling.append(_unevenness(self._start[:, 1:], state.body.x[:, 1:]))


def _unevenness(before: Array, after: Array) -> float:
    """Return the greatest distance of a node (N, 2) from its place after an even widening 1 + g: a share of g R.

    Of a piece that has not widened, at a Poisson's ratio of 0, that would be rounding: 0.
    """
    moved = after - before
    widening = float(np.vdot(before, moved) / np.vdot(before, before))
    if abs(widening) < _WIDENED:
        return 0.0
    off = np.linalg.norm(moved - widening * before, axis=1).max()
    return float(off / (abs(widening) * np.linalg.norm(before, axis=1).max()))


# ---- the simulation: mesh, contact, integration, curve and doubts are those of the shear test


# Raised whenever a change makes the same test give other responses, so that stored runs are not taken for new ones.
REVISION = 7


def perform(test: LaboratoryTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Run a virtual laboratory test; arguments and errors as of `cutting.simulate.shear`."""
    diameter = test.stem.outer_diameter  # that of the mesh is wider
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

    def report(t: float, forces: NDArray[np.float64], deleted: int) -> bool:
        step = test.loading.duration / how.integration.outputs
        driven = (worked[-1] - worked[-2]) / (test.loading.speed * step)
        force = scale * (float(forces[0, 2]) if len(forces) else driven)
        return how.stop_after_peak and breaking.is_past(force, deleted)

    history = simulate(model, test.loading.duration, report, look)
    wall = time.perf_counter() - started
    curve = force_history(test.loading, how, history, scale)
    curve = replace(curve, travel=curve.travel - np.array(gauges.give))
    broken = break_row(curve.force_filtered, curve.deleted, how.break_drop)
    result = evaluate(curve, history, test.material, broken, len(model.mesh.hexes), wall, balanced=broken)
    until_break = ForceTravel.until_break(curve.travel[:broken], curve.force_filtered[:broken], diameter, PIECE)
    shape = shape_of(model, history, how.symmetry)
    whole = np.flatnonzero(curve.deleted == 0)[-1]
    # of a pressed piece: how far out of shape as the first element fails
    percent = 100.0 * gauges.buckling[whole] if gauges.buckling else 0.0
    warnings = (*_of_tests(result), *([buckles(percent)] if percent > MOST_BUCKLING else ()))
    more = {"shape": shape, "until_break": until_break, "warnings": warnings}
    return LaboratoryResult(**{**vars(result), **more}).giving(responses_in(PIECE))


def cut(test: ShearTest, inspect: Inspect | None = None) -> LaboratoryResult:
    """Run a virtual shear test as one of the laboratory's; the rest as in `perform`."""
    result = shear(test, inspect)
    curve, whole = result.history, result.history.travel < (result.break_travel or np.inf)
    own = ForceTravel.until_break(
        curve.travel[whole], curve.force_filtered[whole], test.stem.outer_diameter, FURTHER_CUT
    )
    found = LaboratoryResult(**{**vars(result), "until_break": own, "warnings": _of_tests(result)})
    return found.giving(responses_in(FURTHER_CUT))


def _of_tests(result: CuttingResult) -> tuple[Note, ...]:
    """Return the warnings, that of a stroke in terms of these tests."""
    stroke = float(result.history.travel[-1])
    return tuple(maximum_not_passed(stroke) if one.kind == STROKE_TOO_SHORT else one for one in result.warnings)
