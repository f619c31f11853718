"""Contact with rigid tools: rebound and momentum, sliding, the Taylor bar."""

from __future__ import annotations

from math import atan2, cos, exp, pi, sin, sqrt

import numpy as np
from test_rebound_and_friction import BLOCK, GRAVITY, MASS, SOFT, STEP, TABLE, fall, momentum, slide
from test_taylor_bar import LENGTH, RADIUS, SPEED, impact, quarter_rod, shape

from stemcal.fem.material import Material
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import History
from stemcal.fem.tools import Contact, Tool
from verification import figures
from verification.case import SINGLE, Case, Drawing, Topic

SLIDES = ((0.1, 100.0), (0.3, 100.0), (0.3, 200.0))
DECAYING = Contact(0.3, 0.1, 0.03)


def rebound() -> Topic:
    """Throw a block on a table, with and without damping; sum up the momentum."""
    speed = -100.0
    history = fall(Contact(penalty=SOFT, damping=0.0), speed=speed, time=4.8e-4)
    impulse = -float(np.sum(history.force[:, 0, 2] * np.diff(history.time, prepend=0.0)))
    touching = np.flatnonzero(history.force[:, 0, 2] < 0.0)
    duration = history.time[touching[-1]] - history.time[touching[0] - 1]
    cases = [
        Case("impulse over 2Mv", impulse / (2.0 * MASS * abs(speed)), 1.0, 0.005, "momentum"),
        Case("kinetic energy, after over before", history.kinetic[-1] / history.kinetic[0], 1.0, 0.01, "energy"),
        Case("duration of contact", 1e3 * duration, 1e3 * pi * STEP / sqrt(SOFT / 2.0), 0.02, "π √(M/K)", "ms"),
    ]
    for zeta in (0.1, 0.3, 0.5):
        history = fall(Contact(penalty=SOFT, damping=zeta), time=5e-4)
        found = sqrt(history.kinetic[-1] / history.kinetic[0])
        cases.append(Case(f"rebound with damping {zeta:g}", found, restitution(zeta), 0.01, "damped oscillator"))
    text = "remaining momentum, spinning block between two tools"
    cases.append(Case(text, momentum_error(), 0.0, SINGLE, "Newton's third law", relative=False))
    text = (
        "A block falls onto a rigid table. The contact is so compliant that the block is effectively rigid. Without "
        "damping, the falling block must rebound at its impact speed. With damping, the rebound speed must equal that "
        "of a damped oscillator that transmits no tension. In the case with two tools, a spinning elastic-plastic "
        "block is in frictional contact with a table and a moving wedge. The momentum lost by the spinning block must "
        "equal the impulse on the table and the wedge."
    )
    return Topic("Rebound and momentum", text, tuple(cases))


def restitution(damping: float) -> float:
    """Return the speed after over before of a mass 2m on a spring and damper that cannot pull, damping c = 2ζ√(km)."""
    zeta = damping / sqrt(2.0)
    root = sqrt(1.0 - zeta**2)
    angle = atan2(2.0 * zeta * root, 2.0 * zeta**2 - 1.0)
    return exp(-zeta / root * angle) * abs(cos(angle) - zeta / root * sin(angle))


def momentum_error() -> float:
    """Return the part of the change of momentum that is no impulse on a tool, over the momentum."""
    mesh = BLOCK.moved(BLOCK.nodes - np.array([2.0, 2.0, -0.01]))
    velocity = np.array([300.0, 200.0, -500.0]) + np.cross([100.0, -50.0, 80.0], mesh.nodes - mesh.nodes.mean(axis=0))
    wedge = Tool(((0.0, 0.05), (1.0, 3.0), (-1.0, 3.0)), 0.05, height=1.02, speed=-200.0, edge=0.0)
    model = Model(mesh, Material(1e-9, 1000.0, 0.3, 5.0, 10.0), tools=(TABLE, wedge), contact=Contact(0.3, 0.2, 0.01),
                  velocity=velocity, integration=Integration(safety=0.5))  # fmt: skip
    before, after, impulse = momentum(model, 5e-4)
    return float(np.abs(before - after - impulse).max() / np.abs(before).max())


