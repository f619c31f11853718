"""Hopper discharge: fill a hopper over a plug with LIGGGHTS, pull the plug, measure how fast the grains run out.

Called in a folder that holds ``hopper.in``: ``python3 hopper.py SEED``. Writes ``out.json`` with ``rate`` (g/s) between
20 and 70 % of the grains gone, and ``left``, the grains that stay.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from grains import RADIUS, STEP, logged, pack, run_liggghts, write_grains, write_planes

WIDTH, DEPTH = 0.14, 0.04  # of the bin, m
OUTLET, SLOPE = 0.05, 50.0  # width of the slot, m; of the hopper's walls, deg
GRAINS = 620
DENSITY = 1200.0  # of a grain, kg/m³
FILLING, OFTEN, LONGEST = 0.6, 0.02, 5.0  # s: settling, between counts, after the plug is gone
FROM, TO = 0.8, 0.3  # share of the grains that are left where the rate is taken


def rate_of(counts: list[tuple[float, int]], mass: float) -> float:
    """Return the rate from time and number of grains left, in the unit of a grain's mass per second.

    >>> rate_of([(0.0, 100), (1.0, 80), (2.0, 60), (3.0, 30), (4.0, 10)], 2.0)
    50.0
    """
    most = counts[0][1]
    first = next(row for row in counts if row[1] <= FROM * most)
    last = next(row for row in counts if row[1] <= TO * most)
    return (first[1] - last[1]) * mass / (last[0] - first[0])


def main() -> None:
    """Fill and empty one hopper."""
    seed = int(sys.argv[1])
    left, right = 0.5 * (WIDTH - OUTLET), 0.5 * (WIDTH + OUTLET)
    height = left * math.tan(math.radians(SLOPE))
    grains = [(x, y, z + height, radius) for x, y, z, radius in pack(GRAINS, WIDTH, DEPTH, seed)]
    write_grains(grains, DENSITY, DEPTH, (-0.02, 0.0, -0.05), (WIDTH + 0.02, DEPTH, 0.0), Path("grains.data"))
    walls = [((0.0, 0.0, height), (left, 0.0, 0.0)), ((right, 0.0, 0.0), (WIDTH, 0.0, height))]
    write_planes(walls, DEPTH, Path("hopper.stl"))
    filling, often = round(FILLING / STEP), round(OFTEN / STEP)
    run_liggghts("hopper.in", step=STEP, width=WIDTH, filling=filling, often=often, rounds=round(LONGEST / OFTEN))
    counts = [(step * STEP, count) for step, count, _ in logged() if step >= filling]
    grams = 1e3 * DENSITY * 4.0 / 3.0 * math.pi * RADIUS**3
    Path("out.json").write_text(json.dumps({"rate": rate_of(counts, grams), "left": counts[-1][1]}), encoding="utf-8")


if __name__ == "__main__":
    main()
