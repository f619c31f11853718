"""Ways to put a body through a known motion and to look at it on the way, over the compiled kernels."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.block import STRESS
from stemcal.fem.kernels.element import add_internal_forces
from stemcal.fem.kernels.march import REACHED
from stemcal.fem.kernels.nodes import copy_for_elements
from stemcal.fem.material import BulkViscosity
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.model import Model
from stemcal.fem.state import State, start
from stemcal.fem.stepper import _Marching

Array = NDArray[np.float64]

NO_VISCOSITY = BulkViscosity(0.0, 0.0)


def distorted(counts: tuple[int, int, int], by: float, seed: int = 0) -> Mesh:
    """Return a brick of unit elements whose nodes are all moved at random by up to `by` in each direction."""
    mesh = brick(tuple(float(n) for n in counts), counts)
    return mesh.moved(mesh.nodes + np.random.default_rng(seed).uniform(-by, by, mesh.nodes.shape))


def advance(state: State, x: Array, dt: float = 1.0e-3) -> Array:
    """Move every node straight to x (N, 3) in one step; returns the forces of the elements on the nodes."""
    body = state.body
    body.v[:] = (x - body.x) / dt
    body.x[:] = x
    body.f[:] = 0.0
    copy_for_elements(body)
    add_internal_forces(body.scratch, body.runs, body.targets, body.seen, body.state, body.f, dt, state.material)
    return body.f[: len(x)].copy()


def stresses(state: State) -> Array:
    """Return the stress (xx, yy, zz, xy, yz, zx) of every integration point."""
    return row(state, slice(STRESS, STRESS + 6))


def row(state: State, which: int | slice) -> Array:
    """Return one or more rows of the elements' state, elements first, in the order of the mesh."""
    return state.lanes.gathered(state.body.state[:, which])


def boundary(mesh: Mesh) -> NDArray[np.bool_]:
    """Return which nodes belong to fewer than eight elements."""
    return np.bincount(mesh.hexes.ravel(), minlength=len(mesh.nodes)) < 8


def stretched(model: Model, log_strains: Iterable[Array], dt: float = 1.0e-3) -> tuple[State, Array]:
    """Take a body through homogeneous principal stretches exp(ε₁), exp(ε₂), exp(ε₃) along x, y, z.

    Returns the state at the end and the stress of the first integration point after every step (n, 6).
    """
    state = start(model)
    seen = []
    for strain in log_strains:
        advance(state, model.mesh.nodes * np.exp(strain), dt)
        seen.append(stresses(state)[0])
    return state, np.array(seen)


def record(model: Model, times: Array, look: Callable[[State], object]) -> tuple[Array, Array]:
    """March a model and look at it at (the first step past) each time; returns the times reached and what was seen."""
    state = start(model)
    reached, seen = [], []
    for until in times:
        assert _Marching(state, 1)(float(until), state) == REACHED
        reached.append(float(state.clock.time[0]))
        seen.append(look(state))
    return np.array(reached), np.array(seen)
