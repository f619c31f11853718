"""One heap with Yade: grains settle in a slab, its right side is taken away, the angle of repose is measured.

Called in a folder that holds ``heap.json``: ``yade -n -x heap.py``. Writes ``out.json`` with ``angle`` (deg), the
``grains`` left on the floor and ``unbalanced``, the mean resultant force on a grain over the mean contact force. In SI.
"""

# ruff: noqa: F821 - Yade gives its scripts what it knows: O, facet, sphere, wall, materials and laws

import json
import math
import random
from pathlib import Path

WIDTH, DEPTH = 0.12, 0.04  # of the box, m; its front and back have no friction
RADIUS, SPREAD = 0.005, 0.1  # m; radii are uniform between RADIUS·(1 ± SPREAD)
GRAINS, DENSITY = 420, 1200.0  # kg/m³
YOUNG, POISSON, DAMPING = 5e6, 0.3, 0.2  # Pa; share of the force that opposes motion
FILLING, LONGEST, OFTEN = 0.4, 2.0, 0.1  # s: settling in the box, after the opening, between looks
AT_REST = 0.01  # unbalanced force

given = json.loads(Path("heap.json").read_text(encoding="utf-8"))
chance = random.Random(int(given["seed"]))


def material(label: str, friction: float, rolling: float) -> int:
    """Return the number of a material; of two in contact the smaller friction counts, as Yade has it."""
    return O.materials.append(
        CohFrictMat(
            young=YOUNG,
            poisson=POISSON,
            density=DENSITY,
            frictionAngle=math.atan(friction),
            etaRoll=rolling,
            momentRotationLaw=True,
            isCohesive=False,
            alphaKr=2.0,
            alphaKtw=0.0,
            label=label,
        )
    )


def surface(columns: int = 48, rows: int = 12) -> list[tuple[float, float]]:
    """Return x and the height of the heap seen from above at x, the mean over the depth of the slab."""
    grains = [(*body.state.pos, body.shape.radius) for body in O.bodies if isinstance(body.shape, Sphere)]
    found = []
    for i in range(columns):
        x, heights = (i + 0.5) * WIDTH / columns, []
        near = [grain for grain in grains if abs(grain[0] - x) < grain[3] and grain[2] > 0.0]
        for j in range(rows):
            y = (j + 0.5) * DEPTH / rows
            under = [(gz, r * r - (gx - x) ** 2 - (gy - y) ** 2) for gx, gy, gz, r in near]
            heights.append(max([0.0, *(gz + math.sqrt(rest) for gz, rest in under if rest > 0.0)]))
        found.append((x, sum(heights) / rows))
    return found


grain = material("grain", given["grain_friction"], given["grain_rolling"])
floor = material("floor", given["wall_friction"], given["grain_rolling"])
glass = material("glass", 0.0, 0.0)
room = 2.0 * RADIUS * (1.0 + SPREAD) * 1.02
across, deep = int(WIDTH / room), int(DEPTH / room)
for number in range(GRAINS):
    layer, place = divmod(number, across * deep)
    i, j = divmod(place, deep)
    radius = RADIUS * chance.uniform(1.0 - SPREAD, 1.0 + SPREAD)
    free = [0.5 * side - RADIUS * (1.0 + SPREAD) for side in (WIDTH / across, DEPTH / deep)]
    x = (i + 0.5) * WIDTH / across + chance.uniform(-1.0, 1.0) * free[0]
    y = (j + 0.5) * DEPTH / deep + chance.uniform(-1.0, 1.0) * free[1]
    O.bodies.append(sphere((x, y, (layer + 0.5) * room), radius, material=grain))
a, b, c, d = (-0.01, -0.01, 0.0), (WIDTH, -0.01, 0.0), (WIDTH, DEPTH + 0.01, 0.0), (-0.01, DEPTH + 0.01, 0.0)
O.bodies.append([facet((a, b, c), material=floor), facet((a, c, d), material=floor)])
O.bodies.append([wall(0.0, 0, material=floor), wall(0.0, 1, material=glass), wall(DEPTH, 1, material=glass)])
gate = O.bodies.append(wall(WIDTH, 0, material=floor))

O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom6D(), Ig2_Facet_Sphere_ScGeom6D(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_CohFrictMat_CohFrictMat_CohFrictPhys()],
        [
            Law2_ScGeom6D_CohFrictPhys_CohesionMoment(always_use_moment_law=True, useIncrementalForm=True),
            Law2_ScGeom_FrictPhys_CundallStrack(),
        ],
    ),
    NewtonIntegrator(damping=DAMPING, gravity=(0.0, 0.0, -9.81)),
]
O.dt = 0.3 * PWaveTimeStep()
O.run(round(FILLING / O.dt), wait=True)
O.bodies.erase(gate)
for _ in range(round(LONGEST / OFTEN)):
    O.run(round(OFTEN / O.dt), wait=True)
    for body in [body for body in O.bodies if isinstance(body.shape, Sphere) and body.state.pos[2] < -0.03]:
        O.bodies.erase(body.id)
    if unbalancedForce() < AT_REST:
        break

flank = [(WIDTH - x, z) for x, z in surface()]
slope = sum(x * z for x, z in flank) / sum(x * x for x, _ in flank)
left = sum(isinstance(body.shape, Sphere) for body in O.bodies)
result = {"angle": math.degrees(math.atan(slope)), "grains": left, "unbalanced": unbalancedForce()}
Path("out.json").write_text(json.dumps(result), encoding="utf-8")
