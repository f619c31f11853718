"""Elastic bodies: wave in a bar, cantilever, hollow cylinder, convergence."""

from __future__ import annotations

from functools import cache
from math import pi, sqrt

import numpy as np
import test_wave
from driven import NO_VISCOSITY
from test_beams import RHO, E, cantilever, polygon_ring, swing
from test_convergence import axial_frequency, lame_mode_error
from test_wave import STRESS_BEHIND, V, bar

from stemcal.cutting.build import stem_mesh
from stemcal.cutting.parts import Discretisation, Stem
from stemcal.fem.material import Material
from stemcal.fem.model import Model
from verification import figures
from verification.case import Case, Drawing, Topic

bent = cache(cantilever)


def wave() -> Topic:
    """Send a step of stress along a bar and watch it come back from a free and a fixed end."""
    source = "Graff 1975, ch. 2"
    cases = []
    for scaling in (1.0, 1e4):
        label = f"mass scaling {scaling:g}"
        times, stress, _ = bar("free", 1.0, scaling)
        first, last = (np.interp(0.5 * STRESS_BEHIND, -stress[:200, e], times[:200]) for e in (20, 80))
        behind = stress[np.searchsorted(times, 0.9), 20:40].mean()
        cases.append(Case(f"{label}: speed over √(E/ρ)", 0.6 / (last - first), 1.0, 0.01, source))
        cases.append(Case(f"{label}: stress behind the front, −ρcv", behind, -STRESS_BEHIND, 0.005, source, "MPa"))
    _, stress, velocity = after_reflection("free")
    cases.append(Case("free end: velocity over v", velocity / V, 2.0, 0.02, source))
    cases.append(Case("free end: stress over ρcv", stress / STRESS_BEHIND, 0.0, 0.02, source, relative=False))
    _, stress, velocity = after_reflection("fixed")
    cases.append(Case("fixed end: stress over ρcv", stress / STRESS_BEHIND, -2.0, 0.02, source))
    cases.append(Case("fixed end: velocity over v", velocity / V, 0.0, 0.02, source, relative=False))
    text = (
        f"One end of a bar of {test_wave.LENGTH} cubic elements with ν = 0 is pushed at constant speed v. Behind "
        "the wave front, the compressive stress in the bar is ρcv, where ρ is the density and c is the wave speed. "
        "Reflection at a free end cancels the stress and doubles the particle velocity. Reflection at a fixed end "
        "doubles the stress and stops the bar. Bulk viscosity spreads the wave front over a few elements. With mass "
        "scaling, the wave speed is divided by the square root of the scaling factor."
    )
    caption = (
        "Stress along the bar before and after the wave front reaches the far end: "
        "computed stress and exact stress (dashed)."
    )
    drawing = Drawing("wave", figures.wave({end: bar(end) for end in ("free", "fixed")}, STRESS_BEHIND), caption)
    return Topic("Wave in a bar", text, tuple(cases), (drawing,))


def after_reflection(end: str) -> tuple[float, float, float]:
    """Return time over L/c, mean stress and mean velocity where the front has passed on its way back."""
    times, stress, velocity = bar(end)
    now = int(np.searchsorted(times, 1.6))
    return float(times[now]), float(stress[now, 60:80].mean()), float(velocity[now, 60:80].mean())


def beams() -> Topic:
    """Bend a cantilever under a load at its tip, and let it swing."""
    cases = []
    deflection, frequency = bent(8)
    text = "8 elements high: deflection over theory"
    cases.append(Case(text, deflection, 1.0, 0.012, "FL³/3EI + FL/κGA, Timoshenko 1921"))
    cases.append(Case("8 elements high: first frequency over theory", frequency, 1.0, 0.0072, "Huang 1961"))
    text = "1 element high, c = 0.548: deflection over theory"
    cases.append(Case(text, bent(1, 1.0 / 6.0 / 0.304)[0], 1.0, 0.01, "FL³/3EI + FL/κGA, Timoshenko 1921"))
    text = (
        "A cantilever of length 40 mm and height 4 mm under a suddenly applied load oscillates about its static "
        "equilibrium position. The mean of the oscillation is the static deflection of the cantilever. The first "
        "natural frequency is computed from the period of the oscillation. With an hourglass coefficient of 0.548, a "
        "mesh with only one cubic element through the height of the cantilever reproduces the deflection from beam "
        "theory. The other cantilever cases use an hourglass coefficient of 0.15."
    )
    return Topic("Cantilever", text, tuple(cases))


