"""The virtual shear test: a hollow stem on two supports, a wedge that comes down across it, the force it meets.

The stem lies along x, the blade's edge along y at mid-span, the blade moves down along −z.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil, pi, radians, tan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from stemcal.errors import SimulationFailed
from stemcal.fem.contact import Contact, Tool
from stemcal.fem.history import History
from stemcal.fem.material import Hourglass, Material
from stemcal.fem.mesh import Mesh, hollow_cylinder
from stemcal.fem.model import ElementKind, Integration, Model
from stemcal.fem.stepper import simulate

Array = NDArray[np.float64]

# Raised whenever a change makes the same test give another force, so that stored runs are not taken for new ones.
REVISION = 1

Symmetry = Literal["none", "half", "quarter"]

# The share of the real thing that each model holds: half is cut lengthwise (y ≥ 0), quarter also across (x ≥ 0).
SHARES: dict[str, float] = {"none": 1.0, "half": 0.5, "quarter": 0.25}
# How far the supports reach outwards and down, mm: past anything the stem can do.
_FAR = 200.0


@dataclass(frozen=True)
class Stem:
    """A hollow cylinder: outer diameter and length in mm, inner/outer diameter ratio."""

    outer_diameter: float = 8.0
    diameter_ratio: float = 0.41
    length: float = 50.0


@dataclass(frozen=True)
class Blade:
    """A wedge: body thickness and width (height) in mm, included edge angle in degrees, radius of its edge in mm.

    `bevel` both: the flanks lean equally to both sides. one: one flank is vertical.
    """

    thickness: float = 2.3
    width: float = 28.0
    edge_angle: float = 37.5
    edge_radius: float = 0.1
    bevel: Literal["both", "one"] = "both"

    def outline(self) -> tuple[tuple[float, float], ...]:
        """Return the polygon that, swollen by the edge radius, is the blade; its lowest line is z = 0."""
        r, t = self.edge_radius, self.thickness - 2.0 * self.edge_radius
        if self.bevel == "one":
            return ((0.0, r), (t, r + t / tan(radians(self.edge_angle))), (t, self.width), (0.0, self.width))
        shoulder = r + 0.5 * t / tan(radians(0.5 * self.edge_angle))
        return ((0.0, r), (0.5 * t, shoulder), (0.5 * t, self.width), (-0.5 * t, self.width), (-0.5 * t, shoulder))


@dataclass(frozen=True)
class Supports:
    """Two fixed blocks: clear distance between them and radius of their inner edges, mm."""

    clearance: float = 20.0
    fillet_radius: float = 1.0


@dataclass(frozen=True)
class Loading:
    """Blade speed (mm/s), duration (s) and the gap at the start between edge and stem (mm)."""

    speed: float = 100.0 / 60.0
    duration: float = 0.5
    gap: float = 0.001


@dataclass(frozen=True)
class Discretisation:
    """How the stem is meshed and integrated.

    Parameters
    ----------
    element_size : float
        Length of an element along and around the stem, mm.
    through_wall : int or None
        Elements through the wall; None takes as many as make them no longer than `element_size`.
    symmetry : str
        ``quarter`` and ``half`` mirror the rest of the stem.
    edge_over : str
        Mesh phase along the stem: the edge comes down over the middle of a row of ``elements`` or on a row of
        ``nodes``.
    turn, shift : float
        Fractions of an element by which the full model's mesh is turned about the axis and shifted along it.
    element : str
        ``one_point`` or ``full``, see `fem.model.Model`.
    hourglass, integration : Hourglass, Integration
        Of the solver.
    filter_window : float
        Width of the moving mean over the force, s.
    """

    element_size: float = 1.0
    through_wall: int | None = None
    symmetry: Symmetry = "quarter"
    edge_over: Literal["elements", "nodes"] = "elements"
    turn: float = 0.0
    shift: float = 0.0
    element: ElementKind = "one_point"
    hourglass: Hourglass = field(default_factory=Hourglass)
    integration: Integration = field(default_factory=lambda: Integration(mass_scaling=1.0e4, outputs=500))
    filter_window: float = 0.01


@dataclass(frozen=True)
class ShearTest:
    """Everything that determines one virtual shear test."""

    material: Material
    stem: Stem = field(default_factory=Stem)
    blade: Blade = field(default_factory=Blade)
    supports: Supports = field(default_factory=Supports)
    loading: Loading = field(default_factory=Loading)
    contact: Contact = field(default_factory=lambda: Contact(0.15, 0.10))
    discretisation: Discretisation = field(default_factory=Discretisation)


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


def shear(test: ShearTest, watch: Callable[[float, float], None] | None = None) -> CuttingResult:
    """Run a virtual shear test.

    Parameters
    ----------
    watch : callable, optional
        Called after every output with the travel (mm) and the force (N).

    Raises
    ------
    SimulationFailed
        If the solver's state stops being physical or the blade never meets the stem.
    """
    model = build(test)
    scale = 1.0 / SHARES[test.discretisation.symmetry]
    started = time.perf_counter()

    def report(t: float, forces: Array) -> None:
        if watch is not None:
            watch(_travel(test, t), scale * float(forces[0, 2]))

    history = simulate(model, test.loading.duration, report)
    wall = time.perf_counter() - started
    return _result(test, model, _force_history(test, history, scale), history, wall)


def build(test: ShearTest) -> Model:
    """Return the finite element model of a shear test."""
    how = test.discretisation
    mesh = stem_mesh(test.stem, how)
    return Model(
        mesh=mesh,
        material=test.material,
        tools=(_blade(test), *_supports(test)),
        contact=test.contact,
        element=how.element,
        hourglass=how.hourglass,
        integration=how.integration,
        held=_mirrors(mesh, how.symmetry),
        ghosts=_ghosts(mesh) if how.symmetry == "quarter" else None,
    )


def stem_mesh(stem: Stem, how: Discretisation) -> Mesh:
    """Return the mesh of the stem, or of the part of it that the symmetry leaves.

    Nodes lie on the mirror plane y = 0. Across, the quarter model keeps the row of elements that x = 0 cuts in two
    whole where the edge comes down over elements; its far nodes are ghosts.
    """
    outer, inner = 0.5 * stem.outer_diameter, 0.5 * stem.outer_diameter * stem.diameter_ratio
    around = max(4, 2 * round(pi * outer / how.element_size))
    through = how.through_wall or max(1, ceil((outer - inner) / how.element_size - 1e-9))
    layers = _layers(stem.length, how)
    if how.symmetry == "none":
        first = -0.5 * pi + how.turn * 2 * pi / around
        return hollow_cylinder(inner, outer, layers, (around, through), (first, first + 2 * pi))
    return hollow_cylinder(inner, outer, layers, (around // 2, through), (-0.5 * pi, 0.5 * pi))


def _layers(length: float, how: Discretisation) -> Array:
    """Return x of the layers of nodes: an odd number of elements if the edge is over elements, else an even one."""
    odd = 1 if how.edge_over == "elements" else 0
    pairs = max(1, ceil((length / how.element_size - odd) / 2 - 1e-9))
    count = 2 * pairs + odd
    step = length / count
    x = step * (np.arange(count + 1) - 0.5 * count + how.shift)
    return x[x > -0.75 * step] if how.symmetry == "quarter" else x


def _mirrors(mesh: Mesh, symmetry: Symmetry) -> NDArray[np.bool_]:
    """Return which velocity components the mirror planes hold: x on x = 0 (quarter), y on y = 0 (half, quarter)."""
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    if symmetry == "quarter":
        held[:, 0] = np.abs(mesh.nodes[:, 0]) < 1e-9
    if symmetry != "none":
        held[:, 1] = np.abs(mesh.nodes[:, 1]) < 1e-9
    return held


def _ghosts(mesh: Mesh) -> NDArray[np.int32]:
    """Return (ghost, source) for the nodes beyond x = 0: the layer that follows mirrors the first."""
    beyond = np.flatnonzero(mesh.nodes[:, 0] < -1e-9)
    return np.stack([beyond, beyond + len(beyond)], axis=1).astype(np.int32)


def _blade(test: ShearTest) -> Tool:
    top = 0.5 * test.stem.outer_diameter
    return Tool(
        corners=test.blade.outline(),
        radius=test.blade.edge_radius,
        height=top + test.loading.gap,
        speed=-test.loading.speed,
        edge=0.0,
    )


def _supports(test: ShearTest) -> tuple[Tool, ...]:
    """Return the block on the right, and unless a mirror makes it, the one on the left."""
    r = test.supports.fillet_radius
    near = 0.5 * test.supports.clearance + r
    height = -0.5 * test.stem.outer_diameter
    right = ((near, -r), (near, -_FAR), (_FAR, -_FAR), (_FAR, -r))
    left = tuple((-x, z) for x, z in reversed(right))
    blocks = (right,) if test.discretisation.symmetry == "quarter" else (right, left)
    return tuple(Tool(corners, r, height) for corners in blocks)


def _travel(test: ShearTest, t: float) -> float:
    return test.loading.speed * t - test.loading.gap


def _force_history(test: ShearTest, history: History, scale: float) -> ForceHistory:
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


# The stroke was long enough if the force ends below this share of its peak.
_FALLEN = 0.9
# Ratios of energies mean nothing before the blade has done this share of its work.
_BEGINNING = 0.1
# Shares above which a result is to be looked at before it is used, percent.
_MOST_KINETIC = 5.0
_MOST_HOURGLASS = 10.0
_MOST_DRIFT = 2.0


def _result(test: ShearTest, model: Model, curve: ForceHistory, history: History, wall: float) -> CuttingResult:
    peak = int(np.argmax(curve.force_filtered))
    if curve.force_filtered[peak] <= 0.0:
        raise SimulationFailed("no_contact", "the blade met no resistance: check gap, speed and duration")
    elements = len(model.mesh.hexes)
    fallen = bool(curve.force_filtered[-1] < _FALLEN * curve.force_filtered[peak])
    shares = {
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
        **shares,
        stroke_was_enough=fallen,
        warnings=_warnings(fallen, float(curve.travel[-1]), **shares),
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
