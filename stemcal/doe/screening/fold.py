"""What a fold-over would find that a screening of resolution III misses.

A main effect of such a design holds parts of two-factor interactions. The largest effects that were found stand for
the truth, with interactions between them drawn as heredity has them, normal with half the size of the smaller parent.
One further effect as large as Lenth's margin is put in, all others are normal with a quarter of it. Counted is how
often it stays within the margin of the design as it is, the unused columns of a Plackett–Burman counted, and of the
design with its mirrored half, in which main effects are clear of interactions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from stemcal.doe.designs.aliases import alias_matrix
from stemcal.doe.designs.catalogue import fold_over
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.screening.lenth import critical_t, pseudo_standard_error
from stemcal.doe.screening.unused import unused_columns
from stemcal.notes import Note

_DRAWS, _SEED, _PARENT, _SMALL = 2000, 12, 0.5, 0.25
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
    random, sizes = np.random.default_rng(_SEED), dict(found)
    column = random.choice(free, size=_DRAWS)
    effects = _SMALL * effect * random.standard_normal((_DRAWS, k))
    for j, size in found:
        effects[:, j] = size
    effects[np.arange(_DRAWS), column] = effect * random.choice([-1.0, 1.0], size=_DRAWS)
    pairs = list(combinations(range(k), 2))
    spread = [_PARENT * min(abs(sizes[a]), abs(sizes[b])) if a in sizes and b in sizes else 0.0 for a, b in pairs]
    return _Truth(effects, np.array(spread) * random.standard_normal((_DRAWS, len(pairs))), column)


def _missed(design: Array, truth: _Truth, alpha: float) -> float:
    seen = np.abs(truth.effects + truth.interactions @ alias_matrix(design).T)
    unused = unused_columns(design)
    if unused is not None:  # orthogonal columns: their aliases are Z'U/n, and no factor is in them
        pairs = np.array([design[:, a] * design[:, b] for a, b in combinations(range(design.shape[1]), 2)])
        seen = np.column_stack([seen, np.abs(truth.interactions @ (pairs @ unused) / len(design))])
    margin = critical_t(seen.shape[1], alpha)[0] * pseudo_standard_error(np.sort(seen, axis=1))
    return float(np.mean(seen[np.arange(len(seen)), truth.column] <= margin))
