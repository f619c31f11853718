"""Evaluation of a solver's history: the force curve of a shear test, its peak, and the checks of the result."""

from dataclasses import dataclass, replace
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array
from stemcal.cutting import checks
from stemcal.cutting.end_state import Shape
from stemcal.cutting.parts import Discretisation, Loading
from stemcal.errors import SimulationFailed
from stemcal.fem.kernels.nodes import EDGE, FRICTION, SURFACE
from stemcal.fem.material import Material
from stemcal.fem.stepper import History
from stemcal.notes import Note


@dataclass(frozen=True)
class ForceHistory:
    """Curves of a test over time for the whole stem (sums of a quarter model are multiplied by four).

    Forces are in N, energies in mJ, time in s, the travel of the blade after first contact in mm. `force` is the force
    on the blade along its travel, `along_edge` its resistance to sliding along an oblique edge. `supports` is the
    filtered force on the supports, which differs from that on the blade by the stem's inertia. `contact` is the energy
    that contact stores or dissipates, the sum of the parts of the edge, the flanks, the supports and friction.
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
        """Number of deleted elements and of parted nodes of the cut plane."""
        return self.deleted + self.parted


@dataclass(frozen=True)
class CuttingResult:
    """Result of a virtual shear test; forces in N, travel in mm, time in s, shares in percent.

    A failure is the deletion of an element or the parting of a node. At a fracture, the force has also clearly dropped
    (`break_row`).

    peak_force, peak_force_raw   largest force until the first fracture: filtered, and not filtered
    peak_time, peak_travel       time and travel at the peak of the filtered force
    elements, deleted_elements   number of elements in the computed mesh, and of those deleted before the peak
    stroke_was_enough            whether the stem has fractured, or the force at the end of the stroke is clearly below
                                 its peak
    energy_drift_percent         largest error of the energy balance, relative to the largest work done
    kinetic_ratio_percent        largest ratio of kinetic to internal energy before the first failure (or in the stroke
                                 without one), after the first tenth of the work
    hourglass_ratio_percent      largest ratio of hourglass to internal energy up to the peak (in a whole cut, up to the
                                 end), after the first tenth
    inertia_percent              difference between the forces on the blade and on the supports at the peak, relative to
                                 the force on the blade: the contribution of inertia, from true and added mass
    added_mass_percent           mass added by mass scaling and time step, relative to the stem's mass
    contact_energy_percent       smallest share of the blade's work that contact, without friction, stores or dissipates
                                 until the first fracture, after the first tenth of the work; a negative share is a
                                 numerical error
    break_travel                 travel of the blade at the first fracture (`break_row`), None without one; the curve
                                 beyond depends on the mesh and the vibrating stem rather than on the material

    For a whole cut, `first_fracture_force` is the largest force until the first failure, `first_fracture_travel` the
    travel at that failure, `severed` whether the stem is in two parts, `severed_travel` the travel at which it is, and
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
    """Return the curves of the whole stem: sums of the solver times `scale`, and the force also filtered.

    The force is the force on the first tool. In a model without tools, it is the work done on the driven ends in an
    interval, divided by the travel in this interval.
    """
    tools = history.force.shape[1] > 0
    angle = radians(loading.sliding_angle)
    if tools:
        force = scale * history.force[:, 0, 2]
    else:
        travelled = loading.speed * np.diff(history.time)
        force = scale * np.concatenate([[0.0], np.diff(history.external) / travelled])
    along_edge = scale * history.force[:, 0, 1] if angle else np.zeros_like(force)
    force = along_travel(force, along_edge, loading.sliding_angle)
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


def along_travel(z: Array, y: Array, sliding_angle: float) -> Array:
    """Return the force on the blade against its travel (0, sin θ, −cos θ): F_z cos θ − F_y sin θ; θ in degrees."""
    return z * cos(radians(sliding_angle)) - y * sin(radians(sliding_angle))


def filter_rows(loading: Loading, how: Discretisation) -> int:
    """Return the number of outputs in the moving mean of the force."""
    return max(1, round(how.filter_window * how.integration.outputs / loading.duration))


def moving_mean(values: Array, window: int) -> Array:
    """Return the centred mean over `window` values (an even window is one wider); fewer values near the ends."""
    half = window // 2
    total = np.concatenate([[0.0], np.cumsum(values)]).astype(np.float64)
    index = np.arange(len(values))
    low, high = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    return np.asarray((total[high] - total[low]) / (high - low))


def break_row(force: Array, deleted: NDArray[np.int64], drop: float) -> int | None:
    """Return the row of the first fracture by the break detection of testing machines; None without a fracture.

    At a fracture elements have failed (`deleted` is their number), and the force has dropped by the share `drop` of its
    largest value so far; a drop of 1 detects no break. Afterwards the released stem vibrates against the blade.
    """
    largest = np.maximum.accumulate(force)
    broken = (deleted > 0) & (largest > 0.0) & (force <= (1.0 - drop) * largest) & (drop < 1.0)
    return int(np.argmax(broken)) if broken.any() else None


# Without a fracture, the stroke was long enough if the final force is below this share of the peak.
_FALLEN = 0.9


def short_stroke(travel: Array, force: Array, broken: int | None) -> list[Note]:
    """Return a warning if a filtered curve (mm, N) has neither a fracture nor a clear decrease after its maximum."""
    peak = int(np.argmax(force[:broken]))
    if broken is not None or force[-1] < _FALLEN * force[peak]:
        return []
    return [checks.stroke_too_short(float(force[peak]), float(travel[peak]), float(force[-1]), float(travel[-1]))]


