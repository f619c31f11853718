"""A stem cut through by toughness: what mesh and method move, and what blade and material do.

python benchmarks/toughness.py sizes        elements of d/12, d/16, d/24; supports 4 and 20 mm apart; a thin blade
python benchmarks/toughness.py speeds       50 to 400 mm/min
python benchmarks/toughness.py toughness    twice the toughness, and how much of the difference is found in the work
python benchmarks/toughness.py blades       edge angle and radius, one at a time
python benchmarks/toughness.py diameters    6 to 12 mm
python benchmarks/toughness.py wedge        a wedge that splits a beam, against beam theory

Without a name all are run. The stem is 8 mm thick with a bore of 0.41 of it, E 1000, yield stress 15, strength 15 MPa,
toughness 2 kJ/m², no rate law; the blade is the paper's, the supports are 4 mm apart, the speed is 400 mm/min,
elements are d/12.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import pairwise
from math import log, radians, tan

import numpy as np

from stemcal.cutting import (
    Blade,
    CuttingResult,
    Discretisation,
    Loading,
    ShearTest,
    Stem,
    Supports,
    Toughness,
    build,
    shear,
)
from stemcal.fem.cohesive import Cohesion
from stemcal.fem.contact import Contact, Tool
from stemcal.fem.kernels.nodes import COHESION, EDGE
from stemcal.fem.material import Hourglass, Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import start
from stemcal.fem.stepper import simulate
from stemcal.fem.warm import warm

THIN = Blade(thickness=0.6, edge_radius=0.005)


def a_cut(
    parts: float = 12.0, diameter: float = 8.0, clearance: float = 4.0, speed: float = 400.0, toughness: float = 2.0,
    blade: Blade | None = None,
) -> ShearTest:  # fmt: skip
    """Return a test: elements to the diameter, mm, mm, mm/min, kJ/m²; the paper's blade by default."""
    stroke, v = 1.05 * diameter, speed / 60.0
    how = Discretisation(
        element_size=diameter / parts,
        edge_over="nodes",
        coarsening=6.0,
        coarsening_around=2.0,
        hourglass=Hourglass("stiffness", 0.01),
        integration=Integration(
            1.0e4, outputs=400, time_step=40.0e-6 * 16.0 / parts * diameter / 8.0, precision="mixed"
        ),
        filter_window=0.02 * stroke / v,
    )
    return ShearTest(
        Material(1.1e-9, 1000.0, 0.3, 15.0, 0.5, 0.05),
        Stem(diameter),
        blade or Blade(),
        Supports(clearance),
        Loading(v, stroke / v),
        Contact(0.15, 0.10),
        how,
        Toughness(15.0, toughness),
    )


def section(test: ShearTest) -> float:
    """Return the area of the meshed section, mm²."""
    return 2.0 * float(start(build(test)).cut.whole.sum())


def begun(result: CuttingResult) -> float:
    """Return the mean force over the first three tenths of the diameter, N."""
    assert result.shape is not None
    travel, diameter = result.history.travel, 2.0 * result.shape.reference[:, 2].max()
    return float(result.history.force[(travel > 0.0) & (travel < 0.3 * diameter)].mean())


def parting(result: CuttingResult) -> float:
    """Return the work of cohesion and edge, mJ."""
    return float(result.history.cohesion[-1] + result.history.contact_edge[-1])


def told(name: str, test: ShearTest) -> CuttingResult:
    """Run a test and print what it gives."""
    result = shear(test)
    assert test.failure is not None
    found = 100.0 * parting(result) / (test.failure.toughness * section(test))
    print(
        f"{name}: mean {begun(result):.1f} N at first, peak {result.peak_force:.1f} N at {result.peak_travel:.2f} mm, "
        f"work {result.work_of_cutting:.1f} mJ, {result.cut_area_percent:.1f} % cut by "
        f"{result.break_travel or np.nan:.2f} mm, parting {found:.1f} % of toughness times area, "
        f"drift {result.energy_drift_percent:.2f} %, kinetic {result.kinetic_ratio_percent:.1f} %, "
        f"{result.elements} elements, {result.wall_seconds:.0f} s",
        flush=True,
    )
    return result


