"""A shear-soft and a layered tube in bending: the embedded solver, and CalculiX on the same mesh.

A quarter of a tube of 8 mm with a diameter ratio of 0.41 is moved down at the sides of its middle section and held at
the sides over the supports, so that no contact enters. CalculiX has the same nodes, and elements with incompatible
modes (C3D8I), which bend as they should.
"""

from __future__ import annotations

import subprocess
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from stemcal.cutting.build import materials, stem_mesh
from stemcal.cutting.constraints import mirrors
from stemcal.cutting.parts import Discretisation, Stem
from stemcal.fem.material import Layers, Material, Transverse
from stemcal.fem.mesh import Mesh
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.laboratory.three_point_bending import ThreePointBending, shear_coefficient

RATIO, DIAMETER, DENSITY = 0.41, 8.0, 1.1e-9
HEMP = Material(DENSITY, 1743.5, 0.3, transverse=Transverse(88.0, 31.99, 0.4))
PITH, SKIN = Material(DENSITY, 500.0, 0.3), Material(DENSITY, 3000.0, 0.3)
FIBROUS_SKIN = Material(DENSITY, 3000.0, 0.3, transverse=Transverse(300.0, 150.0, 0.35))
STEMS = {
    "hemp": (HEMP, (), ()),
    "pith and skin of 0.5 mm": (PITH, (SKIN,), (0.5,)),
    "pith and fibrous skin of 0.5 mm": (PITH, (FIBROUS_SKIN,), (0.5,)),
}


def stiffnesses(name: str, span: float, calculix: bool = True, size: float = DIAMETER / 16.0) -> tuple[float, float]:
    """Return force over travel of the middle, N/mm, of the embedded solver and of CalculiX (0 without it)."""
    inner, outer, thicknesses = STEMS[name]
    stem = Stem(DIAMETER, RATIO, 1.2 * span, thicknesses)
    how = Discretisation(size, symmetry="quarter", edge_over="nodes", coarsening=3.0)
    mesh = stem_mesh(stem, how, rests_at=0.5 * span)
    law = materials(mesh, stem, inner, outer)
    sides = np.abs(mesh.nodes[:, 2]) < 0.126 * DIAMETER
    pushed = sides & (mesh.nodes[:, 0] < 1e-9)
    rests = sides & (np.abs(mesh.nodes[:, 0] - 0.5 * span) < 1e-9)
    own = _embedded(mesh, law, (inner, *outer), span, pushed, rests)
    return own, _calculix(mesh, law, pushed, rests) if calculix else 0.0


def _embedded(
    mesh: Mesh,
    law: Material | Layers,
    laws: tuple[Material, ...],
    span: float,
    pushed: NDArray[np.bool_],
    rests: NDArray[np.bool_],
) -> float:
    travel = 1e-3 * span
    held = mirrors(mesh, "quarter")
    held[pushed | rests, 2] = True
    speed = np.where(pushed, -travel, 0.0)
    velocity = np.zeros_like(mesh.nodes)
    x, half = np.minimum(mesh.nodes[:, 0], 0.5 * span) / (0.5 * span), 0.5 * span
    velocity[:, 2] = -travel * (1.0 - 1.5 * x**2 + 0.5 * x**3 - 1.5 * np.maximum(mesh.nodes[:, 0] / half - 1.0, 0.0))
    velocity[held[:, 2], 2] = speed[held[:, 2]]
    kind, stem = ThreePointBending(span), Stem(DIAMETER, RATIO)
    slowest = kind.slowest_period(stem, np.sqrt(min(kind.modulus(stem, one) for one in laws) / DENSITY))
    scaling = (1.0 / (16.0 * slowest)) ** 2
    model = Model(mesh, law, held=held, velocity=velocity, settling=0.2, hourglass=0.03,
                  integration=Integration(mass_scaling=scaling, outputs=400))  # fmt: skip
    history = simulate(model, 1.0)
    late = history.time > 0.4
    work = np.polyfit((travel * history.time[late]) ** 2, history.external[late], 1)[0]
    return float(4.0 * 2.0 * work)


def _calculix(mesh: Mesh, law: Material | Layers, pushed: NDArray[np.bool_], rests: NDArray[np.bool_]) -> float:
    layers = law if isinstance(law, Layers) else Layers((law,), np.zeros(len(mesh.hexes), dtype=int))
    sets = {
        "PUSHED": pushed,
        "RESTS": rests,
        "MIDDLE": np.abs(mesh.nodes[:, 0]) < 1e-9,
        "PLANE": np.abs(mesh.nodes[:, 1]) < 1e-9,
    }
    text = ["*NODE", *(f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in enumerate(mesh.nodes, 1))]
    for i, one in enumerate(layers.materials):
        text.append(f"*ELEMENT,TYPE=C3D8I,ELSET=LAYER{i}")
        text += [",".join(map(str, (e + 1, *(mesh.hexes[e] + 1)))) for e in np.flatnonzero(layers.of == i)]
        text += [f"*MATERIAL,NAME=M{i}", *_elastic(one), f"*SOLID SECTION,ELSET=LAYER{i},MATERIAL=M{i}"]
    for name, members in sets.items():
        text += [f"*NSET,NSET={name}", *map(str, np.flatnonzero(members) + 1)]
    text += ["*STEP", "*STATIC", "*BOUNDARY", "MIDDLE,1,1", "PLANE,2,2", "RESTS,3,3", "PUSHED,3,3,-1."]
    text += ["*NODE PRINT,NSET=PUSHED,TOTALS=ONLY", "RF", "*END STEP"]
    with TemporaryDirectory() as folder:
        Path(folder, "bent.inp").write_text("\n".join(text) + "\n", encoding="utf-8")
        subprocess.run(["ccx", "bent"], cwd=folder, capture_output=True, check=True)
        printed = Path(folder, "bent.dat").read_text(encoding="utf-8").splitlines()
    last = max(i for i, line in enumerate(printed) if "total force" in line)
    return 4.0 * abs(float(printed[last + 2].split()[2]))


def _elastic(law: Material) -> list[str]:
    """Return the card of the elastic law with the axis along x."""
    if (t := law.transverse) is None:
        return ["*ELASTIC", f"{law.elastic_modulus},{law.poisson_ratio}"]
    plane = t.elastic_modulus / (2.0 * (1.0 + t.poisson_ratio))
    moduli = (law.elastic_modulus, t.elastic_modulus, t.elastic_modulus)
    ratios = (law.poisson_ratio, law.poisson_ratio, t.poisson_ratio)
    first = ",".join(f"{value:.12g}" for value in (*moduli, *ratios, t.shear_modulus, t.shear_modulus))
    return ["*ELASTIC,TYPE=ENGINEERING CONSTANTS", first, f"{plane:.12g}"]


def timoshenko(law: Material, span: float) -> float:
    """Return 1/(L^3/48EI + L/4kGA) of the tube, N/mm."""
    area, inertia = pi * 16.0 * (1.0 - RATIO**2), 0.25 * pi * 256.0 * (1.0 - RATIO**4)
    G = law.transverse.shear_modulus if law.transverse else law.shear_modulus
    return 1.0 / (span**3 / (48.0 * law.elastic_modulus * inertia) + span / (4.0 * shear_coefficient(RATIO) * G * area))
