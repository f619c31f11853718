"""The time loop: central differences from one output to the next.

A time step consists of failure and parting by the mean strain, internal forces, tools (erosion, contact search, contact
forces), kick by contact, kick and drift of all nodes, and the end of the step (energies, motion of the tools, clock).
Elements are marked as failed before the internal forces are added: erosion removes their contact in the same step, and
an internal force without this contact would accelerate their nodes.

Several threads can share a march: each adds the internal forces of its blocks and moves its nodes, the first does the
rest, and all threads synchronise (`meet`) where one needs the results of another.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Floats, Ints, Mask
from stemcal.fem.kernels.compile import entry, kernel
from stemcal.fem.kernels.contact import push_faces_out, push_nodes_out, push_skin_out
from stemcal.fem.kernels.element import add_internal_forces, follow_smooth_rates
from stemcal.fem.kernels.erosion import erode
from stemcal.fem.kernels.layers import of_blocks
from stemcal.fem.kernels.llvm import add_together, give_way, read_together
from stemcal.fem.kernels.nodes import (
    add_chunks,
    add_late_forces,
    clear_pushes,
    kick_and_drift,
    kick_by_pushes,
    kinetic_energy_within,
)
from stemcal.fem.kernels.nonlocal_mean import fail_by_mean_strain
from stemcal.fem.kernels.parting import close_plane, part, tie
from stemcal.fem.kernels.search import list_faces_under_edge, list_near_nodes, list_near_skin
from stemcal.fem.kernels.spread_edge import push_spread_edge, update_surface
from stemcal.fem.kernels.timestep import stable_step

# Number of steps after which the time step, the mean strains and the surface under a spread edge are computed again.
STEP_LIFE = 20
# The same number for the surface of a soft stem. Forces along a surface that lags behind the nodes do positive work on
# their vibrations. This surface is therefore computed for the middle of the interval, where the lag is zero on average.
SOFT_LIFE = 4
# Steps between updates of the rate factors from a smoothed strain rate; the smoothing time is many times longer.
_RATE_LIFE = 5

# Number of checks after which a waiting thread yields its core.
_PATIENCE = 1000

# Reasons for the end of a march; GOING_ON before the end.
GOING_ON = -1
REACHED = 0
INVERTED = 1
COLLAPSED = 2
NOT_FINITE = 3


class Body(NamedTuple):
    """The deformable body in the form that the kernels use; `stemcal.fem.state.State` owns the arrays."""

    x: Array  # (N, 3), with spare memory behind the last row, as v and f have (see `stemcal.fem.lanes.nodal`)
    v: Array
    seen: Any  # x and v in the form that elements read (`block.Seen`)
    f: Array  # internal forces in the precision of the elements; the last rows are separate ones for nodes `late`
    pushes: Any  # contact forces (`nodes.Pushes`)
    loads: Array  # (N, 3) constant nodal forces, or (0, 3) for none
    mass: Array
    inverse_mass: Array
    free: Mask  # (N, 3) components that are not held
    driven: Array  # (N, 3) velocities of held components, or (0, 3) if all of them are fixed
    runs: Ints  # (B, 8, runs of a block) first node of each run of corners
    targets: Ints  # (B, 8, runs of a block) first row of f for each run of corners
    late: Ints  # nodes of the separate rows of f: forces of a part of the mesh on nodes of earlier parts
    state: Array
    scratch: Array
    element_mass: Array


class Clock(NamedTuple):
    """Time and time steps; arrays of one number each, so that the march can change them."""

    time: Array
    step: Array  # current Δt
    step_before: Array  # Δt of the step before
    steps: NDArray[np.int64]  # number of steps
    reach: Array  # largest possible motion since the last contact search
    trouble: NDArray[np.int64]  # slot of the element that determines the time step, or that ended the march


class Ledger(NamedTuple):
    """Sums over all steps, and energies of the last step, mJ."""

    impulse: Array  # (T, 3) impulse of the stem on each tool, N s
    held: Array  # (S,) work of the tools that contact has stored or dissipated, by source (`nodes.Pushes`)
    external_work: Array  # (1,) work of tools, loads and driven nodes
    lost_kinetic: Array  # (1,) kinetic energy of nodes that have lost all their elements
    kinetic: Array  # (1,) kinetic energy in the last step
    node_sums: Array  # (chunks, 2) sums of the last step (`kick_and_drift`)


class Settings(NamedTuple):
    """Constants of the march."""

    safety: float  # share of the stable time step that is used
    smallest_step: float  # a shorter time step ends the march, s
    penalty_step: float  # Δt in the contact stiffness p m/Δt², s
    margin: float  # nodes and faces within this distance of a tool are listed, mm
    surface_life: int  # number of steps after which the surface under a spread edge is computed again


class Team(NamedTuple):
    """Shared data of the threads of a march; created by `stemcal.fem.stepper`."""

    threads: int
    arrived: NDArray[np.int64]  # (1,) number of waiting threads
    meetings: NDArray[np.int64]  # (1,) number of completed synchronisations
    failed: NDArray[np.int64]  # (threads,) number of elements that failed in this step
    outcome: NDArray[np.int64]  # (1,) reason for the end of the march, or GOING_ON


class Share(NamedTuple):
    """The blocks and nodes that one thread advances; the first thread also does the work that is not shared."""

    thread: int
    blocks: tuple[int, int]  # first block, and first block of the next thread
    chunks: tuple[int, int]  # the same for chunks of nodes
    scratch: Array
    late: Ints  # indices of the separate rows of f that this thread adds to their nodes, ascending


@kernel
def meet(team: Floats) -> None:
    """Wait until all threads have called this function (a barrier)."""
    if team.threads == 1:
        return
    before = read_together(team.meetings)
    if add_together(team.arrived, 1) == team.threads - 1:
        team.arrived[0] = 0
        add_together(team.meetings, 1)
    else:
        looks = 0
        while read_together(team.meetings) == before:
            looks += 1
            if looks % _PATIENCE == 0:  # there may be fewer cores than threads
                give_way()


@kernel
def renew_time_step(body: Floats, clock: Floats, material: Floats, settings: Floats) -> int:
    """Compute the time step every `STEP_LIFE` steps; return the reason to end the march, or GOING_ON."""
    if clock.steps[0] % STEP_LIFE != 0:
        return GOING_ON
    stable, clock.trouble[0], volume = stable_step(body, material)
    if not volume > 0.0:
        return INVERTED
    clock.step[0] = settings.safety * stable
    return GOING_ON if clock.step[0] > settings.smallest_step else COLLAPSED


@kernel
def fail_in_the_mean(body: Floats, topology: Floats, exchange: Floats, clock: Floats) -> bool:
    """Every `STEP_LIFE` steps, mark the elements that fail by their mean strain; return True if there are any."""
    if exchange.passes == 0 or clock.steps[0] % STEP_LIFE != 0:
        return False
    return fail_by_mean_strain(exchange, topology, body.state)


@kernel
def _add_forces_inside(share: Floats, body: Floats, clock: Floats, material: Floats) -> int:
    """Subtract the internal forces in the blocks of a share from `body.f`; return the number of failed elements."""
    dt, mine = clock.step_before[0], slice(share.blocks[0], share.blocks[1])
    own = of_blocks(material, share.blocks[0], share.blocks[1])
    if clock.steps[0] % _RATE_LIFE == 0:
        follow_smooth_rates(body.state[mine], own)
    runs, targets, state = body.runs[mine], body.targets[mine], body.state[mine]
    return add_internal_forces(share.scratch, runs, targets, body.seen, state, body.f, dt, own)


@kernel
def _look_for_contact(
    body: Floats, topology: Floats, tools: Floats, edge: Floats, spread: Floats, candidates: Floats, clock: Floats,
    settings: Floats,
) -> None:  # fmt: skip
    """Update the lists of nodes and faces that can touch a tool."""
    list_near_skin(candidates, topology, tools, body.x, settings.margin)
    list_near_nodes(candidates, topology, tools, spread.cut, body.x, settings.margin)
    tool = max(edge.tool, spread.tool)
    if tool >= 0:
        list_faces_under_edge(
            candidates, topology, tools, tool, body.x, body.element_mass, settings.margin, spread.cut.number
        )
    clock.reach[0] = 0.0


@kernel
def _mean_step(clock: Floats) -> float:
    """Return the mean of the last and the current time step: the time over which a force changes the velocities."""
    return 0.5 * (clock.step_before[0] + clock.step[0])


@kernel
def _add_contact_forces(
    body: Floats, tools: Floats, edge: Floats, spread: Floats, candidates: Floats, clock: Floats, friction: Floats,
    settings: Floats,
) -> None:  # fmt: skip
    """Add the forces of all kinds of contact between tools and body."""
    tools.force[:, :] = 0.0
    x, v, dt0, dt, cut = body.x, body.v, settings.penalty_step, clock.step[0], spread.cut
    push_nodes_out(
        tools, candidates.nodes, candidates.node_counts, x, v, body.mass, body.pushes, dt0, dt, friction, cut
    )
    if cut.tool >= 0:
        close_plane(cut, tools.edge[cut.tool], x, v, body.mass, body.pushes, dt0, friction)
    push_skin_out(tools, candidates.skin, candidates.skin_counts, x, v, body.pushes, dt0, dt, friction)
    faces, count = candidates.faces, candidates.face_count[0]
    if edge.tool >= 0:
        corner_mass = candidates.corner_mass
        push_faces_out(tools, edge, faces, corner_mass, count, x, v, body.pushes, dt0, dt, friction)
    if spread.tool >= 0:
        push_spread_edge(spread, tools, body, _mean_step(clock), dt, friction)


@kernel
def _move_tools(tools: Floats, ledger: Floats, kick: float, dt: float) -> float:
    """Move the tools by one step; add up the stem's impulse on them and their work; return their largest speed."""
    fastest = 0.0
    for t in range(tools.speed.shape[0]):
        for i in range(3):
            ledger.impulse[t, i] += kick * tools.force[t, i]
        ledger.external_work[0] -= kick * tools.force[t, 2] * tools.speed[t]
        ledger.external_work[0] -= kick * tools.force[t, 1] * tools.slide[t]
        tools.height[t] += dt * tools.speed[t]
        fastest = max(fastest, abs(tools.speed[t]))
    return fastest


