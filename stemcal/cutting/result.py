"""From a solver's history to what a shear test is made for: the force curve, its peak, and whether to trust it."""

from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.checks import (
    MOST_DRIFT,
    MOST_HOURGLASS,
    MOST_INERTIA,
    NEGLIGIBLE_MASS,
    energy_drifts,
    force_after_break,
    hourglass_energy,
    inertia_in_force,
    rate_above_law,
    stroke_too_short,
)
from stemcal.cutting.end_state import Shape
from stemcal.cutting.parts import Discretisation, Loading
from stemcal.errors import SimulationFailed
from stemcal.fem.kernels.nodes import EDGE, FRICTION, SURFACE
from stemcal.fem.material import Material
from stemcal.fem.stepper import History
from stemcal.notes import Note

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ForceHistory:
    """The whole test over time (a quarter model's sums already times four).

    Forces in N, energies in mJ, time in s, travel of the blade from first touch in mm. `force` is that on the blade,
    `supports` the filtered one on what carries the stem: they differ by its inertia. `contact` is the sum of what the
    blade's edge, its flanks, the supports and friction hold back of the blade's work. The force is along the travel;
    `along_edge` is what resists the sliding of an oblique edge along itself.
    """

    time: Array
    travel: Array
    force: Array
    along_edge: Array
    force_filtered: Array
    kinetic: Array
    internal: Array
    hourglass: Array
    eroded: Array
    contact: Array
    contact_edge: Array
    contact_flanks: Array
    contact_supports: Array
    contact_friction: Array
    supports: Array
    external: Array
    balance: Array
    deleted: NDArray[np.int64]
    parted: NDArray[np.int64]

    @property
    def failed(self) -> NDArray[np.int64]:
        """Elements that were deleted and places of the cut plane that have parted."""
        return self.deleted + self.parted


@dataclass(frozen=True)
class CuttingResult:
    """What a virtual shear test gives; forces in N, travel in mm, time in s, shares in percent.

    peak_force, peak_force_raw   largest force until the first fracture, after and before the filter
    peak_time, peak_travel       when and where the filtered force peaks
    elements, deleted_elements   elements of the mesh that was computed, and how many were eroded at the peak
    stroke_was_enough            whether the stem has fractured, or the force has fallen clearly below its peak by the
                                 end of the stroke
    energy_drift_percent         largest error in the energy balance against the largest work done
    kinetic_ratio_percent        largest kinetic over internal energy before the first element fails (or over the stroke
                                 if none does), after the first tenth of the work
    hourglass_ratio_percent      largest hourglass over internal energy on the way to the peak, after the first tenth
    inertia_percent              difference between the force on the blade and that on the supports at the peak, of the
                                 former: what inertia, true or added, has in the force
    added_mass_percent           what mass scaling and time step have added to the stem's mass; where they add nothing,
                                 inertia is the stem's own
    contact_energy_percent       smallest share of the blade's work that contact has held back until the first fracture,
                                 after the first tenth of the work. Friction and damping only take: a share below 0 is
                                 energy that the numbers have created
    break_travel                 travel of the blade at the first fracture (`break_row`), None without one; the curve
                                 beyond depends on the mesh and the swinging stem rather than on the material

    Of a whole cut `first_fracture_force` is the largest force until anything fails, `first_fracture_travel` the travel
    at which it does, `severed` whether the stem is in two parts, `severed_travel` the travel at which it is, and
    `cutting_energy` the work of the blade until then, or over the stroke, mJ.
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
    contact_energy_percent: float
    inertia_percent: float
    stroke_was_enough: bool
    warnings: tuple[Note, ...]
    history: ForceHistory
    break_travel: float | None = None
    shape: Shape | None = None
    added_mass_percent: float = 0.0
    first_fracture_force: float | None = None
    first_fracture_travel: float | None = None
    severed: bool | None = None
    severed_travel: float | None = None
    cutting_energy: float | None = None


def force_history(loading: Loading, how: Discretisation, history: History, scale: float) -> ForceHistory:
    """Return the curves of the whole stem: the solver's sums times `scale`, the force also filtered.

    The force is that on the first tool; without tools that of the ends that are driven, an interval's work over travel.
    """
    tools = history.force.shape[1] > 0
    angle = radians(loading.sliding_angle)
    if tools:
        force = scale * history.force[:, 0, 2]
    else:
        way = loading.speed * np.diff(history.time)
        force = scale * np.concatenate([[0.0], np.diff(history.external) / way])
    along_edge = scale * history.force[:, 0, 1] if angle else np.zeros_like(force)
    force = force * cos(angle) - along_edge * sin(angle) if angle else force
    carried = -scale * history.force[:, 1:, 2].sum(axis=1) if tools else force
    return ForceHistory(
        time=history.time,
        travel=loading.speed * history.time - loading.gap / cos(angle),
        force=force,
        along_edge=-along_edge,
        force_filtered=moving_mean(force, filter_rows(loading, how)),
        kinetic=scale * history.kinetic,
        internal=scale * history.internal,
        hourglass=scale * history.hourglass,
        eroded=scale * history.eroded,
        contact=scale * history.contact,
        contact_edge=scale * history.held[:, EDGE].sum(axis=1),
        contact_flanks=scale * history.held[:, SURFACE, :1].sum(axis=1),
        contact_supports=scale * history.held[:, SURFACE, 1:].sum(axis=1),
        contact_friction=scale * history.held[:, FRICTION].sum(axis=1),
        supports=moving_mean(carried, filter_rows(loading, how)),
        external=scale * history.external,
        balance=scale * history.balance,
        deleted=history.deleted,
        parted=history.parted,
    )


def filter_rows(loading: Loading, how: Discretisation) -> int:
    """Return the number of outputs in the filter's moving mean."""
    return max(1, round(how.filter_window * how.integration.outputs / loading.duration))


