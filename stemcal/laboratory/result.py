"""What a laboratory test gives: its curve over a travel without the give of the contact, and its responses."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.result import CuttingResult, ForceHistory
from stemcal.fem.model import Model
from stemcal.fem.state import State
from stemcal.laboratory.parts import LaboratoryTest

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


def secant(travel: Array, force: Array, shares: tuple[float, float] = SECANT) -> Line | None:
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
    curve: ForceHistory, result: CuttingResult, broken: int | None
) -> tuple[dict[str, float], float | None]:
    """Return the responses by name, and R² of the slope."""
    travel, force = curve.travel[:broken], curve.force_filtered[:broken]
    line = secant(travel, force)
    found = curve_responses(travel, force, line)
    found |= {"force": result.peak_force, "travel": result.peak_travel}
    return found, None if line is None else line.r2


def curve_responses(travel: Array, force: Array, line: Line | None) -> dict[str, float]:
    """Return the responses of a curve until the break, simulated or measured, without those that it lacks.

    Parameters
    ----------
    travel, force : (R,)
        mm and N.
    line : Line, optional
        Its secant.
    """
    peak = int(np.argmax(force))
    found = {} if line is None else {"slope": line.slope}
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
