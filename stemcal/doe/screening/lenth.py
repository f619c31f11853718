"""Lenth's method: which effects stand out, when there are too few degrees of freedom for an error.

The effects' own pseudo standard error divides each of them, t = |c|/PSE. What t may be where no factor matters
depends on the number of effects m alone, so it is simulated: the margin of error ME = q·PSE holds the share 1 − α of
all t, the simultaneous margin SME that share of the largest t of m effects. Lenth's own t quantiles at m/3 degrees of
freedom are too wide: for nine effects by 41 %, for four 3.6 times.

Sources: R. V. Lenth, Technometrics 31 (1989), 469–473; K. Q. Ye and M. Hamada, Critical Values of the Lenth Method
for Unreplicated Factorial Designs, J. Quality Technology 32 (2000), 57–66.

The unused columns of a Plackett–Burman design are further contrasts for it, and a fold-over is worth its runs where
an effect as large as the margin is missed less often with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np

from stemcal.doe.designs.aliases import alias_matrix
from stemcal.doe.designs.catalogue import fold_over
from stemcal.doe.designs.plackett_burman import cyclic_design
from stemcal.doe.regression.least_squares import Array
from stemcal.errors import UsageError
from stemcal.notes import Note

# Effects drawn for a null distribution: quantiles at 5 % are then good to about 0.2 % (single) and 0.4 % (largest).
_DRAWN, _SEED = 4_000_000, 1989


@dataclass(frozen=True)
class Lenth:
    """Pseudo standard error, margin of error and simultaneous margin of error of m effects (None below three)."""

    pse: float | None
    me: float | None
    sme: float | None
    m: int = 0

    def p_value(self, effect: float) -> float | None:
        """Return the two-sided p of one effect: the share of t under chance alone that are as large."""
        if not self.pse:
            return None
        t = null_t(self.m)
        return float((1 + np.count_nonzero(t >= abs(effect) / self.pse)) / (1 + t.size))


def lenth(effects: Array, alpha: float = 0.05) -> Lenth:
    """Take the effects themselves as the measure of noise, assuming that most of them are noise."""
    sizes = np.abs(effects)
    m = sizes.size
    if m < 3:
        return Lenth(None, None, None, m)
    pse = float(pseudo_standard_error(np.sort(sizes)[None, :])[0])
    single, simultaneous = critical_t(m, alpha)
    return Lenth(pse, single * pse, simultaneous * pse, m)


def pseudo_standard_error(rising: Array) -> Array:
    """Return PSE = 1.5·median of the |c| < 2.5·s₀, s₀ = 1.5·median|c|, of rows of sizes in rising order."""
    s0 = 1.5 * _median(rising, np.full(len(rising), rising.shape[1]))
    inner = (rising < 2.5 * s0[:, None]).sum(axis=1)
    return np.where(inner > 0, 1.5 * _median(rising, inner), 0.0)


def _median(rising: Array, count: Array) -> Array:
    """Return the median of the first `count` numbers of each row."""
    rows, last = np.arange(len(rising)), np.maximum(count, 1) - 1
    return np.asarray(0.5 * (rising[rows, last // 2] + rising[rows, (last + 1) // 2]))


@lru_cache(maxsize=8)
def critical_t(m: int, alpha: float) -> tuple[float, float]:
    """Return what t exceeds with probability α by chance: one of m effects, and the largest of them."""
    t = null_t(m)
    return float(np.quantile(t, 1.0 - alpha)), float(np.quantile(t[:, -1], 1.0 - alpha))


@lru_cache(maxsize=1)
def null_t(m: int) -> Array:
    """Return t of m effects that are chance alone, (draws, m), in rising order in each row; always the same."""
    random = np.random.default_rng(_SEED)
    rising = np.sort(np.abs(random.standard_normal((_DRAWN // m, m))), axis=1)
    return np.asarray(rising / pseudo_standard_error(rising)[:, None])


# ---- unused columns
#
# Of N runs of a Plackett–Burman design with k factors N − 1 − k columns carry none. Where the runs are those of the
# known design, in whatever order, each of them is a contrast of its own, as large as interactions make it; Lenth's
# margin is that of these and the effects, which makes it surer the fewer factors there are. Of other designs, or where
# runs failed, only their sum of squares is known, not the contrasts.

_FEWEST = 3  # factors that Lenth's method is asked of


def unused_columns(design: Array) -> Array | None:
    """Return the columns left of a Plackett–Burman design, (n, n − 1 − k); None if the runs are not those of one."""
    n, k = design.shape
    design = np.round(design, 6)
    if n % 4 or not 1 <= k < n - 1 or not np.all(np.abs(design) == 1.0):
        return None
    try:
        whole = cyclic_design(n - 1, n)
    except UsageError:
        return None
    rows = {tuple(row[:k]): i for i, row in enumerate(whole.tolist())}
    places = [rows.get(tuple(row)) for row in design.tolist()]
    if len(rows) < n or None in places or len(set(places)) < n:
        return None
    return np.asarray(whole[[place for place in places if place is not None], k:])


def unused_contrasts(design: Array, response: Array) -> Array:
    """Return mean(+) − mean(−) of each unused column, (n − 1 − k,); of other designs, or below three factors, none."""
    columns = unused_columns(design) if design.shape[1] >= _FEWEST else None
    return np.empty(0) if columns is None else np.asarray(2.0 * columns.T @ response / len(response))


# ---- what a fold-over would find that a screening of resolution III misses
#
# A main effect of such a design holds parts of two-factor interactions. The largest effects that were found stand for
# the truth, with interactions between them drawn as heredity has them, normal with half the size of the smaller parent.
# One further effect as large as Lenth's margin is put in, all others are normal with a quarter of it. Counted is how
# often it stays within the margin of the design as it is, the unused columns of a Plackett–Burman counted, and of the
# design with its mirrored half, in which main effects are clear of interactions.

_CASES, _CASES_SEED, _PARENT, _SMALL = 2000, 12, 0.5, 0.25
_WORTH = 0.05  # share of the cases that it must find more


class FoldOverPays(Note):
    """Runs that it costs, and the share of cases in which an effect of this size is missed without and with it."""

    runs: int
    effect: float
    missed: float
    missed_folded: float


def fold_over_gain(
    design: Array, found: Sequence[tuple[int, float]], effect: float, alpha: float
) -> FoldOverPays | None:
    """Return what the mirrored half of a design would find.

    Parameters
    ----------
    found : sequence of (column, effect)
        The effects that count as real.
    effect : float
        Size of the further one.

    Returns None where main effects are clear of interactions already, fewer than two effects are real, or all are; and
    where it would find hardly more, as of four factors, whose effects alone tell Lenth's method little of the noise.
    """
    k = design.shape[1]
    free = [j for j in range(k) if j not in dict(found)]
    if len(found) < 2 or not free or k < 3 or np.abs(alias_matrix(design)).max(initial=0.0) < 1e-9:
        return None
    truth = _drawn(k, found, free, effect)
    now, folded = (_missed(half, truth, alpha) for half in (design, fold_over(design)))
    return FoldOverPays(len(design), effect, now, folded) if now - folded >= _WORTH else None


@dataclass(frozen=True)
class _Truth:
    """Effects (draws, k), interactions (draws, pairs) and the column that the further effect stands in."""

    effects: Array
    interactions: Array
    column: Array


def _drawn(k: int, found: Sequence[tuple[int, float]], free: Sequence[int], effect: float) -> _Truth:
    random, sizes = np.random.default_rng(_CASES_SEED), dict(found)
    column = random.choice(free, size=_CASES)
    effects = _SMALL * effect * random.standard_normal((_CASES, k))
    for j, size in found:
        effects[:, j] = size
    effects[np.arange(_CASES), column] = effect * random.choice([-1.0, 1.0], size=_CASES)
    pairs = list(combinations(range(k), 2))
    spread = [_PARENT * min(abs(sizes[a]), abs(sizes[b])) if a in sizes and b in sizes else 0.0 for a, b in pairs]
    return _Truth(effects, np.array(spread) * random.standard_normal((_CASES, len(pairs))), column)


def _missed(design: Array, truth: _Truth, alpha: float) -> float:
    seen = np.abs(truth.effects + truth.interactions @ alias_matrix(design).T)
    unused = unused_columns(design)
    if unused is not None:  # orthogonal columns: their aliases are Z'U/n, and no factor is in them
        pairs = np.array([design[:, a] * design[:, b] for a, b in combinations(range(design.shape[1]), 2)])
        seen = np.column_stack([seen, np.abs(truth.interactions @ (pairs @ unused) / len(design))])
    margin = critical_t(seen.shape[1], alpha)[0] * pseudo_standard_error(np.sort(seen, axis=1))
    return float(np.mean(seen[np.arange(len(seen)), truth.column] <= margin))
