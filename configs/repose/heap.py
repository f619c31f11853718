"""One heap: make a loose packing from a seed, let LIGGGHTS settle and open it, measure the angle of repose.

Called in a folder that holds ``heap.in``: ``python3 heap.py SEED [STEP]``. Writes ``out.json`` with ``angle`` (deg),
``bulk_density`` (kg/m³), ``grains`` left on the floor and ``energy`` (J), what is left of their motion.
"""

from __future__ import annotations

import json
import math
import random
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

WIDTH, DEPTH = 0.14, 0.04  # of the box, m; the slab is periodic over its depth
GRAINS = 620
RADIUS, SPREAD = 0.005, 0.1  # m; radii are uniform between RADIUS·(1 ± SPREAD)
DENSITY = 1200.0  # of a grain, kg/m³
STEP = 1.2e-4  # s, three tenths of the Rayleigh time
FILLING, OFTEN, LONGEST = 0.5, 0.1, 4.0  # s: settling in the box, between looks at the energy, after the opening
AT_REST = 1e-8  # J: as if every grain of a heap moved with 0.3 mm/s

Grain = tuple[float, float, float, float]  # x, y, z, radius


def pack(seed: int) -> list[Grain]:
    """Return grains that do not touch: on a loose lattice, each moved and sized by chance."""
    chance = random.Random(seed)
    room = 2.0 * RADIUS * (1.0 + SPREAD) * 1.05
    across, deep = int(WIDTH / room), int(DEPTH / room)
    dx, dy = WIDTH / across, DEPTH / deep
    grains = []
    for number in range(GRAINS):
        layer, place = divmod(number, across * deep)
        i, j = divmod(place, deep)
        radius = RADIUS * chance.uniform(1.0 - SPREAD, 1.0 + SPREAD)
        free = [0.5 * side - RADIUS * (1.0 + SPREAD) for side in (dx, dy)]
        x = (i + 0.5) * dx + chance.uniform(-1.0, 1.0) * free[0]
        y = (j + 0.5) * dy + chance.uniform(-1.0, 1.0) * free[1]
        grains.append((x, y, (layer + 0.5) * room, radius))
    return grains


def write_grains(grains: list[Grain], path: Path) -> None:
    """Write the packing as LIGGGHTS reads it; grains that fall 5 cm below the floor are gone."""
    top = max(z for _, _, z, _ in grains) + 4.0 * RADIUS
    head = (
        f"loose packing\n\n{len(grains)} atoms\n2 atom types\n\n-0.02 {WIDTH + 0.1:g} xlo xhi\n0 {DEPTH:g} ylo yhi\n"
        f"-0.05 {top:g} zlo zhi\n\nAtoms\n\n"
    )
    rows = [
        f"{number} 1 {2.0 * radius:.9g} {DENSITY:g} {x:.9g} {y:.9g} {z:.9g}"
        for number, (x, y, z, radius) in enumerate(grains, 1)
    ]
    path.write_text(head + "\n".join(rows) + "\n", encoding="ascii")


def write_floor(path: Path) -> None:
    """Write the floor, two triangles that end where the box does."""
    a, b, c, d = (-0.005, 0.0, 0.0), (WIDTH, 0.0, 0.0), (WIDTH, DEPTH, 0.0), (-0.005, DEPTH, 0.0)
    facets = []
    for triangle in ((a, b, c), (a, c, d)):
        corners = "\n".join("vertex {:g} {:g} {:g}".format(*corner) for corner in triangle)
        facets.append(f"facet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet\n")
    path.write_text("solid floor\n" + "".join(facets) + "endsolid floor\n", encoding="ascii")


def simulate(step: float) -> None:
    """Run LIGGGHTS on ``heap.in``."""
    often = round(OFTEN / step)
    variables = {
        "step": step,
        "width": WIDTH,
        "filling": round(FILLING / step),
        "often": often,
        "rounds": round(LONGEST / OFTEN),
        "rest": AT_REST,
    }
    said = [part for name, value in variables.items() for part in ("-var", name, f"{value:g}")]
    ended = subprocess.run(["liggghts", "-in", "heap.in", "-log", "heap.log", *said], check=False)
    if ended.returncode:
        sys.exit(f"liggghts ended with code {ended.returncode}")


def read_grains(path: Path) -> list[Grain]:
    """Return the grains of a dump."""
    lines = path.read_text(encoding="ascii").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("ITEM: ATOMS")) + 1
    rows = [[float(part) for part in line.split()] for line in lines[start:]]
    return [(x, y, z, radius) for x, y, z, radius in rows]


def last_energy(path: Path) -> float:
    """Return the last kinetic energy that the log tells, J."""
    rows = [line.split() for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    return float([row for row in rows if len(row) == 3 and row[0].isdigit() and row[1].isdigit()][-1][2])


def surface(grains: list[Grain], columns: int = 64, rows: int = 16) -> Iterator[tuple[float, float]]:
    """Yield x and the height of the heap seen from above at x, the mean over the depth of the slab."""
    for i in range(columns):
        x = (i + 0.5) * WIDTH / columns
        near = [grain for grain in grains if abs(grain[0] - x) < grain[3]]
        heights = []
        for j in range(rows):
            y = (j + 0.5) * DEPTH / rows
            tops = [0.0]
            for gx, gy, gz, radius in near:
                dy = (gy - y + 0.5 * DEPTH) % DEPTH - 0.5 * DEPTH
                under = radius**2 - (gx - x) ** 2 - dy**2
                if under > 0.0:
                    tops.append(gz + math.sqrt(under))
            heights.append(max(tops))
        yield x, sum(heights) / rows


def slope_of(points: list[tuple[float, float]]) -> float:
    """Return the slope of the straight line through points by least squares."""
    n = len(points)
    mean_x, mean_z = sum(x for x, _ in points) / n, sum(z for _, z in points) / n
    return sum((x - mean_x) * (z - mean_z) for x, z in points) / sum((x - mean_x) ** 2 for x, _ in points)


def angle_of(grains: list[Grain]) -> float:
    """Return the angle of the flank, deg: the line through the surface but for a tenth at wall and edge."""
    flank = [(x, z) for x, z in surface(grains) if 0.1 * WIDTH <= x <= 0.9 * WIDTH]
    return -math.degrees(math.atan(slope_of(flank)))


def bulk_density(grains: list[Grain]) -> float:
    """Return the mass of the filled box over its volume up to the mean surface, kg/m³."""
    mass = sum(DENSITY * 4.0 / 3.0 * math.pi * radius**3 for *_, radius in grains)
    heights = [z for _, z in surface(grains)]
    return mass / (WIDTH * DEPTH * sum(heights) / len(heights))


def main() -> None:
    """Make, run and measure one heap."""
    seed, step = int(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else STEP
    write_grains(pack(seed), Path("grains.data"))
    write_floor(Path("floor.stl"))
    simulate(step)
    heap = read_grains(Path("heap.dump"))
    result = {
        "angle": angle_of(heap),
        "bulk_density": bulk_density(read_grains(Path("filled.dump"))),
        "grains": len(heap),
        "energy": last_energy(Path("heap.log")),
    }
    Path("out.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    main()
