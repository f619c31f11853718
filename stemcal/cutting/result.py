"""From a solver's history to what a shear test is made for: the force curve, its peak, and whether to trust it."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.end_state import Shape
from stemcal.cutting.parts import ShearTest
from stemcal.errors import SimulationFailed
from stemcal.fem.history import History

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ForceHistory:
    """The whole test over time (a quarter model's sums already times four).

    Forces in N, energies in mJ, time in s, travel of the blade from first touch in mm.
    """

    time: Array
    travel: Array
    force: Array
    force_filtered: Array
    kinetic: Array
    internal: Array
    hourglass: Array
    eroded: Array
    contact: Array
    external: Array
    balance: Array
    deleted: NDArray[np.int64]


@dataclass(frozen=True)
class CuttingResult:
    """What a virtual shear test gives.

    Attributes
    ----------
    peak_force, peak_force_raw : float
        Largest force after and before the filter, N.
    peak_time, peak_travel : float
        When and where the filtered force peaks, s and mm.
    elements, deleted_elements : int
        Elements of the mesh that was computed, and how many of them were eroded by the time of the peak.
    stroke_was_enough : bool
        Whether the force has fallen clearly below its peak by the end of the stroke.
    energy_drift_percent : float
        Largest error of the energy balance against the largest work done.
    kinetic_ratio_percent : float
        Largest kinetic over internal energy before the first element fails (or over the stroke if none does), after
        the first tenth of the work.
    hourglass_ratio_percent : float
        Largest hourglass over internal energy on the way to the peak, after the first tenth of the work.
    """

    peak_force: float
    peak_force_raw: float
    peak_time: float
    peak_travel: float
    elements: int
    deleted_elements: int
    steps: int
    wall_seconds: float
    element_steps_per_second: float
    energy_drift_percent: float
    kinetic_ratio_percent: float
    hourglass_ratio_percent: float
    stroke_was_enough: bool
    warnings: tuple[str, ...]
    history: ForceHistory
    peak_sd: float | None = None
    phase_peaks: tuple[float, ...] = ()
    shape: Shape | None = None


def travel_at(test: ShearTest, t: float) -> float:
    """Return how far the blade has come since it touched the stem, mm."""
    return test.loading.speed * t - test.loading.gap


def force_history(test: ShearTest, history: History, scale: float) -> ForceHistory:
    """Return the curves of the whole stem: the solver's sums times `scale`, the force also filtered."""
    force = scale * history.force[:, 0, 2]
    window = test.discretisation.filter_window / (history.time[1] - history.time[0])
    return ForceHistory(
        time=history.time,
        travel=test.loading.speed * history.time - test.loading.gap,
        force=force,
        force_filtered=moving_mean(force, max(1, round(window))),
        kinetic=scale * history.kinetic,
        internal=scale * history.internal,
        hourglass=scale * history.hourglass,
        eroded=scale * history.eroded,
        contact=scale * history.contact,
        external=scale * history.external,
        balance=scale * history.balance,
        deleted=history.deleted,
    )


def moving_mean(values: Array, window: int) -> Array:
    """Return the centred mean over `window` values (made odd); at the ends over those there are."""
    half = window // 2
    total = np.concatenate([[0.0], np.cumsum(values)]).astype(np.float64)
    index = np.arange(len(values))
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    return np.asarray((total[high] - total[low]) / (high - low))


class PeakWatch:
    """Tells while a test goes on whether its force has fallen below half its peak and stayed there.

    It has stayed if it was down for a quarter of the time that it took to fall.
    """

    def __init__(self) -> None:
        self.peak = 0.0
        self.fell_at = inf

    def is_past(self, time: float, force: float) -> bool:
        """Take note of the force at a time, and say whether the peak is over."""
        self.peak = max(self.peak, force)
        self.fell_at = min(self.fell_at, time) if force < 0.5 * self.peak else inf
        return time > 1.25 * self.fell_at


# The stroke was long enough if the force ends below this share of its peak.
FALLEN = 0.9
# Ratios of energies mean nothing before the blade has done this share of its work.
_BEGINNING = 0.1
# Shares above which a result is to be looked at before it is used, percent.
_MOST_KINETIC = 5.0
_MOST_HOURGLASS = 10.0
_MOST_DRIFT = 2.0


def evaluate(curve: ForceHistory, history: History, elements: int, wall: float) -> CuttingResult:
    """Return the peak of a force curve and the measures of trust in it.

    Raises
    ------
    SimulationFailed
        If the blade met no resistance.
    """
    peak = int(np.argmax(curve.force_filtered))
    if curve.force_filtered[peak] <= 0.0:
        raise SimulationFailed("no_contact", "the blade met no resistance: check gap, speed and duration")
    fallen = bool(curve.force_filtered[-1] < FALLEN * curve.force_filtered[peak])
    checks = {
        "energy_drift_percent": history.drift_percent(),
        "kinetic_ratio_percent": _ratio_percent(curve.kinetic, curve, _before_fracture(curve)),
        "hourglass_ratio_percent": _ratio_percent(curve.hourglass, curve, peak),
    }
    return CuttingResult(
        peak_force=float(curve.force_filtered[peak]),
        peak_force_raw=float(curve.force.max()),
        peak_time=float(curve.time[peak]),
        peak_travel=float(curve.travel[peak]),
        elements=elements,
        deleted_elements=int(curve.deleted[peak]),
        steps=history.steps,
        wall_seconds=wall,
        element_steps_per_second=elements * history.steps / wall,
        energy_drift_percent=checks["energy_drift_percent"],
        kinetic_ratio_percent=checks["kinetic_ratio_percent"],
        hourglass_ratio_percent=checks["hourglass_ratio_percent"],
        stroke_was_enough=fallen,
        warnings=_warnings(fallen, float(curve.travel[-1]), **checks),
        history=curve,
    )


def _before_fracture(curve: ForceHistory) -> int:
    """Return the last row before the first element fails."""
    if curve.deleted[-1] == 0:
        return len(curve.time) - 1
    return max(int(np.argmax(curve.deleted > 0)) - 1, 1)


def _ratio_percent(part: Array, curve: ForceHistory, until: int) -> float:
    """Return the largest part/internal in percent up to row `until`, past the first tenth of the work done by then."""
    rows = np.arange(len(part))
    counted = (rows <= until) & (curve.external > _BEGINNING * max(curve.external[until], 1e-12))
    return float(100.0 * np.max(part[counted] / curve.internal[counted], initial=0.0))


def _warnings(
    fallen: bool,
    stroke: float,
    energy_drift_percent: float,
    kinetic_ratio_percent: float,
    hourglass_ratio_percent: float,
) -> tuple[str, ...]:
    """Return what a careful engineer would want to know about a run before using its force."""
    said = []
    if not fallen:
        said.append(
            f"the force has not fallen after its peak within the {stroke:.3g} mm stroke: the true maximum may be "
            "larger; lengthen loading.duration"
        )
    if energy_drift_percent > _MOST_DRIFT:
        said.append(f"the energy balance drifts by {energy_drift_percent:.1f} %; lower solver.time_step_safety")
    if kinetic_ratio_percent > _MOST_KINETIC:
        said.append(
            f"kinetic energy is {kinetic_ratio_percent:.1f} % of internal energy before fracture; lower "
            "solver.mass_scaling"
        )
    if hourglass_ratio_percent > _MOST_HOURGLASS:
        said.append(
            f"hourglass energy is {hourglass_ratio_percent:.1f} % of internal energy; refine the mesh or change "
            "solver.hourglass"
        )
    return tuple(said)
