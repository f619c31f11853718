"""A notched plate is pulled apart: with an internal length it fails at the same pull whatever its elements."""

from functools import cache

import numpy as np
import pytest

from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate

LONG, WIDE, THICK, NOTCH = 12.0, 4.0, 1.0, 1.0


def plate(h: float) -> Mesh:
    """Return a plate with a notch 1 mm deep and 1 mm wide from its lower edge."""
    whole = brick((LONG, WIDE, THICK), (round(LONG / h), round(WIDE / h), 2))
    centres = whole.nodes[whole.hexes].mean(axis=1)
    cut = (np.abs(centres[:, 0] - 0.5 * LONG) < 0.5 * NOTCH) & (centres[:, 1] < NOTCH)
    kept, renumbered = np.unique(whole.hexes[~cut], return_inverse=True)
    return Mesh(whole.nodes[kept], renumbered.reshape(-1, 8).astype(np.int32))


@cache
def work_to_failure(h: float, length: float) -> float:
    """Return the work done by the time the first element fails, mJ."""
    mesh = plate(h)
    ends = (mesh.nodes[:, 0] < 1e-9) | (mesh.nodes[:, 0] > LONG - 1e-9)
    velocity = np.zeros(mesh.nodes.shape)
    velocity[:, 0] = np.where(ends, np.sign(mesh.nodes[:, 0] - 0.5 * LONG), 0.0)
    material = Material(1e-9, 1000.0, 0.3, 15.0, 20.0, 1.0, failure_strain=0.1, internal_length=length)
    held = np.stack([ends, np.zeros_like(ends), np.zeros_like(ends)], axis=1)
    how = Integration(mass_scaling=1.0e5, outputs=200)
    history = simulate(Model(mesh, material, held=held, velocity=velocity, integration=how), 0.6)
    assert history.deleted[-1] > 0
    return float(history.external[int(np.argmax(history.deleted > 0)) - 1])


@pytest.mark.slow
def test_work_to_failure_is_the_materials_not_the_meshs() -> None:
    """Halving the elements at the notch's corner costs a local criterion a good part of the work, this one little."""
    assert work_to_failure(0.25, 1.0) == pytest.approx(work_to_failure(0.5, 1.0), rel=0.06)
    assert work_to_failure(0.25, 0.0) < 0.85 * work_to_failure(0.5, 0.0)
