"""Bulk density: pour a loose packing into a box with LIGGGHTS, weigh what lies there.

Called in a folder that holds ``box.in``: ``python3 box.py SEED GRAIN_DENSITY``. Writes ``out.json`` with
``bulk_density`` (kg/m³) and ``energy`` (J), what is left of the grains' motion.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from grains import STEP, bulk_density, logged, pack, read_grains, run_liggghts, write_grains, write_planes

WIDTH, DEPTH = 0.1, 0.04  # of the box, m
GRAINS = 400
OFTEN, LONGEST = 0.1, 2.0  # s: between looks at the energy, in all
AT_REST = 1e-6  # J


def main() -> None:
    """Fill and weigh one box."""
    seed, density = int(sys.argv[1]), float(sys.argv[2])
    grains = pack(GRAINS, WIDTH, DEPTH, seed)
    write_grains(grains, density, DEPTH, (-0.02, 0.0, -0.05), (WIDTH + 0.02, DEPTH, 0.0), Path("grains.data"))
    write_planes([((-0.005, 0.0, 0.0), (WIDTH + 0.005, 0.0, 0.0))], DEPTH, Path("floor.stl"))
    often = round(OFTEN / STEP)
    run_liggghts("box.in", step=STEP, width=WIDTH, rest=AT_REST, often=often, rounds=round(LONGEST / OFTEN))
    result = {
        "bulk_density": bulk_density(read_grains(Path("filled.dump")), density, WIDTH, DEPTH),
        "energy": logged()[-1][2],
    }
    Path("out.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    main()
