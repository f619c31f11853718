"""A plate of known toughness, split by a thin, sharp, smooth wedge: a plastic layer between two elastic arms.

Inside the layer the mean strain does not look beyond it, so all of it fails at ε_f, in whatever mode: tearing it takes
2 t σ_y ε_f per area, and a wedge that splits the plate steadily takes that as its force per thickness (A. G. Atkins,
*The Science and Engineering of Cutting*, 2009, chapter 3), with two more terms of the arms, H high, that it opens by Δ.
"""

from dataclasses import dataclass
from math import radians, sqrt, tan

import numpy as np
import pytest
from numpy.typing import NDArray

from stemcal.fem.material import Layers, Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.state import State
from stemcal.fem.stepper import simulate
from stemcal.fem.tools import Contact, Tool

E, NU, DENSITY = 1e5, 0.3, 1e-6
YIELD, FAILURE = 20.0, 0.1
LAYER, ARM, WIDE, LONG, NOTCH = 0.2, 1.0, 0.2, 62.0, 18.0  # mm; the layer's half, an arm with it, the plate
THICK, ANGLE, SPEED, TRAVEL = 4.0, 16.0, 1000.0, 38.0
TOUGHNESS = 2.0 * LAYER * YIELD * FAILURE  # N/mm


@dataclass(frozen=True)
class Split:
    """Force and hourglass energy of a steady split, over toughness, thickness and advance; strain behind the front."""

    force: float
    hourglass: float
    strain: float
    drift: float


def half_plate(h: float) -> Mesh:
    """Return the half x > 0 of a plate below z = 0: one element through the layer, elements of h along the plane."""
    arm = max(3, round(0.5 * (ARM - LAYER) / h))
    wider = np.linspace(1.0, 3.0, arm)
    across = np.concatenate([[0.0, LAYER], LAYER + (ARM - LAYER) * np.cumsum(wider) / wider.sum()])
    mesh = brick((arm + 1.0, WIDE, LONG), (arm + 1, 1, round(LONG / h)))
    nodes = mesh.nodes - [0.0, 0.0, LONG]
    nodes[:, 0] = across[np.round(nodes[:, 0]).astype(int)]
    return mesh.moved(nodes)


def split(h: float, length: float) -> Split:
    """Return what a wedge meets that splits a plate with elements of h (mm) and an internal length (mm)."""
    mesh = half_plate(h)
    x, centres = mesh.nodes, mesh.nodes[mesh.hexes].mean(axis=1)
    held = np.abs(x) < 1e-9
    held[:, 2] = x[:, 2] < -LONG + 1e-9
    rise = 0.5 * THICK / tan(radians(0.5 * ANGLE))
    side, top = 0.5 * THICK, rise + LONG
    wedge = Tool(((0.0, 0.0), (side, rise), (side, top), (-side, top), (-side, rise)), 0.0, height=0.01, edge=0.0,
                 spread=0.2, parts=True, speed=-SPEED)  # fmt: skip
    laws = [Material(DENSITY, E, NU, strength, 0.0, failure_strain=FAILURE, internal_length=length)
            for strength in (YIELD, np.inf)]  # fmt: skip
    layer = (centres[:, 0] < LAYER) & (centres[:, 2] < -NOTCH)
    model = Model(mesh, Layers(tuple(laws), (~layer).astype(int)), (wedge,), Contact(), hourglass=0.001, held=held,
                  integration=Integration(outputs=600))  # fmt: skip
    fronts: list[float] = []

    def look(time: float, state: State) -> None:
        cut = state.spread.cut
        if time == 0.0:
            free = cut.nodes[x[cut.nodes, 2] > -NOTCH - 1e-6]
            cut.parted[cut.number[free]] = True
            state.body.free[free, 0] = True
        fronts.append(float(x[cut.nodes[cut.parted], 2].min()))

    history = simulate(model, TRAVEL / SPEED, inspect=look)
    late = slice(360, None)
    area = TOUGHNESS * WIDE * float(fronts[late.start] - fronts[-1])

    def over_area(energy: NDArray[np.float64]) -> float:
        return 2.0 * float(energy[-1] - energy[late.start]) / area

    behind = layer & (centres[:, 2] > fronts[-1] + h) & (centres[:, 2] < fronts[-1] + 2.0)
    strain = float(history.row("PLASTIC_STRAIN")[behind].mean()) / FAILURE
    return Split(over_area(history.external), over_area(history.hourglass), strain, history.drift_percent())


def steady() -> float:
    """Return the force of a steady split less hourglass energy, over the toughness: 1 + (2 t σ_y ε_b + ρ H (V θ)²)/G.

    Bent by M = √(G E I), the face of an arm is strained by ε_b = M H/2EI, there and back. Beyond the wedge the arms
    move apart at Vθ with θ = 3Δ/4c, c⁴ = 3 E H³ Δ²/16 G.
    """
    bent = 0.5 * ARM * sqrt(TOUGHNESS / (E * ARM**3 / 12.0))
    bending = 2.0 * LAYER * YIELD * bent
    lead = (3.0 * E * ARM**3 * THICK**2 / (16.0 * TOUGHNESS)) ** 0.25
    swing = DENSITY * ARM * (SPEED * 0.75 * THICK / lead) ** 2
    return 1.0 + (bending + swing) / TOUGHNESS


@pytest.mark.slow
@pytest.mark.parametrize(("h", "within"), [(0.2, 0.10), (0.1, 0.06)])
def test_a_thin_wedge_splits_a_plate_of_known_toughness(h: float, within: float) -> None:
    """The force less the hourglass energy that stays in the layer is `steady`: within 5 % with h = t/2.

    Found: 1.153 and 1.118 for 1.067 (h = t, t/2); with an internal length of 1 mm, that of the plastic zone, 1.39: the
    mean strain then includes material far ahead of the front, and the strain behind it grows to 1.35 ε_f. The front
    lies between nodes, so the layer is strained more by h over the length of the plastic zone, about 1 mm.
    """
    found = split(h, 0.1)
    assert found.drift < 0.01
    assert 1.0 < found.strain < 1.0 + within
    assert found.force - found.hourglass == pytest.approx(steady(), rel=within - 0.01)
