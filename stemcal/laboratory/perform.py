"""What a laboratory test gives: its curve over a travel without the give of the contact, and its responses."""

import time
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting import ShearTest, shear
from stemcal.cutting.end_state import shape_of
from stemcal.cutting.parts import SHARES
from stemcal.cutting.result import BreakWatch, CuttingResult, break_row, evaluate, filter_rows, force_history
from stemcal.fem.model import Model
from stemcal.fem.state import State
from stemcal.fem.stepper import Inspect, simulate
from stemcal.laboratory.build import LaboratoryTest, build, rounded
from stemcal.note import MOST_BUCKLING, STROKE_TOO_SHORT, Note, buckles, maximum_not_passed

Array = NDArray[np.float64]

# Shares of the largest force between which the slope is taken, and the rows that it needs at least.
SECANT = (0.2, 0.5)
_FEWEST = 3
# A piece that has widened by less than this share has not widened.
_WIDENED = 1e-6


@dataclass(frozen=True)
class LaboratoryResult(CuttingResult):
    """What a virtual laboratory test gives, besides those of every run.

    Attributes
    ----------
    responses : dict
        By name; those that the curve does not have are left out.

        slope : N/mm, of the straight line fitted to the force over the travel from 20 to 50 % of the largest force
        force : N, until the break
        travel : mm, at the maximum
        work : mJ, until the break or the end of the stroke
    """

    responses: dict[str, float] = field(default_factory=dict)


def secant(travel: Array, force: Array, shares: tuple[float, float] = SECANT) -> float | None:
    """Return the slope (N/mm) of a line fitted by least squares to a curve until the break.

    It is fitted from one share of the largest force to another.

    None if fewer than three rows lie between.

    >>> import numpy as np
    >>> round(secant(np.arange(5.0), 2.0 * np.arange(5.0), (0.1, 0.9)), 9)
    2.0
    """
    low, high = (int(np.argmax(force >= share * force.max())) for share in shares)
    u, f = travel[low : high + 1], force[low : high + 1]
    if len(u) < _FEWEST or np.ptp(u) == 0.0 or np.ptp(f) == 0.0:
        return None
    return float(np.polyfit(u - u[0], f, 1)[0])


def curve_responses(travel: Array, force: Array, slope: float | None) -> dict[str, float]:
    """Return the responses of a curve (mm, N) until the break, with its slope; without those that it lacks."""
    peak = int(np.argmax(force))
    found = {} if slope is None else {"slope": slope}
    found |= {"force": float(force[peak]), "travel": float(travel[peak])}
    found["work"] = float(np.trapezoid(force, travel))
    return found


class Gauges:
    """Called at the outputs of a simulation, reads how far contact gives and a pressed piece buckles.

    Contact is by springs (`kernels.contact`) whose compliance depends on the mesh, not on the stem: for a tool it is
    the mean depth of the skin in it, weighted by the forces.
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
    """Return how far the worst node (N, 2) is from where an even widening 1 + g, fitted, takes it: a share of g R.

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
    """Run a virtual laboratory test; arguments and errors as of `cutting.shear`."""
    test = rounded(test)
    model, how = build(test), test.discretisation
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
    travel, force = curve.travel[:broken], curve.force_filtered[:broken]
    responses = {
        **curve_responses(travel, force, secant(travel, force)),
        "force": result.peak_force,
        "travel": result.peak_travel,
    }
    shape = shape_of(model, history, how.symmetry)
    whole = np.flatnonzero(curve.deleted == 0)[-1]
    # of a pressed piece: how far out of shape as the first element fails
    percent = 100.0 * gauges.buckling[whole] if gauges.buckling else 0.0
    warnings = (*_of_tests(result), *([buckles(percent)] if percent > MOST_BUCKLING else ()))
    more = {"shape": shape, "responses": responses, "warnings": warnings}
    return LaboratoryResult(**{**vars(result), **more})


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