def moving_mean(values: Array, window: int) -> Array:
    """Return the centred mean over `window` values (made odd); at the ends over those there are."""
    half = window // 2
    total = np.concatenate([[0.0], np.cumsum(values)]).astype(np.float64)
    index = np.arange(len(values))
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    return np.asarray((total[high] - total[low]) / (high - low))


def break_row(force: Array, deleted: NDArray[np.int64], drop: float) -> int | None:
    """Return the first row of the first fracture, None if there is none: the break detection of testing machines.

    Elements have failed (`deleted` counts them), and the force has dropped by the share `drop` of the largest before;
    a drop of 1 detects no break. What follows is the released stem that swings against the blade.
    """
    largest = np.maximum.accumulate(force)
    broken = (deleted > 0) & (largest > 0.0) & (force <= (1.0 - drop) * largest) & (drop < 1.0)
    return int(np.argmax(broken)) if broken.any() else None


# The stroke was long enough if the force ends below this share of its peak.
_FALLEN = 0.9


def short_stroke(travel: Array, force: Array, broken: int | None) -> list[Note]:
    """Return a warning unless a filtered curve (mm, N) has passed its maximum: by a fracture, or the force fell."""
    peak = int(np.argmax(force[:broken]))
    if broken is not None or force[-1] < _FALLEN * force[peak]:
        return []
    return [stroke_too_short(float(force[peak]), float(travel[peak]), float(force[-1]), float(travel[-1]))]


class BreakWatch:
    """Detects the first fracture during a test: `break_row` of the outputs whose moving mean is final.

    `drop` is as in `break_row`; `window` is the number of outputs that the filter's moving mean takes.
    """

    def __init__(self, drop: float, window: int) -> None:
        self._drop, self._window = drop, window
        self._force, self._deleted = list[float](), list[int]()

    def is_past(self, force: float, deleted: int) -> bool:
        """Take note of the next force and number of eroded elements, and say whether the stem has fractured."""
        self._force.append(force)
        self._deleted.append(deleted)
        final = len(self._force) - self._window // 2
        if final < 1 or self._deleted[final - 1] == 0:
            return False
        filtered = moving_mean(np.array(self._force), self._window)[:final]
        return break_row(filtered, np.array(self._deleted[:final]), self._drop) is not None


# Ratios of energies mean nothing before the blade has done this share of its work.
_BEGINNING = 0.1


