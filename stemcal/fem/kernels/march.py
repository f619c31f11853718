"""The time loop: central differences from one output to the next.

One step reads: add internal forces, erode, look for contact, add contact forces, kick and drift, move the tools.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.fem.kernels.compile import kernel
from stemcal.fem.kernels.contact import push_faces_out, push_nodes_out
from stemcal.fem.kernels.element import add_internal_forces
from stemcal.fem.kernels.full import add_full_internal_forces
from stemcal.fem.kernels.nodes import kick_and_drift, mirror_ghosts
from stemcal.fem.kernels.search import erode, list_faces_under_edge, list_near_nodes
from stemcal.fem.kernels.timestep import stable_step

Floats = Any
Array = NDArray[np.float64]

# How many steps a time step may serve before it is worked out again.
STEP_LIFE = 20

# Why a march ended.
REACHED = 0
INVERTED = 1
COLLAPSED = 2
NOT_FINITE = 3


class Body(NamedTuple):
    """The deformable body as the kernels see it; `stemcal.fem.stepper.State` owns the arrays."""

    x: Array
    v: Array
    f: Array
    push: Array
    loads: Array
    mass: Array
    inverse_mass: Array
    free: Array
    driven: Array
    blocks: NDArray[np.int32]
    state: Array
    scratch: Array
    element_mass: Array
    ghosts: NDArray[np.int32]  # (G, 2) massless nodes and the nodes they mirror in x = 0
    points: Array  # (E, 8, rows) of fully integrated elements, empty for one-point ones


class Clock(NamedTuple):
    """Time and what goes with it, each an array of one so that the march can change it."""

    time: Array
    step: Array  # current Δt
    step_before: Array
    steps: NDArray[np.int64]
    reach: Array  # how far things may have moved since the candidates were listed
    trouble: NDArray[np.int64]  # element where the march broke off, −1 none


class Ledger(NamedTuple):
    """Sums that one output interval adds to."""

    impulse: Array  # (T, 3) of the stem on each tool
    contact_work: Array  # (1,) of the contact forces on the nodes
    tool_work: Array  # (1,) of the moving tools
    external_work: Array  # (1,) of tools, loads and driven nodes
    lost_kinetic: Array  # (1,) carried away by nodes without elements


class Settings(NamedTuple):
    """Numbers that steer the march."""

    safety: float
    smallest_step: float
    penalty_step: float
    margin: float
    p_wave_modulus: float


@kernel
def march(
    until: float,
    body: Floats,
    topology: Floats,
    tools: Floats,
    edge: Floats,
    candidates: Floats,
    clock: Floats,
    ledger: Floats,
    material: Floats,
    friction: Floats,
    settings: Floats,
) -> int:
    """Advance the model to time `until`; returns why it stopped."""
    while clock.time[0] < until:
        if clock.steps[0] % STEP_LIFE == 0:
            stable, element, volume = stable_step(
                topology.hexes,
                body.x,
                body.state,
                body.element_mass,
                settings.p_wave_modulus,
                material.hourglass_memory,
            )
            clock.trouble[0] = element
            if not volume > 0.0:
                return INVERTED
            clock.step[0] = settings.safety * stable
            if not clock.step[0] > settings.smallest_step:
                return COLLAPSED
        dt = clock.step[0]
        kick = 0.5 * (clock.step_before[0] + dt)

        if body.points.shape[0] > 0:
            add_full_internal_forces(
                topology.hexes, body.points, body.x, body.v, body.state, body.f, clock.step_before[0], material
            )
        else:
            add_internal_forces(
                body.scratch, body.blocks, body.x, body.v, body.state, body.f, clock.step_before[0], material
            )
        eroded, lost = erode(topology, body.state, body.v, body.mass, body.inverse_mass)
        ledger.lost_kinetic[0] += lost
        if eroded > 0 or clock.reach[0] > settings.margin:
            list_near_nodes(candidates, topology, tools, body.x, settings.margin)
            if edge.tool >= 0:
                list_faces_under_edge(candidates, topology, tools, edge, body.x, body.element_mass, settings.margin)
            clock.reach[0] = 0.0
        tools.force[:, :] = 0.0
        push_nodes_out(
            tools,
            candidates.nodes,
            candidates.node_counts,
            body.x,
            body.v,
            body.mass,
            body.push,
            settings.penalty_step,
            dt,
            friction,
        )
        if edge.tool >= 0:
            push_faces_out(
                tools,
                edge,
                candidates.faces,
                candidates.corner_mass,
                candidates.face_count[0],
                body.x,
                body.v,
                body.mass,
                body.push,
                settings.penalty_step,
                dt,
                friction,
            )
        work, external, fastest = kick_and_drift(
            body.x, body.v, body.f, body.push, body.loads, body.inverse_mass, body.free, body.driven, kick, dt
        )
        mirror_ghosts(body.x, body.v, body.ghosts)
        if not np.isfinite(fastest):
            return NOT_FINITE

        ledger.contact_work[0] += work
        ledger.external_work[0] += external
        tool_speed = 0.0
        for t in range(tools.speed.shape[0]):
            for i in range(3):
                ledger.impulse[t, i] += kick * tools.force[t, i]
            pushed = -kick * tools.force[t, 2] * tools.speed[t]
            ledger.tool_work[0] += pushed
            ledger.external_work[0] += pushed
            tools.height[t] += dt * tools.speed[t]
            tool_speed = max(tool_speed, abs(tools.speed[t]))
        clock.reach[0] += dt * (fastest + tool_speed)
        clock.time[0] += dt
        clock.step_before[0] = dt
        clock.steps[0] += 1
    return REACHED