def cylinder() -> Topic:
    """Bend the stem itself between two supports."""
    found, exact = three_points()
    source = "FL³/48EI + FL/4κGA, κ of Cowper 1966"
    case = Case("deflection at mid-span", 1e3 * found, 1e3 * exact, 0.01, source, "µm")
    text = (
        "A stem with a diameter of 8 mm and a diameter ratio of 0.41 is bent over a span of 48 mm. The simulation uses "
        "a quarter model with an element size of 1 mm. The load and the supports of the hollow cylinder act on whole "
        "cross-sections. Shear deformation contributes one tenth of the deflection at mid-span."
    )
    return Topic("Hollow cylinder in three-point bending", text, (case,))


def three_points() -> tuple[float, float]:
    """Return the deflection of the stem under 0.01 N, computed and after Timoshenko with Cowper's κ, mm."""
    nu, ratio, span, force = 0.3, 0.41, 48.0, 1e-2
    mesh = stem_mesh(Stem(8.0, ratio, span), Discretisation(edge_over="nodes"))
    x, y, z = mesh.nodes.T
    middle = np.abs(x) < 1e-9
    held = np.stack([middle, np.abs(y) < 1e-9, x > 0.5 * span - 1e-9], axis=1)
    section = np.bincount(mesh.hexes.ravel(), np.repeat(mesh.volumes(), 8), minlength=len(x)) * middle
    share = section / section.sum()
    loads = np.stack([0.0 * x, 0.0 * x, -0.25 * force * share], axis=1)
    sides = 2 * len(np.unique(np.round(np.arctan2(z, y), 9))) - 2
    area, inertia = polygon_ring(4.0, 4.0 * ratio, sides)
    m = (1.0 + ratio**2) ** 2
    kappa = 6.0 * (1.0 + nu) * m / ((7.0 + 6.0 * nu) * m + (20.0 + 12.0 * nu) * ratio**2)
    shear = kappa * E / (2.0 * (1.0 + nu)) * area
    period = 2.0 * pi / ((pi / span) ** 2 * sqrt(E * inertia / (RHO * area))) * 1.08
    model = Model(mesh, Material(RHO, E, nu), held=held, loads=loads, viscosity=NO_VISCOSITY,
                  hourglass=0.1)  # fmt: skip
    deflection, _ = swing(model, period, share)
    return -deflection, force * (span**3 / (48.0 * E * inertia) + span / (4.0 * shear))


def convergence() -> Topic:
    """Measure how the error of smooth problems falls with the element size."""
    curves, cases = {}, []
    name = "plate's Lamé mode"
    curves[name] = (counts := np.array([8, 16, 32])), np.array([lame_mode_error(int(n)) for n in counts])
    cases.append(_rate(name, curves[name], 0.2, "Graff 1975, sec. 8.1.5"))
    case = Case(f"{name}: error with 32 elements", curves[name][1][-1], 0.0, 0.005, "Graff 1975, sec. 8.1.5",
                relative=False)  # fmt: skip
    cases.append(case)
    name = "bar's frequency"
    curves[name] = (counts := np.array([4, 8, 16])), np.array([1.0 - axial_frequency(int(n)) for n in counts])
    cases.append(_rate(name, curves[name], 0.1, "Hughes 1987, sec. 9.1"))
    text = f"{name}: error with 16 elements"
    cases.append(Case(text, curves[name][1][-1], (pi / 64.0) ** 2 / 6.0, 0.05, "Hughes 1987, sec. 9.1"))
    name = "cantilever's deflection"
    curves[name] = (heights := np.array([2, 4, 8])), np.array([abs(bent(int(n))[0] - 1.0) for n in heights])
    cases.append(_rate(name, curves[name], 0.25, "Timoshenko 1921"))
    text = (
        "For problems with smooth exact solutions, the error must be proportional to the square of the element size. "
        "The rate of convergence is computed from the errors on the two finest meshes."
    )
    caption = "Relative error versus the number of elements per side; the grey line has a slope of −2."
    drawing = Drawing("convergence", figures.convergence(curves), caption)
    return Topic("Convergence under refinement", text, tuple(cases), (drawing,))


def _rate(name: str, curve: tuple[np.ndarray, np.ndarray], tolerance: float, source: str) -> Case:
    counts, errors = curve
    rate = np.log(errors[-2] / errors[-1]) / np.log(counts[-1] / counts[-2])
    return Case(f"{name}: rate of convergence", float(rate), 2.0, tolerance, source, relative=False)