def sizes() -> None:
    """Print the cut over the element size."""
    for parts in (12.0, 16.0, 24.0):
        told(f"d/{parts:g}", a_cut(parts))
    for parts in (12.0, 16.0):
        told(f"d/{parts:g}, supports 20 mm apart", a_cut(parts, clearance=20.0))
    for parts in (12.0, 16.0):
        told(f"d/{parts:g}, blade of 0.6 mm, radius 0.005 mm", a_cut(parts, blade=THIN))


def speeds() -> None:
    """Print the cut over the speed."""
    for speed in (50.0, 100.0, 200.0, 400.0):
        told(f"{speed:g} mm/min", a_cut(speed=speed))


def toughness() -> None:
    """Print the cut with twice the toughness."""
    tests = [a_cut(toughness=g) for g in (1.0, 2.0, 4.0)]
    results = [told(f"{test.failure.toughness:g} kJ/m²", test) for test in tests if test.failure]
    for (less, more), g in zip(pairwise(results), (1.0, 2.0), strict=True):
        found = 100.0 * (parting(more) - parting(less)) / (g * section(tests[0]))
        print(f"{g:g} kJ/m² more: {found:.1f} % of it found in the work that parts", flush=True)


def blades() -> None:
    """Print the cut over edge angle and radius."""
    for angle in (15.0, 25.0, 37.5, 60.0):
        told(f"{angle:g}°", a_cut(blade=Blade(edge_angle=angle)))
    for radius in (0.02, 0.1, 0.5):
        told(f"radius {radius:g} mm", a_cut(blade=Blade(edge_radius=radius)))


def diameters() -> None:
    """Print the cut over the diameter, and the power with which it grows."""
    results = {d: told(f"{d:g} mm", a_cut(diameter=d, clearance=0.5 * d)) for d in (6.0, 8.0, 12.0)}
    least, most = results[6.0], results[12.0]
    work = log((most.work_of_cutting or 0.0) / (least.work_of_cutting or 1.0)) / log(2.0)
    print(f"force grows as d^{log(begun(most) / begun(least)) / log(2.0):.2f}, work as d^{work:.2f}")


def wedge() -> None:
    """Print the force on a wedge that splits a beam of arms 3 mm high over beam theory without the arms' turning.

    G = P²a²/bEI and δ = P a³/3EI = L tan β for a wedge L deep; F = 2 P tan(β + ρ), friction tan ρ.
    """
    modulus, height, length, g = 1000.0, 3.0, 45.0, 0.5
    bending = modulus * height**3 / 12.0
    for angle, friction in ((10.0, 0.0), (20.0, 0.0), (20.0, 0.2), (40.0, 0.0), (40.0, 0.2)):
        half, deep = radians(0.5 * angle), 1.0 / tan(radians(0.5 * angle))
        mesh = brick((height, 1.0, length), (2, 1, 90))
        mesh = mesh.moved(mesh.nodes - [0.0, 0.0, length])
        held = np.zeros(mesh.nodes.shape, dtype=bool)
        held[:, 1] = True
        held[mesh.nodes[:, 2] < -length + 1e-9] = True
        outline = Blade(thickness=100.0, width=1000.0, edge_angle=angle, edge_radius=0.0).outline()
        tool = Tool(outline, 0.0, 0.0, -0.5 * deep, edge=0.0, parts=True)
        model = Model(mesh, Material(1e-9, modulus, 0.0), (tool,), Contact(friction, friction), "full", held=held,
                      integration=Integration(1.0e4, outputs=300), cohesion=Cohesion(20.0, g))  # fmt: skip
        history = simulate(model, 2.0)
        late = history.height[:, 0] < -0.5 * deep
        opening = -history.height[late, 0] * tan(half)
        across = (g * bending) ** 0.75 / (3.0 * bending) ** 0.5 / opening**0.5
        expected = 2.0 * across * tan(half + np.arctan(friction))
        ratio = 2.0 * history.force[late, 0, 2].mean() / expected.mean()
        shared = history.held[-1, COHESION, 0] / history.held[-1, [EDGE, COHESION], 0].sum()
        print(
            f"{angle:g}°, friction {friction:g}: {ratio:.3f} of beam theory, {100 * shared:.0f} % by tension",
            flush=True,
        )


TABLES: dict[str, Callable[[], None]] = {
    "sizes": sizes,
    "speeds": speeds,
    "toughness": toughness,
    "blades": blades,
    "diameters": diameters,
    "wedge": wedge,
}

if __name__ == "__main__":
    warm(precision="mixed")
    for table in sys.argv[1:] or TABLES:
        TABLES[table]()
