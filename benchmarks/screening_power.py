"""Detection rate and false-positive rate of a screening.

python benchmarks/screening_power.py

The simulated studies have random contrasts, except for some factors with effects of four standard errors. A row per
Plackett–Burman design gives the rate of active factors that are detected and the rate of inactive factors that are
selected: by the F test against the residual, by Lenth's method, and by the rule of `screening.significant`. The script
takes a minute.
"""

from __future__ import annotations

import numpy as np

from stemcal.doe.coding import Array
from stemcal.doe.effects import stands_out
from stemcal.doe.factorial import plackett_burman
from stemcal.stages.screen.analysis import analyse_screening

SEED, STUDIES, SIZE = 2_718, 400, 4.0
NAMES = [f"x{i}" for i in range(24)]
WAYS = ("F", "Lenth", "rule")


def shares(factors: int, runs: int, active: int) -> Array:
    """Return the % of the active factors found and of the others chosen, (ways, 2); NaN where there are none."""
    design, random = plackett_burman(factors, runs), np.random.default_rng([SEED, factors, runs, active])
    effect = SIZE * 2.0 / np.sqrt(runs)  # standard error of a difference of two means of runs/2
    counts = np.zeros((len(WAYS), 2))
    for _ in range(STUDIES):
        y = 50.0 + design[:, :active] @ np.full(active, 0.5 * effect) + random.standard_normal(runs)
        found = analyse_screening(design, y, NAMES[:factors])
        chosen = np.array(
            [
                [e.p is not None and e.p < 0.05 for e in found.effects],
                [stands_out(e, found.lenth) for e in found.effects],
                [e.factor in found.significant for e in found.effects],
            ]
        )
        counts += np.column_stack([chosen[:, :active].sum(axis=1), chosen[:, active:].sum(axis=1)])
    possible = np.array([active, factors - active], dtype=float) * STUDIES
    return np.asarray(100.0 * counts / np.where(possible > 0.0, possible, np.nan))


def main() -> None:
    """Print the table."""
    print("| factors | runs | active | " + " | ".join(f"{way}: found, others" for way in WAYS) + " |")
    for factors, runs in ((5, 12), (7, 12), (8, 12), (9, 12), (9, 20)):
        for active in (1, 2, 3):
            cells = (f"{power:.0f}, {false:.1f}" for power, false in shares(factors, runs, active))
            print(f"| {factors} | {runs} | {active} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
