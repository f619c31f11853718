"""The designs by name, in coded units; each is built in a module of its own.

A new design is one function and one line in `SCREENING` or `SURFACES`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from stemcal.doe.designs.box_behnken import box_behnken
from stemcal.doe.designs.composite import Core, axes, axial_distance, blocked_composite, central_composite
from stemcal.doe.designs.d_optimal import d_optimal_runs, rows_missing
from stemcal.doe.designs.definitive_screening import definitive_screening
from stemcal.doe.designs.factorial import fraction, full_factorial
from stemcal.doe.designs.i_optimal import HalfSpace, i_optimal, inside
from stemcal.doe.designs.plackett_burman import cyclic_design, pydoe_design
from stemcal.doe.designs.space_filling import latin_hypercube, sobol
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError

SCREENING_DESIGNS = ("plackett-burman", "plackett-burman-pydoe")
_MOST_FOR_FIVE_LEVELS = 5
_RUNS_PER_TERM = 2  # how many runs a space-filling design takes if it is not told


def _full(k: int, runs: int | None) -> Array:
    design = full_factorial(k)
    if runs not in (None, len(design)):
        raise UsageError(
            f"screen.runs: full-factorial has {len(design)} runs for {k} factors, not {runs}; leave it out"
        )
    return design


SCREENING: dict[str, Callable[[int, int | None], Array]] = {
    "plackett-burman": cyclic_design,
    "plackett-burman-pydoe": pydoe_design,
    "fractional-factorial": lambda k, runs: fraction(k, runs).design(),
    "full-factorial": _full,
    "definitive-screening": definitive_screening,
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


def fold_over(coded: Array, columns: Sequence[int] | None = None) -> Array:
    """Append every run with its signs turned, in all columns or in some.

    All columns: main effects become clear of two-factor interactions (resolution III turns into IV). One
    column: that factor and its interactions become clear. Source: G. E. P. Box and K. B. Wilson (1951).
    """
    mirrored = np.array(coded, dtype=float)
    turned = list(range(coded.shape[1])) if columns is None else list(columns)
    mirrored[:, turned] *= -1.0
    return np.vstack([coded, mirrored + 0.0])


@dataclass(frozen=True)
class SurfaceOptions:
    """What may be chosen about a design for a response surface; each design takes what concerns it.

    `runs` and `seed` are for space-filling designs. `blocks` splits a composite into corners and axial points,
    each with its share of the centre points and with the α that keeps them orthogonal. Runs are added to any design:
    `extra_runs` D-optimal ones, in batches each of which knows those before, and axial points at the distance `axial`.
    `within` cuts the region of an I-optimal design.
    """

    design: str = "central-composite"
    centre_points: int = 6
    alpha: str | float = "rotatable"
    core: Core = "full"
    runs: int | None = None
    seed: int = 0
    extra_runs: int | tuple[int, ...] = 0
    blocks: bool = False
    axial: float | None = None
    within: tuple[HalfSpace, ...] = ()

    @property
    def batches(self) -> tuple[int, ...]:
        """Sizes of the batches of extra runs."""
        return (self.extra_runs,) if isinstance(self.extra_runs, int) else self.extra_runs

    def size(self, k: int) -> int:
        """Return the number of runs of a design whose size is free: as given, or twice the terms of a quadratic."""
        return self.runs if self.runs is not None else _RUNS_PER_TERM * ((k + 1) * (k + 2) // 2)


def _composite(k: int, options: SurfaceOptions) -> Array:
    if options.blocks:
        return _blocked(k, options)[0]
    return central_composite(k, options.centre_points, options.alpha, options.core)


def _blocked(k: int, options: SurfaceOptions) -> tuple[Array, list[str]]:
    """Return a composite in two blocks; the corners get the odd centre point."""
    corners, axial = (options.centre_points + 1) // 2, options.centre_points // 2
    design, number = blocked_composite(k, corners, axial, options.core)
    return design, [str(block) for block in number]


SURFACES: dict[str, Callable[[int, SurfaceOptions], Array]] = {
    "central-composite": lambda k, o: _composite(k, o),
    "box-behnken": lambda k, o: box_behnken(k, o.centre_points),
    "full-factorial": lambda k, _o: full_factorial(k, 3),
    "latin-hypercube": lambda k, o: latin_hypercube(k, o.size(k), o.seed),
    "sobol": lambda k, o: sobol(k, o.size(k), o.seed),
    "i-optimal": lambda k, o: i_optimal(k, o.size(k), o.within),
}


def surface_runs(k: int, options: SurfaceOptions) -> Array:
    """Build a design for the response surface of k factors."""
    if options.design not in SURFACES:
        raise UsageError(f"rsm.design: no design {options.design!r}; choose one of {', '.join(SURFACES)}")
    if k < 1:
        raise UsageError(f"rsm.factors: {k} factors; give at least one")
    design = SURFACES[options.design](k, options)
    for count in options.batches:
        if count:
            design = np.vstack([design, d_optimal_runs(design, count, _candidates(k, options))])
    if options.axial is None:
        return design
    if not 0.0 < options.axial <= surface_reach(k, options) + 1e-9:
        reach = surface_reach(k, options)
        raise UsageError(f"rsm.axial: {options.axial:g} must be above 0 and not beyond the design's reach, {reach:.4g}")
    return np.vstack([design, rows_missing(design, options.axial * axes(k))])


def surface_blocks(k: int, options: SurfaceOptions) -> list[str] | None:
    """Return the block of each run of `surface_runs`, None without blocks; added runs count to the last block."""
    if not options.blocks:
        return None
    if options.design != "central-composite":
        raise UsageError(f"rsm.blocks: {options.design} has no orthogonal blocks; write design: central-composite")
    labels = _blocked(k, options)[1]
    return labels + [labels[-1]] * (len(surface_runs(k, options)) - len(labels))


def _candidates(k: int, options: SurfaceOptions) -> Array:
    """Return the grid of 0, ±1 and, for few factors, ±α, as far as the surface may be trusted."""
    reach, radius = surface_reach(k, options), surface_radius(k, options)
    levels = sorted({-1.0, 0.0, 1.0} | ({-reach, reach} if k <= _MOST_FOR_FIVE_LEVELS else set()))
    points = np.array(list(product(levels, repeat=k)))
    return inside(points[np.linalg.norm(points, axis=1) <= max(radius, k**0.5) + 1e-9], options.within)


def surface_reach(k: int, options: SurfaceOptions) -> float:
    """Return the coded distance at which a factor's low and high lie: max(α, 1) of a composite, else 1."""
    if options.design != "central-composite":
        return 1.0
    return max(1.0, _alpha(k, options))


def _alpha(k: int, options: SurfaceOptions) -> float:
    if options.blocks:
        return float(np.abs(_blocked(k, options)[0]).max())
    return axial_distance(k, options.alpha, options.centre_points, options.core)


def surface_radius(k: int, options: SurfaceOptions) -> float:
    """Return how far from the centre the surface may be trusted, in coded units.

    α of a rotatable composite, where the runs of a Box–Behnken design lie, and otherwise the larger of α and
    √k, the distance of the corners: there the box alone bounds the region.
    """
    if options.design == "box-behnken":
        return float(np.linalg.norm(box_behnken(k, 0), axis=1).max())
    if options.design == "central-composite":
        alpha = _alpha(k, options)
        return alpha if options.alpha == "rotatable" and not options.blocks else max(alpha, k**0.5)
    return float(k**0.5)
