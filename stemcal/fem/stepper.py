"""Integrate a model in time: `simulate(model, duration)` returns the history of its forces and energies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Barrier
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Mask
from stemcal.errors import SimulationFailed
from stemcal.fem.kernels import block
from stemcal.fem.kernels.block import ALIVE, HOURGLASS_ENERGY, INTERNAL_ENERGY, PLASTIC_RATE
from stemcal.fem.kernels.march import COLLAPSED, GOING_ON, INVERTED, NOT_FINITE, REACHED, Share, Team, march
from stemcal.fem.kernels.nodes import CHUNK, KINDS, copy_for_elements, kinetic_energy
from stemcal.fem.model import Model
from stemcal.fem.state import State, scratch_like, start


@dataclass(frozen=True)
class History:
    """Results of a simulation in rows over time; energies in mJ (N·mm), forces in N.

    time: End of each output interval (R,), s; the first row is the start.
    force: Mean force of the body on each tool during the interval (R, T, 3): its impulse over the interval's length.
    height: z of each tool (R, T), mm.
    kinetic, internal, hourglass, eroded, external: Energies (R,). `internal` and `hourglass` are those of elements not
        eroded, `eroded` is the energy removed with eroded elements and nodes, `external` the work of tools and loads.
    held: The part of the external work that contact has stored in penalty springs or dissipated (R, 3, T), by source:
        the surface of each tool, its edge, and the friction of both. A negative value is a numerical error.
    deleted, parted: Number of eroded elements, and of nodes of the cut plane that have parted (R,).
    plastic_rate: Largest smoothed plastic strain rate of the elements not eroded, which the rate law uses (R,), 1/s.
    steps: Number of time steps.
    x: Final positions of the nodes (N, 3), mm.
    state: Final state of the elements (E, rows), with the rows of `kernels.block`.
    standing: Elements that are not eroded (E,).
    added_mass: Mass added by mass scaling and the prescribed time step, relative to the true mass.
    """

    time: Array
    force: Array
    height: Array
    kinetic: Array
    internal: Array
    hourglass: Array
    eroded: Array
    external: Array
    held: Array
    deleted: NDArray[np.int64]
    parted: NDArray[np.int64]
    plastic_rate: Array
    steps: int
    x: Array
    state: Array
    standing: Mask
    added_mass: float

    @property
    def contact(self) -> Array:
        """Energy that contact has stored or dissipated (R,), mJ."""
        return np.asarray(self.held.sum(axis=(1, 2)))

    @property
    def balance(self) -> Array:
        """Error of the energy balance (R,), mJ: all energies, minus their sum at the start and the external work."""
        held = self.kinetic + self.internal + self.hourglass + self.eroded + self.contact
        return np.asarray(held - held[0] - self.external)

    def drift_percent(self, until: int | None = None) -> float:
        """Return the largest |balance| before row `until`, in % of the largest external work or kinetic energy."""
        scale = max(np.abs(self.external[:until]).max(), self.kinetic[:until].max(), 1e-30)
        return float(100.0 * np.abs(self.balance[:until]).max() / scale)

    def row(self, name: str) -> Array:
        """Return a final quantity of the elements (E,) by the name of its row in `kernels.block`, as PLASTIC_STRAIN."""
        return np.asarray(self.state[:, getattr(block, name)].copy())


March = Callable[[float, State], int]


class _Marching:
    """Context manager that advances a state with `count` threads.

    Each thread advances some parts of the blocks (`stemcal.fem.lanes`); no two parts write to the same row of the nodal
    forces. Then the forces in separate rows are added; one thread adds all forces of a node in a fixed order, so the
    result is bit-identical for any number of threads. The threads run the compiled loop in parallel, without the
    interpreter lock, and synchronise in it several times per step.
    """

    def __init__(self, state: State, count: int) -> None:
        met, outcome = np.zeros(1, dtype=np.int64), np.full(1, GOING_ON, dtype=np.int64)
        self._team = Team(count, met, met.copy(), np.zeros(count, dtype=np.int64), outcome)
        self._shares = _shares_of(state, count)
        self._pool = ThreadPoolExecutor(count) if count > 1 else None
        self._begin = Barrier(count)

    def __enter__(self) -> _Marching:
        return self

    def __exit__(self, *exception: object) -> None:
        self._begin.abort()
        if self._pool is not None:
            self._pool.shutdown()

    def __call__(self, until: float, state: State) -> int:
        """Advance the model to time `until`; return the reason for the end, such as `REACHED`."""
        if self._pool is None:
            return int(march(until, self._shares[0], self._team, *state.parts()))
        marching = [self._pool.submit(self._take_part, until, share, state) for share in self._shares]
        outcome, *_ = (future.result() for future in marching)
        return outcome

    def _take_part(self, until: float, share: Share, state: State) -> int:
        """Advance one thread's share after all threads have started, so that an interrupt leaves none waiting."""
        self._begin.wait()
        return int(march(until, share, self._team, *state.parts()))


def _shares_of(state: State, count: int) -> list[Share]:
    """Divide the parts of blocks, the chunks of nodes and the separate rows of f (`late`) among `count` threads."""
    body, ends = state.body, state.lanes.ends
    blocks = ends[np.linspace(0, len(ends) - 1, count + 1).astype(int)].tolist()
    chunks = np.linspace(0, len(state.ledger.node_sums), count + 1).astype(int).tolist()
    owner = np.searchsorted(np.array(chunks[1:-1]) * CHUNK, body.late, side="right")
    return [
        Share(
            thread=thread,
            blocks=(blocks[thread], blocks[thread + 1]),
            chunks=(chunks[thread], chunks[thread + 1]),
            scratch=body.scratch if thread == 0 else scratch_like(body.state),
            late=np.flatnonzero(owner == thread).astype(np.int32),
        )
        for thread in range(count)
    ]


