"""Plastic hinge of a tube in CalculiX with quadratic elements: collapse load relative to 4 Mp/L.

The model is a quarter of a tube with a diameter ratio of 0.41, which yields at 3 MPa without hardening, at small
strains. Supports and middle section are held at their sides at half the height, so that the tube neither dents nor
rolls. A nose pushes the middle instead if it is given.
"""

from __future__ import annotations

import subprocess
from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

DIAMETER, BORE, YIELD, E, NU = 8.0, 0.41, 3.0, 1000.0, 0.3
OVERHANG = 4.0
# the corners of a brick (x, r, θ in half elements), then the middles of its edges in CalculiX's order
CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
BRICK = np.array([*CORNERS, *((np.array(CORNERS[a]) + CORNERS[b]) // 2 for a, b in EDGES)])


def collapse(
    span: float, travel: float, layers: tuple[int, int, int] = (28, 2, 6), nose: tuple[float, float] | None = None
) -> float:
    """Return the force at the end of the travel (mm) over 4 Mp/L.

    `layers` of elements stand along half the span, through the wall and around half the tube. `nose` is half its extent
    along and across, mm; without one the sides are pushed.
    """
    with TemporaryDirectory() as folder:
        Path(folder, "hinge.inp").write_text(_deck(span, travel, layers, nose), encoding="utf-8")
        subprocess.run(["ccx", "hinge"], cwd=folder, capture_output=True, check=True)
        printed = Path(folder, "hinge.dat").read_text(encoding="utf-8").splitlines()
    last = max(i for i, line in enumerate(printed) if "total force" in line)
    force = 4.0 * abs(float(printed[last + 2].split()[2]))
    plastic_moment = YIELD * DIAMETER**3 * (1.0 - BORE**3) / 6.0
    return force / (4.0 * plastic_moment / span)


def _deck(span: float, travel: float, layers: tuple[int, int, int], nose: tuple[float, float] | None = None) -> str:
    along, through, around = layers
    x = np.append(np.linspace(0.0, 1.0, along + 1) ** 1.6 * 0.5 * span, 0.5 * span + OVERHANG)
    r = np.linspace(0.5 * DIAMETER * BORE, 0.5 * DIAMETER, through + 1)
    turn = np.linspace(-0.5 * pi, 0.5 * pi, around + 1)
    lines = [_halved(stations) for stations in (x, r, turn)]
    shape = tuple(len(stations) for stations in lines)
    nodes = {}
    for at in np.ndindex(shape):
        if sum(i % 2 for i in at) < 2:  # corners and middles of edges
            x_, r_, t = (stations[i] for stations, i in zip(lines, at, strict=True))
            nodes[int(np.ravel_multi_index(at, shape)) + 1] = (x_, r_ * cos(t), r_ * sin(t))
    bricks = [
        np.ravel_multi_index(tuple((BRICK + 2 * np.array(at)).T), shape) + 1
        for at in np.ndindex(len(x) - 1, through, around)
    ]
    sides = {n: p for n, p in nodes.items() if abs(p[2]) < 0.126 * DIAMETER}
    sets = {
        "MIDDLE": [n for n, p in nodes.items() if p[0] == 0.0],
        "PLANE": [n for n, p in nodes.items() if abs(p[1]) < 1e-9],
        "SUPPORT": [n for n, p in sides.items() if abs(p[0] - 0.5 * span) < 1e-9],
        "PUSHED": [n for n, p in sides.items() if p[0] == 0.0],
    }
    if nose is not None:
        skin = {n: p for n, p in nodes.items() if p[2] > 0.0 and p[1] ** 2 + p[2] ** 2 > 0.9999 * 0.25 * DIAMETER**2}
        sets["PUSHED"] = [n for n, p in skin.items() if p[0] <= nose[0] and p[1] <= nose[1]]
    text = ["*NODE", *(f"{n},{p[0]:.12g},{p[1]:.12g},{p[2]:.12g}" for n, p in nodes.items())]
    text.append("*ELEMENT,TYPE=C3D20R,ELSET=ALL")
    for number, brick in enumerate(bricks, 1):
        text += [",".join(map(str, (number, *brick[:15]))) + ",", ",".join(map(str, brick[15:]))]
    for name, members in sets.items():
        text += [f"*NSET,NSET={name}", *map(str, members)]
    text += ["*MATERIAL,NAME=STEM", "*ELASTIC", f"{E},{NU}", "*PLASTIC", f"{YIELD},0.", f"{1.0001 * YIELD},1."]
    text += ["*SOLID SECTION,ELSET=ALL,MATERIAL=STEM", "*BOUNDARY", "MIDDLE,1,1", "PLANE,2,2", "SUPPORT,3,3"]
    text += ["*STEP,INC=400", "*STATIC", ".02,1.,1e-5,.04", "*BOUNDARY", f"PUSHED,3,3,{-travel}"]
    return "\n".join([*text, "*NODE PRINT,NSET=PUSHED,TOTALS=ONLY", "RF", "*END STEP", ""])


def _halved(stations: np.ndarray) -> np.ndarray:
    """Return stations with their middles."""
    found = np.empty(2 * len(stations) - 1)
    found[::2], found[1::2] = stations, 0.5 * (stations[1:] + stations[:-1])
    return found
