"""Bending of a bonded stalk: write its grains and bonds, let LAMMPS push its tip, measure stiffness and strength.

Called in a folder that holds ``stalk.in``: ``python3 stalk.py BOND_STRENGTH``, the strength in MPa. Writes ``out.json``
with ``stiffness``, the force on the tip over its first deflection (N/mm), and ``break_force``, the force at which the
stress in a bond reaches its strength (N). Bonds break where the bending moment is largest, in the clamp:

    σ = F·x/W,   W = π·d³/32,   x the distance of the tip from the clamp along the stalk as it lay.

Lengths are in mm.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

LENGTH, DIAMETER = 200.0, 8.0
PIECES = 20  # bonds along the stalk: the deflection of a cantilever is off by 1/(2·PIECES²), 0.1 %
STROKE, STEPS = 140.0, 28  # how far the tip is pushed, in how many steps
AT_REST = 1e-5  # N, what is left of the forces

Row = tuple[float, float, float]  # deflection, force, distance of the tip from the clamp


def write_stalk(path: Path) -> None:
    """Write grains (type 2 in the clamp, 3 at the tip), the bonds between neighbours and the angles between bonds."""
    spacing = LENGTH / PIECES
    kinds = [2, 2, *[1] * (PIECES - 1), 3]
    grains = [f"{i} 1 {kind} {(i - 2) * spacing:.9g} 0 0" for i, kind in enumerate(kinds, 1)]
    bonds = [f"{i} 1 {i} {i + 1}" for i in range(1, len(kinds))]
    angles = [f"{i} {2 if i == 1 else 1} {i} {i + 1} {i + 2}" for i in range(1, len(kinds) - 1)]
    far = LENGTH + 2.0 * spacing
    head = (
        f"stalk\n\n{len(grains)} atoms\n{len(bonds)} bonds\n{len(angles)} angles\n"
        f"3 atom types\n1 bond types\n2 angle types\n\n"
        f"{-far:g} {far:g} xlo xhi\n{-far:g} {far:g} ylo yhi\n{-far:g} {far:g} zlo zhi\n\nMasses\n\n1 1\n2 1\n3 1\n"
    )
    parts = [("Atoms", grains), ("Bonds", bonds), ("Angles", angles)]
    text = head + "".join(f"\n{title}\n\n" + "\n".join(rows) + "\n" for title, rows in parts)
    path.write_text(text, encoding="ascii")


def push() -> list[Row]:
    """Run LAMMPS on ``stalk.in``; return what it measured at each step."""
    spacing = LENGTH / PIECES
    values = {
        "diameter": DIAMETER,
        "spacing": spacing,
        "skin": 2.0 * spacing,
        "stroke": STROKE,
        "steps": STEPS,
        "rest": AT_REST,
    }
    if shutil.which("lmp") is None:
        sys.exit("lmp is not installed; on Debian and Ubuntu: apt-get install lammps")
    said = [part for name, value in values.items() for part in ("-var", name, f"{value:g}")]
    ended = subprocess.run(["lmp", "-in", "stalk.in", "-log", "stalk.log", "-screen", "none", *said], check=False)
    if ended.returncode:
        sys.exit(f"lmp ended with code {ended.returncode}")
    if "max iterations" in Path("stalk.log").read_text(encoding="utf-8", errors="replace"):
        sys.exit("the stalk did not come to rest")
    rows = [line.split() for line in Path("pushed.txt").read_text(encoding="ascii").splitlines()[1:]]
    return [(float(deflection), float(force), float(reach)) for deflection, force, reach in rows]


def break_force(rows: Sequence[Row], strength: float) -> float:
    """Return the force at which the bond in the clamp has the stress `strength`, between two steps in proportion.

    >>> round(break_force([(5.0, 1.0, 200.0), (10.0, 2.0, 200.0)], 1.5 * 200.0 * 32.0 / (math.pi * 8.0**3)), 9)
    1.5
    """
    modulus = math.pi * DIAMETER**3 / 32.0
    before = (0.0, 0.0)
    for _, force, reach in rows:
        stress = force * reach / modulus
        if stress >= strength:
            share = (strength - before[1]) / (stress - before[1])
            return before[0] + share * (force - before[0])
        before = (force, stress)
    sys.exit(f"no bond breaks until the tip has moved {STROKE:g} mm")


def main() -> None:
    """Bend one stalk."""
    write_stalk(Path("stalk.data"))
    rows = push()
    deflection, force, _ = rows[0]
    result = {"stiffness": force / deflection, "break_force": break_force(rows, float(sys.argv[1]))}
    Path("out.json").write_text(json.dumps(result), encoding="utf-8")


if __name__ == "__main__":
    main()