def sliding() -> Topic:
    """Let a block slide to rest; pull it below and above the limit; let friction fall with speed."""
    cases, thrown = [], {}
    for mu, speed in SLIDES:
        history = slide(Contact(mu, mu), speed, 0.0, 1.5 * speed / (mu * GRAVITY))
        thrown[mu, speed] = history.time, speeds(history), np.maximum(speed - mu * GRAVITY * history.time, 0.0)
        case = Case(f"stopping distance, μ = {mu:g}, {speed:g} mm/s", moved(history), speed**2 / (2.0 * mu * GRAVITY),
                    0.01, "v²/(2μg)", "mm")  # fmt: skip
        cases.append(case)
        taken = history.contact[-1] / history.kinetic[0]
        cases.append(Case(f"energy dissipated by friction, μ = {mu:g}, {speed:g} mm/s", taken, 1.0, 0.02, "energy"))
    give = 20.0 * 2.0 * GRAVITY * STEP**2 / 0.2
    stuck = moved(slide(Contact(0.3, 0.3), 0.0, 0.9 * 0.3, 0.02))
    cases.append(Case("pulled by 0.9 μMg: displacement", stuck, 0.0, give, "Coulomb", "mm", relative=False))
    slipped = moved(slide(Contact(0.3, 0.3), 0.0, 1.1 * 0.3, 0.02))
    cases.append(
        Case("pulled by 1.1 μMg: displacement", slipped, 0.5 * 0.03 * GRAVITY * 0.02**2, 0.05, "½ · 0.1 μg t²", "mm")
    )
    speed, friction, law = decaying()
    for low, high in ((10.0, 40.0), (60.0, 90.0), (120.0, 180.0)):
        there = (speed > low) & (speed < high)
        case = Case(f"μ between {low:g} and {high:g} mm/s", friction[there].mean(), law[there].mean(), 0.02,
                    "μd + (μs − μd) exp(−DC·v)")  # fmt: skip
        cases.append(case)
    text = (
        "A block that slides on a table with initial speed v and friction coefficient μ must stop after a distance of "
        "v²/(2μg). A block that is pulled with a force below the friction limit must move only by the elastic "
        "deflection of its contact. If the pulling force exceeds the friction limit, the block must accelerate. If the "
        "static coefficient of friction exceeds the dynamic coefficient, the friction force must increase as the block "
        "slows down."
    )
    drawing = figures.sliding(thrown, (speed, friction, law))
    caption = (
        "Speed of a sliding block versus time, and friction force versus speed: computed values (points) and exact "
        "values (lines)."
    )
    return Topic("Sliding block", text, tuple(cases), (Drawing("sliding", drawing, caption),))


def speeds(history: History) -> np.ndarray:
    """Return the speed of the block from its kinetic energy, mm/s."""
    return np.sqrt(2.0 * np.maximum(history.kinetic, 0.0) / MASS)


def moved(history: History) -> float:
    """Return how far the block has come along x, mm."""
    return float(history.x[:, 0].mean() - (BLOCK.nodes[:, 0].mean() - 2.0))


def decaying() -> tuple[np.ndarray, ...]:
    """Return speed, friction over weight and the law's μ while a block thrown at 200 mm/s slows down."""
    history = slide(DECAYING, 200.0, 0.0, 0.2)
    speed = speeds(history)
    middle = 0.5 * (speed[1:] + speed[:-1])
    friction = history.force[1:, 0, 0] / (MASS * GRAVITY)
    return middle, friction, 0.1 + 0.2 * np.exp(-0.03 * middle)


def taylor() -> Topic:
    """Let a copper rod hit a wall, on two meshes."""
    cases, profiles = [], {}
    for across, along, foot_off, strain_off in ((4, 48, 0.15, 0.25), (6, 72, 0.1, 0.65)):
        history = impact(across, along)
        length, foot, strain = shape(history)
        label = f"{along} elements along"
        cases += [
            Case(f"{label}: length", length, 21.5, 0.1, "other codes: 21.4 to 21.6", "mm", relative=False),
            Case(f"{label}: radius of the foot", foot, 7.1, foot_off, "other codes: 7.0 to 7.2", "mm", relative=False),
            Case(
                f"{label}: largest plastic strain", strain, 2.75, strain_off, "other codes: 2.5 to 3.0", relative=False
            ),
            Case(f"{label}: energy drift", history.drift_percent(), 0.0, 0.2, "energy", "%", relative=False),
        ]
        profiles[label] = profile(history, across, along)
    text = (
        f"A copper rod with a length of {LENGTH:g} mm and a radius of {RADIUS:g} mm hits a rigid wall at "
        f"{1e-3 * SPEED:g} m/s (Wilkins and Guinan 1973). The shape of the rod 80 µs after the impact is compared with "
        "published results. The copper has E = 117 GPa, ν = 0.35, σy = 400 MPa, Et = 100 MPa and ρ = 8930 kg/m³. The "
        "Taylor bar has no closed-form solution. The reference values for the Taylor bar are the means of results "
        "published for other explicit codes (Hallquist, *DYNA3D User's Manual*; Zhu and Cescotto 1995). The tolerances "
        "for the Taylor bar are half the range of the published results, with two exceptions. On the coarser mesh, the "
        "tolerance for the foot radius of the Taylor bar exceeds half the published range by 0.05 mm. The maximum "
        "plastic strain in the Taylor bar occurs in a single element and increases with mesh refinement. On the finer "
        "mesh, the tolerance for the maximum plastic strain therefore exceeds half the published range by 0.4."
    )
    caption = (
        "Maximum radius of each cross-section of the Taylor bar after 80 µs for both meshes, and initial radius "
        "(dashed)."
    )
    drawing = Drawing("taylor", figures.taylor(profiles, LENGTH, RADIUS), caption)
    return Topic("Taylor bar", text, tuple(cases), (drawing,))


def profile(history: History, across: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """Return height and largest radius of every layer of the rod's outer nodes."""
    first = quarter_rod(across, along).nodes
    rim = np.hypot(first[:, 0], first[:, 1]) > RADIUS - 1e-6
    layers = history.x[rim].reshape(along + 1, -1, 3)
    return layers[:, :, 2].mean(axis=1), np.hypot(layers[:, :, 0], layers[:, :, 1]).max(axis=1)