class BreakWatch:
    """Detects the first fracture during a test: `break_row` of the outputs whose moving mean cannot change any more.

    `drop` is as in `break_row`; `window` is the number of outputs in the moving mean.
    """

    def __init__(self, drop: float, window: int) -> None:
        self._drop, self._window = drop, window
        self._force, self._deleted = list[float](), list[int]()

    def is_past(self, force: float, deleted: int) -> bool:
        """Add the next force and number of eroded elements; return True if the stem has fractured."""
        self._force.append(force)
        self._deleted.append(deleted)
        final = len(self._force) - self._window // 2
        if final < 1 or self._deleted[final - 1] == 0:
            return False
        filtered = moving_mean(np.array(self._force), self._window)[:final]
        return break_row(filtered, np.array(self._deleted[:final]), self._drop) is not None


# Ratios of energies are evaluated after the blade has done this share of its work: before, both energies are near zero.
_BEGINNING = 0.1


def evaluate(
    curve: ForceHistory,
    history: History,
    material: Material,
    broken: int | None,
    elements: int,
    wall: float,
    balanced: int | None = None,
    parts: bool = False,
) -> CuttingResult:
    """Return the peak of a force curve before the first fracture (row `broken`, None without one), and the checks.

    The energy balance is checked before row `balanced`, or over the whole stroke; the hourglass energy up to the peak,
    or over the whole stroke if the stem `parts`. Raises `SimulationFailed` if the blade exerted no force.
    """
    peak = int(np.argmax(curve.force_filtered[:broken]))
    if curve.force_filtered[peak] <= 0.0:
        raise SimulationFailed(
            "no_contact", "the blade exerted no force on the stem; check the gap, the speed and the duration of loading"
        )
    short = short_stroke(curve.travel, curve.force_filtered, broken)
    # the last row before the first failure, or the last row of the stroke
    whole = max(int(np.argmax(curve.failed > 0)) - 1, 1) if curve.failed[-1] > 0 else len(curve.time) - 1
    result = CuttingResult(
        peak_force=float(curve.force_filtered[peak]),
        peak_force_raw=float(curve.force[:broken].max()),
        peak_time=float(curve.time[peak]),
        peak_travel=float(curve.travel[peak]),
        elements=elements,
        deleted_elements=int(curve.deleted[peak]),
        steps=history.steps,
        wall_seconds=wall,
        element_steps_per_second=elements * history.steps / wall,
        energy_drift_percent=history.drift_percent(balanced),
        kinetic_ratio_percent=_ratio_percent(curve.kinetic, curve, whole),
        hourglass_ratio_percent=_ratio_percent(curve.hourglass, curve, len(curve.time) - 1 if parts else peak),
        contact_energy_percent=_least_contact_percent(curve, broken),
        inertia_percent=float(100.0 * abs(1.0 - curve.supports[peak] / curve.force_filtered[peak])),
        stroke_was_enough=not short,
        warnings=(),
        history=curve,
        break_travel=None if broken is None else float(curve.travel[broken]),
        added_mass_percent=100.0 * history.added_mass,
    )
    rate = float(history.plastic_rate[: peak + 1].max())
    notes = (*short, *_of_energies(result), *_of_curve(curve, peak, broken, rate, material))
    return replace(result, warnings=notes)


def _of_curve(curve: ForceHistory, peak: int, broken: int | None, rate: float, material: Material) -> list[Note]:
    """Return warnings: strain `rate` (1/s) above C of the rate law; force after the break (`broken`) above the peak."""
    notes, c, before = list[Note](), material.strain_rate_c, float(curve.force_filtered[peak])
    if material.rate_law == "paper" and 0.0 < c < rate:
        notes.append(checks.rate_above_law(rate, c, 1.0 + (rate / c) ** material.strain_rate_p))
    if broken is not None and (largest := float(curve.force_filtered[broken:].max())) > before:
        notes.append(checks.force_after_break(float(curve.travel[broken]), largest, before))
    return notes


def _ratio_percent(part: Array, curve: ForceHistory, until: int) -> float:
    """Return the largest ratio of an energy (`part`) to the internal energy, in percent, up to the row `until`.

    The first rows, up to a tenth of the work at `until`, do not count, because the internal energy is small there.
    """
    rows = np.arange(len(part))
    counted = (rows <= until) & (curve.external > _BEGINNING * max(curve.external[until], 1e-12))
    counted &= curve.internal > 0.0  # the internal energy is zero once all elements are deleted
    return float(100.0 * np.max(part[counted] / curve.internal[counted], initial=0.0))


def _least_contact_percent(curve: ForceHistory, broken: int | None) -> float:
    work, contact = curve.external[:broken], (curve.contact - curve.contact_friction)[:broken]
    counted = work > _BEGINNING * max(work.max(), 1e-12)
    return float(100.0 * np.min(contact[counted] / work[counted], initial=100.0))


def _of_energies(result: CuttingResult) -> list[Note]:
    notes = []
    if result.energy_drift_percent > checks.MOST_DRIFT:
        notes.append(checks.energy_drifts(result.energy_drift_percent))
    if result.inertia_percent > checks.MOST_INERTIA and result.added_mass_percent > checks.NEGLIGIBLE_MASS:
        notes.append(checks.inertia_in_force(result.inertia_percent, result.kinetic_ratio_percent))
    if result.hourglass_ratio_percent > checks.MOST_HOURGLASS:
        notes.append(checks.hourglass_energy(result.hourglass_ratio_percent))
    return notes