def evaluate(
    curve: ForceHistory,
    history: History,
    material: Material,
    broken: int | None,
    elements: int,
    wall: float,
    balanced: int | None = None,
) -> CuttingResult:
    """Return the peak of a force curve until the first fracture, at row `broken`, if any, and the measures of trust.

    The energy balance is judged before row `balanced`, or over the whole stroke. Raises `SimulationFailed` if the blade
    met no resistance.
    """
    peak = int(np.argmax(curve.force_filtered[:broken]))
    if curve.force_filtered[peak] <= 0.0:
        raise SimulationFailed(
            "no_contact", "the blade exerted no force on the stem; check the gap, the speed and the duration of loading"
        )
    short = short_stroke(curve.travel, curve.force_filtered, broken)
    added = 100.0 * history.added_mass
    checks: dict[str, Any] = {
        "energy_drift_percent": history.drift_percent(balanced),
        "kinetic_ratio_percent": _ratio_percent(curve.kinetic, curve, _before_fracture(curve)),
        "hourglass_ratio_percent": _ratio_percent(curve.hourglass, curve, peak),
        "inertia_percent": float(100.0 * abs(1.0 - curve.supports[peak] / curve.force_filtered[peak])),
    }
    return CuttingResult(
        peak_force=float(curve.force_filtered[peak]),
        peak_force_raw=float(curve.force[:broken].max()),
        peak_time=float(curve.time[peak]),
        peak_travel=float(curve.travel[peak]),
        elements=elements,
        deleted_elements=int(curve.deleted[peak]),
        steps=history.steps,
        wall_seconds=wall,
        element_steps_per_second=elements * history.steps / wall,
        **checks,
        contact_energy_percent=_least_contact_percent(curve, broken),
        stroke_was_enough=not short,
        warnings=(
            *short,
            *_of_energies(**checks, added_mass_percent=added),
            *_of_curve(curve, peak, broken, float(history.plastic_rate[: peak + 1].max()), material),
        ),
        history=curve,
        break_travel=None if broken is None else float(curve.travel[broken]),
        added_mass_percent=added,
    )


def _of_curve(curve: ForceHistory, peak: int, broken: int | None, rate: float, material: Material) -> list[Note]:
    """Return warnings: a strain rate (1/s) above C, where the law is no small correction; a force after a break."""
    found, c, before = list[Note](), material.strain_rate_c, float(curve.force_filtered[peak])
    if material.rate_law == "paper" and 0.0 < c < rate:
        found.append(rate_above_law(rate, c, 1.0 + (rate / c) ** material.strain_rate_p))
    if broken is not None and (largest := float(curve.force_filtered[broken:].max())) > before:
        found.append(force_after_break(float(curve.travel[broken]), largest, before))
    return found


def _before_fracture(curve: ForceHistory) -> int:
    """Return the last row before anything fails."""
    if curve.failed[-1] == 0:
        return len(curve.time) - 1
    return max(int(np.argmax(curve.failed > 0)) - 1, 1)


def _ratio_percent(part: Array, curve: ForceHistory, until: int) -> float:
    """Return the largest part/internal in percent up to row `until`, past the first tenth of the work done by then."""
    rows = np.arange(len(part))
    counted = (rows <= until) & (curve.external > _BEGINNING * max(curve.external[until], 1e-12))
    counted &= curve.internal > 0.0  # none is left where all elements are deleted
    return float(100.0 * np.max(part[counted] / curve.internal[counted], initial=0.0))


def _least_contact_percent(curve: ForceHistory, broken: int | None) -> float:
    """Return the smallest contact/work in percent until the break, past the first tenth of the work done by then."""
    work, contact = curve.external[:broken], curve.contact[:broken]
    counted = work > _BEGINNING * max(work.max(), 1e-12)
    return float(100.0 * np.min(contact[counted] / work[counted], initial=100.0))


def _of_energies(
    energy_drift_percent: float,
    kinetic_ratio_percent: float,
    hourglass_ratio_percent: float,
    inertia_percent: float,
    added_mass_percent: float,
) -> list[Note]:
    """Return the doubts that the energies leave."""
    found = []
    if energy_drift_percent > MOST_DRIFT:
        found.append(energy_drifts(energy_drift_percent))
    if inertia_percent > MOST_INERTIA and added_mass_percent > NEGLIGIBLE_MASS:
        found.append(inertia_in_force(inertia_percent, kinetic_ratio_percent))
    if hourglass_ratio_percent > MOST_HOURGLASS:
        found.append(hourglass_energy(hourglass_ratio_percent))
    return found
