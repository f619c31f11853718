"""Which factors does a screening choose: those that matter, and how many others?

python benchmarks/screening_power.py

Draws studies whose contrasts are chance alone but for some factors with effects of so many standard errors. Of
Plackett-Burman designs it counts the share of these that is found and the share of the others that is chosen, by F
against the unused columns, by Lenth's margin over the factors, over all contrasts, and as `screening.significant` has
it. Of definitive screenings in which nothing matters it counts how many studies end with a square or an interaction,
with centre runs that scatter and with such as agree. Two minutes.
"""

from __future__ import annotations

import numpy as np

from stemcal.doe.designs.catalogue import plackett_burman
from stemcal.doe.designs.definitive_screening import definitive_screening
from stemcal.doe.regression.least_squares import Array
from stemcal.doe.screening.analysis import analyse_screening
from stemcal.doe.screening.lenth import lenth
from stemcal.doe.screening.two_stage_analysis import two_stages

SEED, STUDIES, NULLS = 2_718, 400, 1000
NAMES = [f"x{i}" for i in range(24)]
WAYS = ("F", "factors' margin", "all contrasts' margin", "chosen")


def shares(factors: int, runs: int, active: int, size: float, studies: int = STUDIES) -> Array:
    """Return per cent of the active factors found and of the others chosen, (ways, 2); NaN where there are none."""
    design, random = plackett_burman(factors, runs=runs), np.random.default_rng([SEED, factors, runs, active])
    effect = size * 2.0 / np.sqrt(runs)  # standard error of a difference of two means of runs/2
    counts = np.zeros((len(WAYS), 2))
    for _ in range(studies):
        y = 50.0 + design[:, :active] @ np.full(active, 0.5 * effect) + random.standard_normal(runs)
        found = analyse_screening(design, y, NAMES[:factors])
        sizes = np.array([abs(e.effect) for e in found.effects])
        chosen = np.array(
            [
                [e.p is not None and e.p < 0.05 for e in found.effects],
                sizes > (lenth(sizes).me or np.inf),
                sizes > (found.lenth.me or np.inf),
                [e.factor in found.significant for e in found.effects],
            ]
        )
        counts += np.column_stack([chosen[:, :active].sum(axis=1), chosen[:, active:].sum(axis=1)])
    possible = np.array([active, factors - active], dtype=float) * studies
    return np.asarray(100.0 * counts / np.where(possible > 0.0, possible, np.nan))


def second_order_by_chance(factors: int, runs: int, centre_scatters: bool, studies: int = NULLS) -> float:
    """Return per cent of definitive screenings of chance alone that end with a square or an interaction."""
    design, random = definitive_screening(factors, runs), np.random.default_rng([SEED, factors, runs])
    centre = ~np.any(design, axis=1)
    found = 0
    for _ in range(studies):
        y = random.standard_normal(runs)
        y[centre] = y[centre] if centre_scatters else y[centre][0]
        stages = two_stages(design, y, NAMES[:factors])
        found += bool(stages is not None and stages.second_order)
    return 100.0 * found / studies


def main() -> None:
    """Print both tables."""
    print("| factors | runs | active | " + " | ".join(f"{way}: found, others" for way in WAYS) + " |")
    for factors, runs in ((5, 8), (5, 12), (7, 12), (9, 12), (15, 20)):
        for active in (1, 2, 3, 5) if factors > 5 else (1, 2, 3):
            cells = (f"{power:.0f}, {false:.1f}" for power, false in shares(factors, runs, active, 4.0))
            print(f"| {factors} | {runs} | {active} | " + " | ".join(cells) + " |", flush=True)
    print("| factors | runs | centre runs scatter | centre runs agree |")
    for factors, runs in ((5, 13), (5, 15), (5, 17), (6, 13), (7, 17), (7, 19), (7, 21)):
        cells = (f"{second_order_by_chance(factors, runs, scatter):.0f}" for scatter in (True, False))
        print(f"| {factors} | {runs} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
