"""What studies of grains share: a loose packing by chance, the files of LIGGGHTS, the surface of what lies there.

Lengths are in metres; a slab of grains is periodic over its depth (y).
"""

from __future__ import annotations

import math
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

RADIUS, SPREAD = 0.005, 0.1  # m; radii are uniform between RADIUS·(1 ± SPREAD)
STEP = 1.2e-4  # s, three tenths of the Rayleigh time

Grain = tuple[float, float, float, float]  # x, y, z, radius
Point = tuple[float, float, float]


def pack(count: int, width: float, depth: float, seed: int) -> list[Grain]:
    """Return grains that do not touch: on a loose lattice, each moved and sized by chance."""
    chance = random.Random(seed)
    room = 2.0 * RADIUS * (1.0 + SPREAD) * 1.05
    across, deep = int(width / room), int(depth / room)
    dx, dy = width / across, depth / deep
    grains = []
    for number in range(count):
        layer, place = divmod(number, across * deep)
        i, j = divmod(place, deep)
        radius = RADIUS * chance.uniform(1.0 - SPREAD, 1.0 + SPREAD)
        free = [0.5 * side - RADIUS * (1.0 + SPREAD) for side in (dx, dy)]
        x = (i + 0.5) * dx + chance.uniform(-1.0, 1.0) * free[0]
        y = (j + 0.5) * dy + chance.uniform(-1.0, 1.0) * free[1]
        grains.append((x, y, (layer + 0.5) * room, radius))
    return grains


def write_grains(grains: Sequence[Grain], density: float, depth: float, low: Point, high: Point, path: Path) -> None:
    """Write a packing as LIGGGHTS reads it; grains that leave the box from `low` to `high` are gone."""
    top = max(max(z for _, _, z, _ in grains) + 4.0 * RADIUS, high[2])
    head = (
        f"loose packing\n\n{len(grains)} atoms\n2 atom types\n\n{low[0]:g} {high[0]:g} xlo xhi\n0 {depth:g} ylo yhi\n"
        f"{low[2]:g} {top:g} zlo zhi\n\nAtoms\n\n"
    )
    rows = [
        f"{number} 1 {2.0 * radius:.9g} {density:g} {x:.9g} {y:.9g} {z:.9g}"
        for number, (x, y, z, radius) in enumerate(grains, 1)
    ]
    path.write_text(head + "\n".join(rows) + "\n", encoding="ascii")


def write_planes(lines: Sequence[tuple[Point, Point]], depth: float, path: Path) -> None:
    """Write planes of two triangles each: lines in the plane of x and z, left to right, drawn out over the depth."""
    facets = []
    for (x0, _, z0), (x1, _, z1) in lines:
        a, b, c, d = (x0, 0.0, z0), (x1, 0.0, z1), (x1, depth, z1), (x0, depth, z0)
        length = math.hypot(x1 - x0, z1 - z0)
        normal = f"{(z0 - z1) / length:g} 0 {(x1 - x0) / length:g}"
        for triangle in ((a, b, c), (a, c, d)):
            corners = "\n".join("vertex {:g} {:g} {:g}".format(*corner) for corner in triangle)
            facets.append(f"facet normal {normal}\nouter loop\n{corners}\nendloop\nendfacet\n")
    path.write_text(f"solid {path.stem}\n{''.join(facets)}endsolid {path.stem}\n", encoding="ascii")


def run_liggghts(script: str, **variables: float) -> None:
    """Run LIGGGHTS on an input file, with these variables in it."""
    if shutil.which("liggghts") is None:
        sys.exit("liggghts is not installed; on Debian and Ubuntu: apt-get install liggghts")
    said = [part for name, value in variables.items() for part in ("-var", name, f"{value:g}")]
    ended = subprocess.run(["liggghts", "-in", script, "-log", "grains.log", *said], check=False)
    if ended.returncode:
        sys.exit(f"liggghts ended with code {ended.returncode}")


def read_grains(path: Path) -> list[Grain]:
    """Return the grains of a dump."""
    lines = path.read_text(encoding="ascii").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("ITEM: ATOMS")) + 1
    rows = [[float(part) for part in line.split()] for line in lines[start:]]
    return [(x, y, z, radius) for x, y, z, radius in rows]


def logged(path: Path = Path("grains.log")) -> list[tuple[int, int, float]]:
    """Return what the log tells: step, grains that are left, their kinetic energy (J)."""
    rows = [line.split() for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    return [
        (int(row[0]), int(row[1]), float(row[2]))
        for row in rows
        if len(row) == 3 and row[0].isdigit() and row[1].isdigit()
    ]


def surface(grains: Sequence[Grain], width: float, depth: float, columns: int = 64) -> Iterator[tuple[float, float]]:
    """Yield x and the height of what lies there seen from above at x, the mean over the depth of the slab."""
    rows = 16
    for i in range(columns):
        x = (i + 0.5) * width / columns
        near = [grain for grain in grains if abs(grain[0] - x) < grain[3]]
        heights = []
        for j in range(rows):
            y = (j + 0.5) * depth / rows
            tops = [0.0]
            for gx, gy, gz, radius in near:
                dy = (gy - y + 0.5 * depth) % depth - 0.5 * depth
                under = radius**2 - (gx - x) ** 2 - dy**2
                if under > 0.0:
                    tops.append(gz + math.sqrt(under))
            heights.append(max(tops))
        yield x, sum(heights) / rows


def bulk_density(grains: Sequence[Grain], density: float, width: float, depth: float) -> float:
    """Return the mass of grains in a box over their volume up to the mean surface, kg/m³."""
    mass = sum(density * 4.0 / 3.0 * math.pi * radius**3 for *_, radius in grains)
    heights = [z for _, z in surface(grains, width, depth)]
    return mass / (width * depth * sum(heights) / len(heights))
