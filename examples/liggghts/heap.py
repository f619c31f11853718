"""One heap: make a loose packing from a seed, let LIGGGHTS settle and open it, measure the angle of repose.

Called in a folder that holds ``heap.in``: ``python3 heap.py SEED [STEP]``. Writes ``out.json`` with ``angle`` (deg),
``bulk_density`` (kg/m³), ``grains`` left on the floor and ``energy`` (J), what is left of their motion.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from grains import (
    STEP,
    Grain,
    bulk_density,
    logged,
    pack,
    read_grains,
    run_liggghts,
    surface,
    write_grains,
    write_planes,
)

WIDTH, DEPTH = 0.14, 0.04  # of the box, m
GRAINS = 620
DENSITY = 1200.0  # of a grain, kg/m³
FILLING, OFTEN, LONGEST = 0.5, 0.1, 4.0  # s: settling in the box, between looks at the energy, after the opening
AT_REST = 1e-6  # J: as if every grain of a heap moved with 4 mm/s


def angle_of(grains: Sequence[Grain]) -> float:
    """Return the angle of the flank, deg: of the straight line up from the floor's edge, by least squares.

    A line that need not end at the edge follows every dent: its angle scatters twice as much from heap to heap.
    """
    flank = [(WIDTH - x, z) for x, z in surface(grains, WIDTH, DEPTH)]
    return math.degrees(math.atan(sum(x * z for x, z in flank) / sum(x * x for x, _ in flank)))


def main() -> None:
    """Make, run and measure one heap."""
    seed, step = int(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else STEP
    low, high = (-0.02, 0.0, -0.05), (WIDTH + 0.1, DEPTH, 0.0)
    write_grains(pack(GRAINS, WIDTH, DEPTH, seed), DENSITY, DEPTH, low, high, Path("grains.data"))
    write_planes([((-0.005, 0.0, 0.0), (WIDTH, 0.0, 0.0))], DEPTH, Path("floor.stl"))
    often = round(OFTEN / step)
    times = {"filling": round(FILLING / step), "often": often, "rounds": round(LONGEST / OFTEN)}
    run_liggghts("heap.in", step=step, width=WIDTH, rest=AT_REST, **times)
    heap = read_grains(Path("heap.dump"))
    result = {
        "angle": angle_of(heap),
        "bulk_density": bulk_density(read_grains(Path("filled.dump")), DENSITY, WIDTH, DEPTH),
        "grains": len(heap),
        "energy": logged()[-1][2],
    }
    Path("out.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    main()
