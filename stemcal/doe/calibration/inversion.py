"""Where does the surface take the target value, and how well does that fix the factors?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from stemcal.doe.calibration.levelset import extremes, level_points
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.calibration.solution_rules import RULES
from stemcal.doe.calibration.solution_set import SolutionSet
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.regression.surface import Surface
from stemcal.errors import TargetUnreachable, UsageError
from stemcal.notes import Note, Weight

Interval = tuple[float, float]


class FreeFactors(Note, weight=Weight.USE):
    """Factors that the target leaves free over the whole region."""

    factors: tuple[str, ...]


class SecondSolution(Note, weight=Weight.ASIDE):
    """Another solution lies equally far from the centre, at lower levels."""


@dataclass(frozen=True)
class Assessment:
    """What the surface says about one point, in coded units."""

    coded: tuple[float, ...]
    coded_radius: float
    predicted: float
    mean_interval: Interval | None
    prediction_interval: Interval | None
    inside: bool


@dataclass(frozen=True)
class Calibration:
    """The solution a rule selects, and the whole set it was selected from.

    `ranges` are the least and greatest coded value of each factor over {x in the region : ŷ(x) = target}.
    """

    target: float
    point: Assessment
    ranges: tuple[Interval, ...]
    reachable: Interval
    rule: str
    radius: float | None
    notes: tuple[Note, ...]


def solve_target(
    surface: Surface,
    target: float,
    low: ArrayLike,
    high: ArrayLike,
    radius: float | None = None,
    rule: str = "least_coded_distance",
    unit: str = " N",
) -> Calibration:
    """Select one point of {x : ŷ(x) = target} and describe the whole set.

    Parameters
    ----------
    low, high : array (k,)
        Coded ends of the factor ranges.
    radius : float, optional
        Radius of the design sphere; beyond it the surface extrapolates.
    rule : str
        One of `RULES`.
    unit : str
        Of the target, as it stands behind a number.

    Raises
    ------
    TargetUnreachable
        If ŷ misses the target everywhere in the region.
    """
    if rule not in RULES:
        raise UsageError(f"invert.rule: no rule {rule!r}; choose one of {', '.join(RULES)}")
    region = Region(np.asarray(low, dtype=float), np.asarray(high, dtype=float), radius)
    ends = extremes(surface, region)
    bottom, top = (float(surface.predict(end)[0]) for end in ends)
    slack = 1e-9 * abs(target)
    if not bottom - slack <= target <= top + slack:
        raise TargetUnreachable(target, bottom, top, unit)
    found = SolutionSet(surface, target, region, level_points(surface, target, region, ends))
    solutions = RULES[rule](found)
    point = assess_point(surface, solutions[0], low, high, radius)
    ranges = found.coded_ranges()
    return Calibration(
        target=float(target),
        point=point,
        ranges=ranges,
        reachable=(bottom, top),
        rule=rule,
        radius=radius,
        notes=(*_free_factors(found, ranges), *_second_solution(solutions)),
    )


def assess_point(
    surface: Surface,
    coded: ArrayLike,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
    radius: float | None = None,
) -> Assessment:
    """Predict at one coded point, for instance a published solution.

    `inside` is False outside the box or the sphere; without a radius, beyond the outermost run of the design.
    """
    x = np.asarray(coded, dtype=float)
    distance = float(np.linalg.norm(x))
    reach = float(np.linalg.norm(surface.design, axis=1).max()) if radius is None else radius
    inside = distance <= reach + 1e-6
    if low is not None and high is not None:
        inside = inside and bool(np.all((x >= np.asarray(low) - 1e-6) & (x <= np.asarray(high) + 1e-6)))
    return Assessment(
        coded=tuple(map(float, x)),
        coded_radius=distance,
        predicted=float(surface.predict(x)[0]),
        mean_interval=_interval(surface.mean_interval(x)[0]),
        prediction_interval=_interval(surface.prediction_interval(x)[0]),
        inside=inside,
    )


def _interval(ends: Array) -> Interval | None:
    return (float(ends[0]), float(ends[1])) if np.all(np.isfinite(ends)) else None


def _free_factors(solutions: SolutionSet, ranges: Sequence[Interval]) -> list[Note]:
    ends = zip(solutions.surface.names, ranges, *solutions.region.bounds(), strict=True)
    free = tuple(name for name, (lo, hi), low, high in ends if lo <= low + 1e-6 and hi >= high - 1e-6)
    return [FreeFactors(free)] if free else []


def _second_solution(solutions: Sequence[Array]) -> list[Note]:
    if len(solutions) < 2 or not np.isclose(np.linalg.norm(solutions[0]), np.linalg.norm(solutions[1]), rtol=1e-5):
        return []
    return [SecondSolution()]