Watch = Callable[[float, Array, int], bool | None]
Inspect = Callable[[float, State], None]
_STRIDE = 1_000_000  # number of steps times number of elements between two checks for Ctrl-C
_LEAST = 1e-300  # length of the first piece of a march, s, while the time step is still 0


def simulate(model: Model, duration: float, watch: Watch | None = None, inspect: Inspect | None = None) -> History:
    """Integrate the model from rest (or its initial velocity) over `duration` seconds.

    watch: Called after every output with the time, the mean tool forces (T, 3) of the interval and the number of eroded
        elements; the simulation ends there if it returns True.
    inspect: Called at the start and after every output with the time and the whole state, which it must not change.
    Raises `SimulationFailed` if an element inverts, the time step collapses, or a number stops being finite.
    """
    state = start(model)
    outputs = np.linspace(0.0, duration, model.integration.outputs + 1)[1:]
    rows = [_row(state, np.zeros_like(state.ledger.impulse), np.inf)]
    if inspect is not None:
        inspect(0.0, state)
    with _Marching(state, model.integration.threads) as advance:
        for row in _rows(state, _in_strides(advance, state), outputs):
            rows.append(row)
            if inspect is not None:
                inspect(row["time"], state)
            if watch is not None and watch(row["time"], row["force"], row["deleted"]):
                break
            if model.settling > 0.0:
                _settle(model, state)
    return _history(model, state, rows)


def _rows(state: State, advance: March, outputs: Array) -> Iterator[dict[str, Any]]:
    """Advance the state to each output time in turn; yield the row of the history there."""
    for until in outputs:
        before, impulse = state.clock.time[0], state.ledger.impulse.copy()
        if state.topology.standing.any():
            _check(advance(until, state), state)
        if not state.topology.standing.any():  # without elements there is no stable time step
            state.clock.time[0] = until
        if state.clock.time[0] > before:  # equal if the step to the previous output time passed this one, too
            yield _row(state, impulse, before)


def _settle(model: Model, state: State) -> None:
    """Reduce the deviation of the velocities from the initial ones, v ← v + settling (v₀ − v), and record its energy.

    The last step's positions are changed accordingly, because the next stresses follow from positions and velocities.
    """
    body, slow = state.body, 0.0 if model.velocity is None else model.velocity
    before = kinetic_energy(body.v, body.mass)
    change = model.settling * np.where(body.free, slow - body.v, 0.0)
    body.v[:] += change
    body.x[:] += state.clock.step_before[0] * change
    state.ledger.lost_kinetic[0] += before - kinetic_energy(body.v, body.mass)
    copy_for_elements(body)


def _in_strides(advance: March, state: State) -> March:
    """Return a march in pieces of about 0.1 s of computing, between which Ctrl-C acts; the time steps are the same."""
    stride = max(1, _STRIDE // len(state.topology.hexes))

    def advanced(until: float, state: State) -> int:
        outcome, time, step = REACHED, state.clock.time, state.clock.step
        while outcome == REACHED and time[0] < until:
            before = float(time[0])
            outcome = advance(min(until, before + max(stride * float(step[0]), _LEAST)), state)
            if outcome == REACHED and not time[0] > before:
                return COLLAPSED
        return outcome

    return advanced


def _check(outcome: int, state: State) -> None:
    if outcome == REACHED:
        return
    number = np.flatnonzero(state.topology.slots == state.clock.trouble[0])
    element, time = f"element {number[0]}", f"at t = {state.clock.time[0]:.6g} s"
    raise {
        INVERTED: SimulationFailed("inverted", f"{element} became inverted {time}"),
        COLLAPSED: SimulationFailed("time_step", f"the time step of {element} fell below the lower limit {time}"),
        NOT_FINITE: SimulationFailed("nan", f"a nodal velocity was infinite or NaN {time}"),
    }[outcome]


def _row(state: State, impulse_before: Array, time_before: float) -> dict[str, Any]:
    rows = state.body.state
    alive = rows[:, ALIVE] > 0.0
    internal, hourglass = rows[:, INTERNAL_ENERGY].astype(float), rows[:, HOURGLASS_ENERGY].astype(float)
    ledger = state.ledger
    # the march stores the kinetic energy at the time of the last forces; before the first step, velocities determine it
    kinetic = ledger.kinetic[0] if state.clock.steps[0] else kinetic_energy(state.body.v, state.body.mass)
    return {
        "time": float(state.clock.time[0]),
        "force": (ledger.impulse - impulse_before) / (state.clock.time[0] - time_before),
        "height": state.tools.height.copy(),
        "kinetic": float(kinetic),
        "internal": float(internal[alive].sum()),
        "hourglass": float(hourglass[alive].sum()),
        "eroded": float(internal[~alive].sum() + hourglass[~alive].sum() + ledger.lost_kinetic[0]),
        "external": float(ledger.external_work[0]),
        "held": ledger.held.reshape(KINDS, -1).copy(),
        "deleted": int((~state.topology.standing).sum()),
        "plastic_rate": float(rows[:, PLASTIC_RATE][alive].max(initial=0.0)),
        "parted": int(state.spread.cut.parted.sum()),
    }


def _history(model: Model, state: State, rows: list[dict[str, Any]]) -> History:
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    volumes, layers = model.mesh.volumes(), model.layers
    true_mass = sum(law.density * float(volumes[layers.of == i].sum()) for i, law in enumerate(layers.materials))
    return History(
        **columns,
        steps=int(state.clock.steps[0]),
        x=state.body.x,
        state=state.lanes.gathered(state.body.state),
        standing=state.topology.standing,
        added_mass=float(state.body.element_mass.sum() / true_mass) - 1.0,
    )