@kernel
def meet_tools(
    failed: bool, body: Floats, topology: Floats, tools: Floats, edge: Floats, spread: Floats, candidates: Floats,
    clock: Floats, ledger: Floats, friction: Floats, settings: Floats,
) -> None:  # fmt: skip
    """Erode failed elements, repeat the contact search if necessary, and add the contact forces."""
    eroded, due = 0, clock.steps[0] % settings.surface_life == 0
    if failed:
        eroded, lost = erode(topology, body.state, body.v, body.mass, body.inverse_mass)
        ledger.lost_kinetic[0] += lost
    if eroded > 0 or clock.reach[0] > settings.margin:
        _look_for_contact(body, topology, tools, edge, spread, candidates, clock, settings)
        due = True
    if spread.tool >= 0 and due:
        ahead = 0.5 * (settings.surface_life - 1) * clock.step[0] if settings.surface_life < STEP_LIFE else 0.0
        update_surface(spread, candidates, body, ahead, tools.height[spread.tool])
    _add_contact_forces(body, tools, edge, spread, candidates, clock, friction, settings)


@kernel
def _kick_by_contact(until: float, body: Floats, tools: Floats, clock: Floats, ledger: Floats) -> None:
    """Change the velocities of nodes in contact by the contact forces.

    Before that, if the step reaches the time `until`, the kinetic energy is stored: only at this point are all forces
    known and all velocities still old, as `kinetic_energy_within` requires.
    """
    kick = _mean_step(clock)
    if clock.time[0] + clock.step[0] >= until:
        ledger.kinetic[0] = kinetic_energy_within(body, kick)
    kick_by_pushes(body, kick, tools, ledger.held)


