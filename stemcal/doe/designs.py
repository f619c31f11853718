"""The designs by name, in coded units; each is built in a module of its own.

A new design is one function and one line in `SCREENING` or `SURFACES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from stemcal.doe.augment import d_optimal_runs, fold_over
from stemcal.doe.box_behnken import box_behnken
from stemcal.doe.composite import Core, axial_distance, central_composite
from stemcal.doe.definitive import definitive_screening
from stemcal.doe.factorial import fraction, full_factorial
from stemcal.doe.plackett_burman import cyclic_design, pydoe_design
from stemcal.doe.regression import Array
from stemcal.doe.space_filling import latin_hypercube, sobol
from stemcal.errors import UsageError

__all__ = [
    "SCREENING",
    "SCREENING_DESIGNS",
    "SURFACES",
    "SurfaceOptions",
    "axial_distance",
    "central_composite",
    "plackett_burman",
    "screening_runs",
    "surface_radius",
    "surface_reach",
    "surface_runs",
]

SCREENING_DESIGNS = ("plackett-burman", "plackett-burman-pydoe")
_MOST_FOR_FIVE_LEVELS = 5
_RUNS_PER_TERM = 2  # how many runs a space-filling design takes if it is not told


def _full(k: int, runs: int | None) -> Array:
    design = full_factorial(k)
    return _of_fixed_size("full-factorial", design, runs)


def _definitive(k: int, runs: int | None) -> Array:
    return _of_fixed_size("definitive-screening", definitive_screening(k), runs)


def _of_fixed_size(name: str, design: Array, runs: int | None) -> Array:
    if runs not in (None, len(design)):
        raise UsageError(
            f"screen.runs: {name} has {len(design)} runs for {design.shape[1]} factors, not {runs}; leave it out"
        )
    return design


SCREENING: dict[str, Callable[[int, int | None], Array]] = {
    "plackett-burman": cyclic_design,
    "plackett-burman-pydoe": pydoe_design,
    "fractional-factorial": lambda k, runs: fraction(k, runs).design(),
    "full-factorial": _full,
    "definitive-screening": _definitive,
}


def screening_runs(name: str, k: int, runs: int | None = None, folded: bool = False) -> Array:
    """Build a screening design for k factors, folded over if asked; `runs` overrides its usual size."""
    if name not in SCREENING:
        raise UsageError(f"screen.design: no design {name!r}; choose one of {', '.join(SCREENING)}")
    if k < 1:
        raise UsageError(f"screen.design: {k} factors; give at least one")
    design = SCREENING[name](k, runs)
    return fold_over(design) if folded else design


def plackett_burman(k: int, kind: str = "plackett-burman", runs: int | None = None) -> Array:
    """Build a two-level screening design for k factors.

    Parameters
    ----------
    k : int
        Number of factors.
    kind : str
        ``plackett-burman`` (ends in a row of all −1) or ``plackett-burman-pydoe`` (pyDOE3).
    runs : int, optional
        A multiple of 4 above k; by default the smallest sound one.

    Returns
    -------
    array (n, k)
        Levels ±1; columns are balanced and mutually orthogonal.
    """
    if kind not in SCREENING_DESIGNS:
        raise UsageError(f"screen.design: no design {kind!r}; choose one of {', '.join(SCREENING_DESIGNS)}")
    return screening_runs(kind, k, runs)


@dataclass(frozen=True)
class SurfaceOptions:
    """What may be chosen about a design for a response surface; each design takes what concerns it.

    `runs` and `seed` are for space-filling designs, `extra_runs` D-optimal runs are added to any design.
    """

    design: str = "central-composite"
    centre_points: int = 6
    alpha: str | float = "rotatable"
    core: Core = "full"
    runs: int | None = None
    seed: int = 0
    extra_runs: int = 0

    def size(self, k: int) -> int:
        """Return the number of space-filling runs: as given, or twice the terms of a quadratic."""
        return self.runs if self.runs is not None else _RUNS_PER_TERM * ((k + 1) * (k + 2) // 2)


SURFACES: dict[str, Callable[[int, SurfaceOptions], Array]] = {
    "central-composite": lambda k, o: central_composite(k, o.centre_points, o.alpha, o.core),
    "box-behnken": lambda k, o: box_behnken(k, o.centre_points),
    "full-factorial": lambda k, _o: full_factorial(k, 3),
    "latin-hypercube": lambda k, o: latin_hypercube(k, o.size(k), o.seed),
    "sobol": lambda k, o: sobol(k, o.size(k), o.seed),
}


def surface_runs(k: int, options: SurfaceOptions) -> Array:
    """Build a design for the response surface of k factors."""
    if options.design not in SURFACES:
        raise UsageError(f"rsm.design: no design {options.design!r}; choose one of {', '.join(SURFACES)}")
    if k < 1:
        raise UsageError(f"rsm.factors: {k} factors; give at least one")
    design = SURFACES[options.design](k, options)
    if not options.extra_runs:
        return design
    return np.vstack([design, d_optimal_runs(design, options.extra_runs, _candidates(k, options))])


def _candidates(k: int, options: SurfaceOptions) -> Array:
    """Return the grid of 0, ±1 and, for few factors, ±α, as far as the surface may be trusted."""
    reach, radius = surface_reach(k, options), surface_radius(k, options)
    levels = sorted({-1.0, 0.0, 1.0} | ({-reach, reach} if k <= _MOST_FOR_FIVE_LEVELS else set()))
    points = np.array(list(product(levels, repeat=k)))
    return np.asarray(points[np.linalg.norm(points, axis=1) <= max(radius, k**0.5) + 1e-9])


def surface_reach(k: int, options: SurfaceOptions) -> float:
    """Return the coded distance at which a factor's low and high lie: max(α, 1) of a composite, else 1."""
    if options.design != "central-composite":
        return 1.0
    return max(1.0, axial_distance(k, options.alpha, options.centre_points, options.core))


def surface_radius(k: int, options: SurfaceOptions) -> float:
    """Return how far from the centre the surface may be trusted, in coded units.

    α of a rotatable composite, where the runs of a Box–Behnken design lie, and otherwise the larger of α and
    √k, the distance of the corners: there the box alone bounds the region.
    """
    if options.design == "box-behnken":
        return float(np.linalg.norm(box_behnken(k, 0), axis=1).max())
    if options.design == "central-composite":
        alpha = axial_distance(k, options.alpha, options.centre_points, options.core)
        return alpha if options.alpha == "rotatable" else max(alpha, k**0.5)
    return float(k**0.5)
