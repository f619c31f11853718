"""Rigid-plastic limit loads of what a blade does: a bar is sheared off, a wedge cuts into a half-space.

Both in plane strain, with k = σ_y/√3, without hardening and friction, slowly.
"""

from math import cos, inf, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import History, simulate
from stemcal.fem.tools import Contact, Tool

YIELD = 2.0
K = YIELD / sqrt(3.0)


def plane(mesh: Mesh, wall: float = inf) -> NDArray[np.bool_]:
    """Return what is held: y everywhere, x on the plane x = 0 and on a wall."""
    x = mesh.nodes[:, 0]
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 0], held[:, 1] = (np.abs(x) < 1e-9) | (x > wall - 1e-9), True
    return held


def box(left: float, right: float, low: float, high: float, height: float, speed: float = 0.0) -> Tool:
    """Return a block with edges rounded by 0.05 mm."""
    r = 0.05
    corners = ((left + r, low + r), (right - r, low + r), (right - r, high - r), (left + r, high - r))
    return Tool(corners, r, height=height, speed=speed)


def guillotine(h: float, held_down: bool) -> float:
    """Return the force on a wide blade over 2 A k: a bar 4 mm high, gaps of 0.5 mm, from 0.15 to 0.6 mm of travel."""
    high, half, gap, speed = 4.0, 4.0, 0.5, 50.0
    length = half + gap + 6.0
    mesh = brick((length, 1.0, high), (round(length / h), 1, round(high / h)))
    blade = box(-half, half, 0.0, 6.0, high + 0.001, -speed)
    below = box(half + gap, length + 5.0, -6.0, 0.0, 0.0)
    above = (box(half + gap, length + 5.0, 0.0, 6.0, high),) if held_down else ()
    material = Material(1e-9, 2000.0, 0.3, YIELD, 0.0)
    how = Integration(outputs=60)
    model = Model(mesh, material, (blade, below, *above), Contact(), held=plane(mesh), integration=how)
    history = simulate(model, 0.6 / speed)
    assert history.drift_percent() < 0.1 and history.kinetic[-1] < 0.01 * history.external[-1]
    late = speed * history.time > 0.15
    return float(2.0 * history.force[late, 0, 2].mean() / (2.0 * high * K))


@pytest.mark.parametrize("h", [0.5, pytest.param(0.25, marks=pytest.mark.slow)])
def test_a_guillotine_shears_two_sections(h: float) -> None:
    """F = 2 A k where hold-downs carry the couple of blade and supports.

    Without them the bar has to carry it by bending: supports and blade press on at most (2 + π) k, so on widths of
    A k/(5.14 k), and the lever between them uses up about 40 % of the bending strength at midspan: the force is less.
    """
    clamped, free = guillotine(h, held_down=True), guillotine(h, held_down=False)
    assert clamped == pytest.approx(1.0, abs=0.05)
    assert 0.83 < free < clamped - 0.05


def hill(half_angle: float) -> float:
    """Return the slope of force over depth, over k and width, of a smooth wedge (radians) that cuts a half-space.

    cos(2β − ψ) = cos ψ/(1 + sin ψ), contact length l = c/(cos β − sin(β − ψ)), pressure 2 k (1 + ψ) on two flanks
    (R. Hill, *The Mathematical Theory of Plasticity*, 1950, chapter VIII.2).
    """
    fan = float(brentq(lambda psi: cos(2.0 * half_angle - psi) - cos(psi) / (1.0 + sin(psi)), 0.0, 0.5 * pi))
    return 4.0 * (1.0 + fan) * sin(half_angle) / (cos(half_angle) - sin(half_angle - fan))


def indented(half_angle: float, h: float = 0.25, depth: float = 1.2, speed: float = 150.0) -> History:
    """Return the history of a sharp wedge (radians) that parts a block, half of it, at a hardly plastic strain."""
    wide, high = 8.0, 5.0
    mesh = brick((wide, h, high), (round(wide / h), 1, round(high / h)))
    mesh = mesh.moved(mesh.nodes - np.array([0.0, 0.0, high]))
    held = plane(mesh, wide)
    held[:, 2] = mesh.nodes[:, 2] < -high + 1e-9
    side = 12.0
    top = side / tan(half_angle)
    corners = ((0.0, 0.0), (side, top), (side, top + 10.0), (-side, top + 10.0), (-side, top))
    tool = Tool(corners, 0.0, height=0.001, edge=0.0, spread=0.3, parts=True, speed=-speed)
    material = Material(1e-9, 2000.0, 0.3, YIELD, 0.0, failure_strain=0.02, internal_length=0.2)
    how = Integration(outputs=100)
    return simulate(Model(mesh, material, (tool,), Contact(), held=held, integration=how), depth / speed)


@pytest.mark.slow
@pytest.mark.parametrize("angle", [30.0, 45.0, 60.0])
def test_a_wedge_cuts_into_a_half_space(angle: float) -> None:
    """Force over depth is Hill's within 8 %: the surface under his flanks is new, as where nodes part at the edge."""
    history = indented(radians(angle))
    depth = 150.0 * history.time
    late = depth > 0.7
    force = 2.0 * history.force[late, 0, 2] / (K * 0.25)
    assert force.sum() / (hill(radians(angle)) * depth[late]).sum() == pytest.approx(1.0, abs=0.08)
    assert history.parted[-1] > 0 and history.deleted[-1] == 0 and history.drift_percent() < 0.1
