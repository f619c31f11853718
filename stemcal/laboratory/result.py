"""What a laboratory test gives: its curve over a travel without the give of the contact, and its responses."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.result import CuttingResult, ForceHistory
from stemcal.fem.model import Model
from stemcal.fem.state import State
from stemcal.laboratory.axial import Axial
from stemcal.laboratory.parts import LaboratoryTest

Array = NDArray[np.float64]

# Rows that a slope needs at least.
_FEWEST = 3
# A piece that has widened by less than this share has not widened.
_WIDENED = 1e-6


@dataclass(frozen=True)
class LaboratoryResult(CuttingResult):
    """What a virtual laboratory test gives, beside what every run tells.

    Attributes
    ----------
    responses : dict
        By name; those that the curve does not have are left out.

        slope : N/mm, of the straight line fitted to the force over the travel between two shares of the largest force
        axis_slope : N/mm, the same over the deflection of the axis: without the dents under nose and supports (bending)
        maximum_force : N, until the break
        travel : mm, at the maximum
        work : mJ, until the break or the end of the stroke
        force_at_deflection : N, at the travel that is asked for
    slope_r2 : float
        R² of that line.
    """

    responses: dict[str, float] = field(default_factory=dict)
    slope_r2: float | None = None


@dataclass(frozen=True)
class Line:
    """A straight line fitted to a part of a curve: its slope, and R²."""

    slope: float
    r2: float


def secant(travel: Array, force: Array, shares: tuple[float, float]) -> Line | None:
    """Fit a line by least squares to a curve on its way up from one share of its largest force to another.

    Parameters
    ----------
    travel, force : (R,)
        Until the break.
    shares : (low, high)
        Of the largest force.

    Returns
    -------
    Line or None
        None if fewer than three rows lie between.

    Examples
    --------
    >>> import numpy as np
    >>> round(secant(np.arange(5.0), 2.0 * np.arange(5.0), (0.1, 0.9)).slope, 9)
    2.0
    """
    low, high = (int(np.argmax(force >= share * force.max())) for share in shares)
    u, f = travel[low : high + 1], force[low : high + 1]
    if len(u) < _FEWEST or np.ptp(u) == 0.0 or np.ptp(f) == 0.0:
        return None
    slope = float(np.polyfit(u - u[0], f, 1)[0])
    return Line(slope, float(np.corrcoef(u, f)[0, 1] ** 2))


def responses_of(
    test: LaboratoryTest, curve: ForceHistory, deflection: Array | None, result: CuttingResult, broken: int | None
) -> tuple[dict[str, float], float | None]:
    """Return the responses by name, and R² of the slope."""
    travel, force = curve.travel[:broken], curve.force_filtered[:broken]
    line = secant(travel, force, test.secant)
    along = None if deflection is None else secant(deflection[:broken], force, test.secant)
    found = curve_responses(travel, force, line, test.deflection)
    found |= {"maximum_force": result.peak_force, "travel": result.peak_travel}
    found |= {} if along is None else {"axis_slope": along.slope}
    return found, None if line is None else line.r2


def curve_responses(
    travel: Array, force: Array, line: Line | None, deflection: float | None = None
) -> dict[str, float]:
    """Return what a curve until the break tells by itself, simulated or measured; what it does not have is left out.

    Parameters
    ----------
    travel, force : (R,)
        mm and N.
    line : Line, optional
        Its secant.
    deflection : float, optional
        Where the force is asked for, mm.
    """
    peak = int(np.argmax(force))
    found = {} if line is None else {"slope": line.slope}
    found |= {"maximum_force": float(force[peak]), "travel": float(travel[peak])}
    found["work"] = float(np.trapezoid(force, travel))
    if deflection is not None and travel[-1] >= deflection:
        found["force_at_deflection"] = float(np.interp(deflection, travel, force))
    return found


class Gauges:
    """Called at the outputs of a simulation, reads how far contact gives, the axis bends, a pressed piece buckles.

    Contact is by springs (`kernels.contact`) whose give belongs to the mesh, not to the stem: for a tool it is the
    mean depth of the skin in it, weighted by the forces.
    """

    def __init__(self, test: LaboratoryTest, model: Model) -> None:
        mesh = model.mesh
        layers = test.kind.deflection_layers(test.stem)
        self._sections = None if layers is None else tuple(_section(mesh.nodes, mesh.hexes, at) for at in layers)
        self._start = mesh.nodes
        self._widening = test.kind == Axial("compression", "lubricated")  # evenly, unless it buckles
        self.give: list[float] = []
        self.deflection: list[float] = []
        self.buckling: list[float] = []

    def __call__(self, _time: float, state: State) -> None:
        """Take a reading."""
        weighted, force = state.tools.sunk.T
        depths = np.divide(weighted, force, out=np.zeros_like(force), where=force > 0.0).tolist()
        # on one side of a mirror, or on both: the supports give alike
        self.give.append(depths[0] + float(np.mean(depths[1:])) if depths else 0.0)
        if self._sections is not None:
            middle, support = (float(share @ state.body.x[nodes, 2]) for nodes, share in self._sections)
            self.deflection.append(support - middle)
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


def _section(nodes: Array, hexes: NDArray[np.int32], at: float) -> tuple[NDArray[np.int64], Array]:
    """Return the nodes of the layer nearest to x = `at`, and the share of its area that belongs to each."""
    near = nodes[np.argmin(np.abs(nodes[:, 0] - at)), 0]
    layer = np.abs(nodes[:, 0] - near) < 1e-9
    faces = hexes[:, [0, 1, 2, 3]]
    faces = faces[layer[faces].all(axis=1)]
    if not len(faces):  # the last layer has elements on its other side only
        faces = hexes[:, [4, 5, 6, 7]]
        faces = faces[layer[faces].all(axis=1)]
    corners = nodes[faces]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
    share = np.bincount(faces.ravel(), np.repeat(areas, 4), minlength=len(nodes))
    found = np.flatnonzero(layer)
    return found, share[found] / share.sum()