@kernel
def finish_step(body: Floats, tools: Floats, clock: Floats, ledger: Floats) -> int:
    """Add up energies, and advance tools and clock; return the reason to end the march, or GOING_ON."""
    dt, kick = clock.step[0], _mean_step(clock)
    work, fastest = add_chunks(ledger.node_sums)
    clear_pushes(body, kick, tools, ledger.held)
    ledger.external_work[0] += work
    clock.reach[0] += dt * (fastest + _move_tools(tools, ledger, kick, dt))
    clock.time[0] += dt
    clock.step_before[0] = dt
    clock.steps[0] += 1
    return GOING_ON if np.isfinite(fastest) else NOT_FINITE


@entry
def march(
    until: float, share: Floats, team: Floats, body: Floats, topology: Floats, tools: Floats, edge: Floats,
    spread: Floats, candidates: Floats, exchange: Floats, clock: Floats, ledger: Floats, material: Floats,
    friction: Floats, settings: Floats,
) -> int:  # fmt: skip
    """Advance the model to time `until`; return the reason for the end. Each thread calls this with its share."""
    leads, outcome, apart = share.thread == 0, GOING_ON, False
    while True:
        if leads:
            if outcome == GOING_ON:
                outcome = renew_time_step(body, clock, material, settings) if clock.time[0] < until else REACHED
            if outcome == GOING_ON:
                apart = fail_in_the_mean(body, topology, exchange, clock)
                if spread.cut.tool >= 0 and clock.steps[0] % STEP_LIFE == 0:
                    part(spread.cut, exchange, body, tools)
            team.outcome[0] = outcome
        meet(team)
        outcome = team.outcome[0]
        if outcome != GOING_ON:
            return outcome
        team.failed[share.thread] = _add_forces_inside(share, body, clock, material)
        meet(team)
        add_late_forces(body, share.late)
        meet(team)
        if leads:
            failed = team.failed.sum() > 0 or apart
            tie(spread.cut, body.mass, body.f, True)
            meet_tools(failed, body, topology, tools, edge, spread, candidates, clock, ledger, friction, settings)
            _kick_by_contact(until, body, tools, clock, ledger)
            tie(spread.cut, body.mass, body.v, False)
        meet(team)
        kick_and_drift(body, _mean_step(clock), clock.step[0], ledger.node_sums, share.chunks[0], share.chunks[1])
        meet(team)
        if leads:
            outcome = finish_step(body, tools, clock, ledger)
