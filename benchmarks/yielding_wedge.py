"""A wedge that splits a beam whose arms yield: theory with a clamped root and with one that turns, a beam, the model.

python benchmarks/yielding_wedge.py [ELEMENTS THROUGH AN ARM]

The beam knows nothing of the solver: one arm by Timoshenko's theory with fibres that yield, opened at its end step by
step, on a foundation as stiff as makes the root of an elastic arm turn as if it were 0.673 of its height longer, and
in series with it the cohesive law. Forces are means over the second half of the opening, over those of elastic arms.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from math import radians, sqrt, tan

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded
from verification import ROOT

from tests.verification.test_cohesive import ARM, LONG, TOUGHNESS, YIELDING, split_yielding, yielding_wedge_force

Array = NDArray[np.float64]

assert ROOT
PIECES, FIBRES, STEPS = 600, 40, 300
FAR = 1e12  # N/mm, holds what is prescribed
TURNING = 0.673


@dataclass
class Arm:
    """One arm of unit width and what it has gone through: plastic strain of its fibres, opening of its half plane."""

    modulus: float
    strength: float
    cohesive: float
    plastic: Array
    widest: Array

    @property
    def shearing(self) -> float:
        """κ G A with ν = 0, N."""
        return 5.0 / 6.0 * 0.5 * self.modulus * ARM

    @property
    def foundation(self) -> float:
        """k, MPa, for which a root turns by (M/EI) √(2 √(EI/k) + EI/κGA) = (M/EI) D."""
        bending = self.modulus * ARM**3 / 12.0
        return bending / (0.5 * ((TURNING * ARM) ** 2 - bending / self.shearing)) ** 2

    def stress(self, curvature: Array) -> Array:
        """Return the stress of the fibres (pieces, FIBRES), MPa."""
        return np.clip(self.modulus * (-HEIGHTS * curvature[:, None] - self.plastic), -self.strength, self.strength)

    def held(self, apart: Array) -> tuple[Array, Array, Array]:
        """Return what foundation and plane pull back with, its slope (MPa) and how far the half plane is open (mm).

        Open by w it bears σ = σ_c (1 − w/w_c), where less than ever before σ back in proportion; v = w + σ/k.
        """
        k, critical = self.foundation, TOUGHNESS / self.cohesive
        ever = np.minimum(self.widest, critical)
        onwards = (k * apart - self.cohesive) / (k - self.cohesive / critical)
        further, back = onwards > ever, self.cohesive * (1.0 - ever / critical) / np.maximum(ever, 1e-30)
        opened = np.where(further, onwards, np.maximum(apart, 0.0) * k / (k + back))
        slope = np.where(further, -self.cohesive / critical * k / (k - self.cohesive / critical), back * k / (k + back))
        opened, slope = np.where(apart <= 0.0, 0.0, opened), np.where(apart <= 0.0, k, slope)
        parted = (apart > 0.0) & (opened >= critical)
        opened, slope = np.where(parted, apart, opened), np.where(parted, 0.0, slope)
        return k * (apart - opened), slope, opened


PIECE = LONG / PIECES
HEIGHTS = ((np.arange(FIBRES) + 0.5) / FIBRES - 0.5)[None, :] * ARM
FIBRE = ARM / FIBRES
OF_CURVATURE, OF_SHEAR = np.array([0.0, -1.0, 0.0, 1.0]) / PIECE, np.array([-1.0 / PIECE, -0.5, 1.0 / PIECE, -0.5])
TRIBUTARY = np.full(PIECES + 1, PIECE)
TRIBUTARY[[0, -1]] *= 0.5


def beam_force(modulus: float, strength: float, cohesive: float, widest: float) -> Array:
    """Return P across the end of the arm at every step of the opening (STEPS,), N."""
    arm = Arm(modulus, strength, cohesive, np.zeros((PIECES, FIBRES)), np.zeros(PIECES + 1))
    u, forces = np.zeros(2 * (PIECES + 1)), []
    for end in np.linspace(0.0, widest, STEPS + 1)[1:]:
        for _ in range(60):
            correction = newton(arm, u, end)
            u += correction
            if np.abs(correction).max() < 1e-9:
                break
        curvature, shear = strains(u)
        arm.plastic = -HEIGHTS * curvature[:, None] - arm.stress(curvature) / modulus
        arm.widest = np.maximum(arm.widest, arm.held(u[0::2])[2])
        forces.append(-arm.shearing * shear[0])
    return np.array(forces)


def strains(u: Array) -> tuple[Array, Array]:
    """Return curvature and shear of the pieces from deflections and turns of the nodes, one after the other."""
    v, turn = u[0::2], u[1::2]
    return np.diff(turn) / PIECE, np.diff(v) / PIECE - 0.5 * (turn[1:] + turn[:-1])


def newton(arm: Arm, u: Array, end: float) -> Array:
    """Return the correction that balances the arm, its end moved to `end` and its other end clamped."""
    curvature, shear = strains(u)
    stress = arm.stress(curvature)
    elastic = np.where(np.abs(stress) < arm.strength, 1.0, 1e-4)  # so that the last fibre leaves some stiffness
    bending = arm.modulus * (elastic * HEIGHTS**2).sum(axis=1) * FIBRE
    moment = -(stress * HEIGHTS).sum(axis=1) * FIBRE
    pull, slope, _ = arm.held(u[0::2])
    out, matrix, first = np.zeros_like(u), np.zeros((7, len(u))), 2 * np.arange(PIECES)
    for i in range(4):
        np.add.at(out, first + i, PIECE * (OF_CURVATURE[i] * moment + OF_SHEAR[i] * arm.shearing * shear))
        for j in range(4):
            stiffness = OF_CURVATURE[i] * bending * OF_CURVATURE[j] + OF_SHEAR[i] * arm.shearing * OF_SHEAR[j]
            np.add.at(matrix[3 + i - j], first + j, PIECE * stiffness)
    out[0::2] += pull * TRIBUTARY
    matrix[3, 0::2] += slope * TRIBUTARY
    out[[0, -2, -1]] = FAR * (u[[0, -2, -1]] - [end, 0.0, 0.0])
    matrix[3, [0, -2, -1]] += FAR
    return np.asarray(solve_banded((3, 3), matrix, -out))


def clamped(modulus: float, strength: float, opening: Array) -> Array:
    """Return P with a clamped root: the moment there and the length of the crack follow from G alone."""
    stiffness, moment = modulus * ARM**3 / 12.0, strength * ARM**2 / 6.0
    left = 1.5 - 0.5 * TOUGHNESS * stiffness / moment**2
    root = 0.5 * (3.0 - left**2) * moment
    return np.asarray(root / np.sqrt(2.0 * opening / (moment / left / stiffness - root / (3.0 * stiffness))))


def main() -> None:
    through = int(sys.argv[1]) if len(sys.argv) > 1 else 4
    half = radians(10.0)
    for modulus, strength, cohesive, widest, _ in YIELDING:
        opening = np.linspace(0.5, 1.0, 101) * widest
        stiffness = modulus * ARM**3 / 12.0
        elastic = ((TOUGHNESS * stiffness) ** 0.75 / sqrt(3.0 * stiffness) / np.sqrt(opening)).mean()
        turning = yielding_wedge_force(opening, half, modulus, strength).mean() / (2.0 * tan(half))
        beam = beam_force(modulus, strength, cohesive, widest)[STEPS // 2 :].mean()
        history, late = split_yielding(modulus, strength, cohesive, widest, through)
        model = history.force[late, 0, 2].mean() / tan(half)
        print(
            f"E {modulus:g}, yield stress {strength:g}, strength {cohesive:g} MPa, open to {widest:g} mm: clamped "
            f"{clamped(modulus, strength, opening).mean() / elastic:.3f}, turning {turning / elastic:.3f}, beam "
            f"{beam / elastic:.3f}, model {model / elastic:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
