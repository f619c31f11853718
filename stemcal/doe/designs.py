"""Screening designs and designs for response surfaces by name, in coded units.

A new screening design is one function and one line in `_SCREENING`. A new design for response surfaces is one class and
one line in `SURFACES`, or an entry point of the group ``stemcal.designs`` in another package.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product
from typing import Any, ClassVar

import numpy as np

from stemcal.arrays import Array
from stemcal.doe.coding import term_columns
from stemcal.doe.factorial import fraction, full_factorial, plackett_burman
from stemcal.errors import UsageError
from stemcal.registry import Checked, ForeignError, Registry, contained

_MOST_FOR_FIVE_LEVELS = 5  # number of factors up to which the candidates for extra runs include the axial levels ±α
_RUNS_PER_TERM = 2  # default number of runs of a Latin hypercube, per term of the quadratic model

_SCREENING: dict[str, Callable[[int, int | None], Array]] = {
    "plackett-burman": plackett_burman,
    "fractional-factorial": lambda k, runs: fraction(k, runs).design(),
}


def screening_runs(name: str, k: int, runs: int | None = None, folded: bool = False) -> Array:
    """Return a screening design for k factors, `folded` over or not; `runs` replaces its usual number of runs."""
    if name not in _SCREENING:
        raise UsageError(f"screen.design: unknown design {name!r}; choose one of {', '.join(_SCREENING)}")
    design = _SCREENING[name](k, runs)
    return fold_over(design) if folded else design


def fold_over(coded: Array) -> Array:
    """Fold a design over: append every run with all signs reversed, so that resolution III becomes IV.

    Source: G. E. P. Box and K. B. Wilson, J. R. Stat. Soc. B 13 (1951) 1–45.
    """
    return np.vstack([coded, 0.0 - coded])


# Blocks of a Box–Behnken design: the factors (from 1) that vary together while all others are at the centre.
_BLOCKS: dict[int, tuple[tuple[int, ...], ...]] = {
    **{k: tuple(combinations(range(1, k + 1), 2)) for k in (3, 4, 5)},
    6: ((1, 2, 4), (2, 3, 5), (3, 4, 6), (1, 4, 5), (2, 5, 6), (1, 3, 6)),
    7: ((4, 5, 6), (1, 6, 7), (2, 5, 7), (1, 2, 4), (3, 4, 7), (1, 3, 5), (2, 3, 6)),
}


def axial_distance(k: int, alpha: str | float = "rotatable") -> float:
    """Return the coded distance α of the axial points from the centre, by a rule or as a number.

    With ``rotatable``, α⁴ = number of factorial runs: the variance of the prediction then depends only on the distance
    from the centre (G. E. P. Box and J. S. Hunter, Ann. Math. Stat. 28 (1957), 195–241). With ``face``, α = 1.
    """
    if alpha == "rotatable":
        return float(len(_corners(k)) ** 0.25)
    if alpha == "face":
        return 1.0
    if isinstance(alpha, str):
        raise UsageError(
            f"rsm.alpha: {alpha!r} is neither a known rule nor a positive number; write `rotatable`, `face` or a number"
        )
    if not (np.isfinite(alpha) and alpha > 0.0):
        raise UsageError(f"rsm.alpha: {alpha:g} is not positive; write 1 for axial points on the faces of the cube")
    return float(alpha)


def central_composite(k: int, centre_points: int = 6, alpha: str | float = "rotatable") -> Array:
    """Return a central composite design, (F + 2k + centre_points, k): F factorial runs, axial points, centre points.

    From five factors on, the factorial runs are the smallest fraction of resolution V, which still estimates all
    two-factor interactions. Source: G. E. P. Box and K. B. Wilson, J. Roy. Stat. Soc. B 13 (1951), 1–45.
    """
    if k < 1:
        raise UsageError(f"rsm.factors: the number of factors is {k}; list at least one factor")
    if centre_points < 0:
        raise UsageError(f"rsm.centre_points: {centre_points} is negative; write 6, the usual number for three factors")
    axes = np.array([sign * row for row in np.eye(k) for sign in (-1.0, 1.0)]) + 0.0
    return np.vstack([_corners(k), axial_distance(k, alpha) * axes, np.zeros((centre_points, k))])


def _corners(k: int) -> Array:
    """Return the factorial runs: all 2^k, the last factor changing fastest, or a fraction of resolution V."""
    return fraction(k, resolution=5).design() if k >= 5 else full_factorial(k)[:, ::-1]


def box_behnken(k: int, centre_points: int = 3) -> Array:
    """Return a Box–Behnken design for 3 to 7 factors: 12, 24, 40, 48 or 56 runs, none at a corner, and centre points.

    Source: G. E. P. Box and D. W. Behnken, Technometrics 2 (1960), 455–475.
    """
    if k not in _BLOCKS:
        raise UsageError(f"Box–Behnken designs are available for 3 to 7 factors, not for {k}; use `central-composite`")
    runs = []
    for block in _BLOCKS[k]:
        runs.append(np.zeros((2 ** len(block), k)))
        runs[-1][:, [factor - 1 for factor in block]] = full_factorial(len(block))[:, ::-1]
    return np.vstack([*runs, np.zeros((centre_points, k))])


@dataclass(frozen=True)
class SurfaceOptions:
    """Options of a design for a response surface; each design uses the options that apply to it."""

    design: str = "central-composite"
    centre_points: int = 6
    alpha: str | float = "rotatable"
    runs: int | None = None
    extra_runs: int = 0


class SurfaceDesign(Checked):
    """Base class of designs for a response surface, in coded units."""

    name: ClassVar[str] = ""
    factors: ClassVar[tuple[int, int]] = (2, 100)  # smallest and largest number of factors
    balanced: ClassVar[bool] = True  # whether the mean coded level of each factor is 0

    def points(self, k: int, options: SurfaceOptions) -> Array:
        """Return the runs (n, k)."""
        raise NotImplementedError

    def runs(self, k: int, options: SurfaceOptions) -> Array:
        """Return `points` after checking them; raise `UsageError` for a number of factors outside `factors`."""
        least, most = self.factors
        if not (1 if least == 2 else least) <= k <= most:  # a study with a single factor uses the designs for two
            raise UsageError(f"rsm.factors: the `{self.name}` design requires {least} to {most} factors, not {k}")
        reach, radius, points = (self._checked(part, k, options) for part in (self.reach, self.radius, self.points))
        if points.ndim != 2 or points.shape[1] != k or not len(points) or reach.ndim or radius.ndim:
            raise self._wrong(
                f"`points` returned an array of shape {points.shape}, `reach` and `radius` of shapes {reach.shape} and "
                f"{radius.shape}; required are (runs, {k}) and single numbers"
            )
        return points

    def _checked(self, part: Callable[[int, SurfaceOptions], Any], k: int, options: SurfaceOptions) -> Array:
        try:
            with contained():
                values = np.asarray(part(k, options), dtype=float)
        except ForeignError as error:
            if isinstance(error.__cause__, UsageError):
                raise error.__cause__ from None
            raise self._wrong(f"`{part.__name__}` failed for {k} factors: {error}") from None
        if not np.isfinite(values).all():
            raise self._wrong(f"`{part.__name__}` returned numbers that are not finite for {k} factors")
        return values

    def _wrong(self, reason: str) -> UsageError:
        package = SURFACES.version_of(self.name)
        return UsageError(
            f"rsm.design: the `{self.name}` design{f' of {package}' * bool(package)} cannot be used: {reason}. Choose "
            "another design, or correct the package and run `stemcal.testing.check_design`"
        )

    def reach(self, k: int, options: SurfaceOptions) -> float:
        """Return the coded value of the high level of a factor; the low level is its negative."""
        return 1.0

    def radius(self, k: int, options: SurfaceOptions) -> float:
        """Return the coded radius within which the surface is valid; by default √k, the distance of the corners."""
        return float(k**0.5)


class CentralComposite(SurfaceDesign):
    """Central composite design: factorial runs at the corners, axial points at ±α, and the centre."""

    name = "central-composite"

    def points(self, k: int, options: SurfaceOptions) -> Array:
        return central_composite(k, options.centre_points, options.alpha)

    def reach(self, k: int, options: SurfaceOptions) -> float:
        return max(1.0, axial_distance(k, options.alpha))

    def radius(self, k: int, options: SurfaceOptions) -> float:
        alpha = axial_distance(k, options.alpha)
        return alpha if options.alpha == "rotatable" else max(alpha, k**0.5)


class BoxBehnken(SurfaceDesign):
    """Box–Behnken design: midpoints of the edges and the centre; no run at a corner."""

    name, factors = "box-behnken", (3, 7)

    def points(self, k: int, options: SurfaceOptions) -> Array:
        return box_behnken(k, options.centre_points)

    def radius(self, k: int, options: SurfaceOptions) -> float:
        return float(np.linalg.norm(box_behnken(k, 0), axis=1).max())


class LatinHypercube(SurfaceDesign):
    """Latin hypercube: points spread over the whole range of each factor."""

    name, balanced = "latin-hypercube", False

    def points(self, k: int, options: SurfaceOptions) -> Array:
        terms = (k + 1) * (k + 2) // 2  # number of terms of a quadratic
        return latin_hypercube(k, _RUNS_PER_TERM * terms if options.runs is None else options.runs)


SURFACES: Registry[SurfaceDesign] = Registry(
    SurfaceDesign,
    "stemcal.designs",
    tuple(f"{__name__}:{kind}" for kind in ("CentralComposite", "BoxBehnken", "LatinHypercube")),
)


def surface_design(name: str) -> SurfaceDesign:
    """Return a design by its name; raise `UsageError` if there is none."""
    if (design := SURFACES.named(name)) is None:
        known = ", ".join(built_in.name for built_in in SURFACES.built_in)
        raise UsageError(f"rsm.design: unknown design {name!r}; choose one of {known}")
    return design


def surface_runs(k: int, options: SurfaceOptions) -> Array:
    """Return the design of the response surface for k factors, followed by its extra runs."""
    design = surface_design(options.design)
    runs = design.runs(k, options)
    if not options.extra_runs:
        return runs
    # candidates: the grid of the levels 0, ±1 and, for few factors, ±α, within the sphere where the surface is valid
    reach, radius = design.reach(k, options), design.radius(k, options)
    levels = sorted({-1.0, 0.0, 1.0} | ({-reach, reach} if k <= _MOST_FOR_FIVE_LEVELS else set()))
    grid = np.array(list(product(levels, repeat=k)))
    inside = np.linalg.norm(grid, axis=1) <= max(radius, k**0.5) + 1e-9
    return np.vstack([runs, extra_runs(runs, options.extra_runs, grid[inside])])


_SAME_POINT = 1e-6
_RIDGE = 1e-8  # added to XᵀX, which is singular if the design cannot estimate every term


def extra_runs(design: Array, count: int, candidates: Array) -> Array:
    """Augment a design D-optimally for the full quadratic model: choose `count` of the candidates, (count, k).

    Each step adds the candidate with the largest variance of prediction, which increases |XᵀX| most. Points of the
    design are not repeated, because a deterministic solver would return the same response. Raises `UsageError` if too
    few candidates are left. Source: T. J. Mitchell, Technometrics 16 (1974), 203–210.
    """
    gaps = np.abs(candidates[:, None] - design[None]).max(axis=2)
    points = candidates[gaps.min(axis=1) > _SAME_POINT]
    if (left := len(points)) < count:
        raise UsageError(f"rsm.extra_runs: only {left} candidate points are available for {count} runs; use fewer runs")
    phi, base = term_columns(points), term_columns(design)
    information = base.T @ base + _RIDGE * np.eye(base.shape[1])
    chosen: list[int] = []
    for _ in range(count):
        variance = np.einsum("ij,jk,ik->i", phi, np.linalg.inv(information), phi)
        variance[chosen] = -np.inf
        chosen.append(int(np.argmax(variance)))
        information = information + np.outer(phi[chosen[-1]], phi[chosen[-1]])
    return np.asarray(points[chosen])


@cache
def latin_hypercube(k: int, runs: int, seed: int = 0) -> Array:
    """Return a Latin hypercube (runs, k) from −1 to +1, optimised by SciPy for low centred discrepancy.

    Each of `runs` equal slices of a factor's range contains one point. Source: M. D. McKay, R. J. Beckman and W. J.
    Conover, Technometrics 21 (1979), 239–245.
    """
    from scipy.stats.qmc import LatinHypercube

    sampler = LatinHypercube(k, optimization="random-cd", seed=np.random.default_rng(seed))
    points = np.asarray(2.0 * sampler.random(runs) - 1.0)
    points.setflags(write=False)  # the cache returns this array again, so no caller may change it
    return points
