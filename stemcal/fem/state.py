"""The state of a model during its integration, and how it is assembled at time 0."""

from dataclasses import dataclass
from math import ceil, inf, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stemcal.arrays import Array, Ints, Mask
from stemcal.errors import SimulationFailed
from stemcal.fem.kernels import block
from stemcal.fem.kernels.compile import RUN
from stemcal.fem.kernels.contact import EdgeArrays, FrictionNumbers, ToolArrays
from stemcal.fem.kernels.layers import LayerTable
from stemcal.fem.kernels.march import SOFT_LIFE, STEP_LIFE, Body, Clock, Ledger, Settings
from stemcal.fem.kernels.nodes import CHUNK, KINDS, Pushes, copy_for_elements
from stemcal.fem.kernels.nonlocal_mean import Exchange
from stemcal.fem.kernels.plasticity import MaterialNumbers
from stemcal.fem.kernels.search import FACES, Candidates, Topology
from stemcal.fem.kernels.spread_edge import SpreadEdge
from stemcal.fem.kernels.timestep import element_steps, stable_step
from stemcal.fem.lanes import Lanes, lay_out, nodal, nodal_zeros
from stemcal.fem.material import HOURGLASS_SHARE, Material
from stemcal.fem.mesh import Mesh
from stemcal.fem.model import Model
from stemcal.fem.parting import cut_plane, joined, parts_under, spared
from stemcal.fem.tools import edge_arrays, spread_edge, tool_arrays, with_skin


def exchange(
    mesh: Mesh,
    neighbours: Ints,
    failure_strain: float | Array,
    length: float | Array,
    strains: Array,
    materials: NDArray[np.int_] | None = None,
    spared: Mask | None = None,
) -> Exchange:
    """Return the arrays for averaging the plastic strain over an internal length; with length 0, failure is local.

    neighbours: The element behind each face (E, 6), −1 for none.
    failure_strain, length: Failure strain, and ℓ of the weight exp(−r²/ℓ²), mm; one for all elements, or each (E,).
    strains: Plastic strains in the blocks (blocks, lanes), of which only the shape is used.
    materials: Material of each element (E,); the mean is over elements of the same material.
    spared: Elements that are never deleted (E,).
    """
    elements = len(mesh.hexes)
    time = np.full((elements, 1), 0.25) * np.square(length).reshape(-1, 1)
    if materials is not None:
        neighbours = np.where(materials[neighbours] == materials[:, None], neighbours, -1)
    rate = _conductances(mesh, neighbours) / mesh.volumes()[:, None]
    # A pass exchanges at most half of an element's strain: with all of it, neighbours would only swap their values. For
    # the number of passes, a free face has the element's mirror image behind it. A model with a mirror plane thus has
    # the same passes and means as the full model; otherwise the first element would fail in another step.
    passes = max(int(time.max() > 0.0), ceil(float((2.0 * time[:, 0] * rate.sum(axis=1)).max()) - 1e-9))
    # a face without a neighbour has the index of the element itself behind it, so that the kernel needs no branch
    around = np.where(neighbours < 0, np.arange(elements)[:, None], neighbours).astype(np.uint32)
    share = np.where(neighbours < 0, 0.0, rate) * time / max(passes, 1)
    means = np.zeros(elements), np.zeros(elements), np.zeros_like(strains), np.zeros(1)
    spared = np.zeros(elements, dtype=bool) if spared is None else spared
    return Exchange(share, around, passes, np.full(elements, failure_strain), spared, *means)


def _conductances(mesh: Mesh, neighbours: Ints) -> Array:
    """Return T = |A·d|/|d|² of each face (E, 6), mm: A is its area vector, d the vector to the neighbour's centre.

    A face without a neighbour has the element's mirror image behind it.
    """
    corners = mesh.nodes[mesh.hexes]
    centres = corners.mean(axis=1)
    faces = corners[:, FACES]
    areas = 0.5 * np.cross(faces[:, :, 2] - faces[:, :, 0], faces[:, :, 3] - faces[:, :, 1])
    behind = np.where((neighbours < 0)[..., None], 2.0 * faces.mean(axis=2) - centres[:, None], centres[neighbours])
    way = behind - centres[:, None]
    return np.asarray(np.abs(np.sum(areas * way, axis=2)) / np.sum(way * way, axis=2))


# A time step below this share of the first one means that the mesh has collapsed.
_COLLAPSE = 1.0e-4
# Nodes and faces are candidates for contact if their distance from a tool is at most this share of an element's size.
_MARGIN = 0.25
# In single precision, elements may grow to this multiple of the largest initial extent without integer overflow.
_STRETCH = 16.0
# A stem is soft if it has fibres (soft in shear), or if its modulus is below this multiple of its yield stress.
_SOFT = 30.0


@dataclass
class State:
    """Everything that changes during the integration of a model, and the constants in the form the kernels use."""

    body: Body
    topology: Topology
    tools: ToolArrays
    edge: EdgeArrays
    spread: SpreadEdge
    candidates: Candidates
    exchange: Exchange
    lanes: Lanes
    clock: Clock
    ledger: Ledger
    material: MaterialNumbers | LayerTable
    friction: FrictionNumbers
    settings: Settings

    def parts(self) -> tuple[Any, ...]:
        """Return the arguments of `kernels.march.march` after the time."""
        return (
            self.body, self.topology, self.tools, self.edge, self.spread, self.candidates, self.exchange, self.clock,
            self.ledger, self.material, self.friction, self.settings,
        )  # fmt: skip


def start(model: Model) -> State:
    """Return the state of a model at time 0."""
    layers = model.layers
    lanes = lay_out(model.mesh.hexes, len(model.mesh.nodes), layers.of)
    topology = model.mesh.topology(model.crowns, lanes.slots)
    material = _material(model, lanes)
    life = SOFT_LIFE if any(map(_is_soft, layers.materials)) else STEP_LIFE
    volumes = model.mesh.volumes()
    body = _body(model, lanes, topology, volumes)
    tools = with_skin(tool_arrays(model.tools, len(body.x)), topology, body.mass)
    size = float(np.cbrt(np.median(volumes)))
    spread = spread_edge(model.tools, body.x, model.mesh.hexes, float(np.cbrt(volumes.min())))
    first, _, volume = stable_step(body, material)
    if not volume > 0.0:
        raise SimulationFailed("inverted", "an element of the initial mesh has zero or negative volume")
    return State(
        body=body,
        topology=topology,
        tools=tools,
        edge=edge_arrays(model.tools, body.x, size),
        spread=spread._replace(cut=cut_plane(model.tools, model.mesh, spread)),
        candidates=_candidates(len(model.tools), len(body.x), len(topology.hexes), len(tools.skin)),
        exchange=exchange(
            model.mesh,
            joined(model.mesh, model.tools).neighbours() if parts_under(model.tools) >= 0 else topology.neighbours,
            layers.each(law.failure_strain for law in layers.materials),
            layers.each(law.internal_length for law in layers.materials),
            body.state[:, block.PLASTIC_STRAIN],
            layers.of,
            spared(model.mesh, model.tools, max(law.internal_length for law in layers.materials)),
        ),
        lanes=lanes,
        clock=Clock(
            time=np.zeros(1),
            step=np.zeros(1),
            step_before=np.zeros(1),
            steps=np.zeros(1, dtype=np.int64),
            reach=np.full(1, np.inf),
            trouble=np.full(1, -1, dtype=np.int64),
        ),
        ledger=_ledger(len(model.tools), len(body.x)),
        material=material,
        friction=model.contact.numbers(),
        settings=Settings(
            safety=model.integration.safety,
            smallest_step=_COLLAPSE * model.integration.safety * first,
            penalty_step=first,
            margin=_MARGIN * size,
            surface_life=life,
        ),
    )


def _is_soft(law: Material) -> bool:
    return law.transverse is not None or law.elastic_modulus < _SOFT * law.yield_stress < inf


def _numbers(model: Model) -> list[Any]:
    layers, scaling = model.layers, model.integration.mass_scaling
    isotropic = len(layers.materials) == 1 and layers.materials[0].transverse is None
    form = Material.numbers if isotropic else Material.transverse_numbers
    return [form(law, scaling, model.viscosity) for law in layers.materials]


def _material(model: Model, lanes: Lanes) -> MaterialNumbers | LayerTable:
    """Return the materials in the form that the kernels use, in the precision of the elements."""
    numbers, precision = _numbers(model), _precision(model)
    if isinstance(numbers[0], MaterialNumbers):
        return MaterialNumbers(*(precision.type(number) for number in numbers[0]))
    rows = lanes.spread(model.layers.of.astype(float), 0.0).max(axis=1)  # an empty lane may have any material
    return LayerTable(rows.astype(np.int32), np.array(numbers, dtype=precision))


def _aligned_zeros(shape: tuple[int, ...], kind: np.dtype[Any]) -> Array:
    """Return zeros whose memory begins on a cache line: vectors across two lines would slow the kernel by a quarter."""
    size = kind.itemsize * prod(shape)
    raw = np.zeros(size + block.CACHE_LINE, dtype=np.uint8)
    begin = -raw.ctypes.data % block.CACHE_LINE
    return raw[begin : begin + size].view(kind).reshape(shape)


def scratch_like(state: Array) -> Array:
    """Return a scratch array for one block, in the precision of `state`."""
    return _aligned_zeros((block.SCRATCH_ROWS * block.LANES,), state.dtype)


def _precision(model: Model) -> np.dtype[Any]:
    return np.dtype(np.float32 if model.integration.precision == "mixed" else np.float64)


def _ledger(tools: int, nodes: int) -> Ledger:
    return Ledger(
        impulse=np.zeros((tools, 3)),
        held=np.zeros(KINDS * tools),
        external_work=np.zeros(1),
        lost_kinetic=np.zeros(1),
        kinetic=np.zeros(1),
        node_sums=np.zeros((-(-nodes // CHUNK), 2)),
    )


def _body(model: Model, lanes: Lanes, topology: Topology, volumes: Array) -> Body:
    mesh = model.mesh
    x = nodal(mesh.nodes)
    element_state = _element_state(model, lanes, volumes)
    element_mass = _element_masses(model, element_state, topology, volumes)
    element_state[:, block.ELEMENT_MASS] = lanes.spread(element_mass, 1.0)
    mass = np.zeros(len(x))
    np.add.at(mass, mesh.hexes, element_mass[:, None] / 8.0)
    v = nodal_zeros(len(x), x.dtype) if model.velocity is None else nodal(model.velocity)
    held = np.zeros(x.shape, dtype=bool, order="F") if model.held is None else model.held.copy(order="F")
    none = np.zeros((0, 3), order="F")
    # in C order, which the compiler assumes for the empty array `none`; otherwise the kernels would be compiled twice
    driven = np.ascontiguousarray(np.where(held, v, 0.0)) if v[held].any() else none
    body = Body(
        x=x,
        v=v,
        seen=_seen(x, v, mesh, element_state.dtype),
        f=nodal_zeros(len(x) + RUN + len(lanes.late), element_state.dtype),
        pushes=_no_pushes(len(x), len(model.tools)),
        loads=none if model.loads is None else np.array(model.loads, dtype=float, order="C"),
        mass=mass,
        inverse_mass=1.0 / mass,
        free=~held,
        driven=driven,
        runs=lanes.runs,
        targets=lanes.targets,
        late=lanes.late,
        state=element_state,
        scratch=scratch_like(element_state),
        element_mass=element_mass,
    )
    copy_for_elements(body)
    return body


def _no_pushes(nodes: int, tools: int) -> Pushes:
    sources = KINDS * tools
    return Pushes(
        np.zeros((sources, nodes, 3)),
        np.zeros((sources, nodes), dtype=np.int32),
        np.zeros(sources, dtype=np.int64),
        np.zeros((sources, nodes), dtype=bool),
    )


def _seen(x: Array, v: Array, mesh: Mesh, kind: np.dtype[Any]) -> block.Seen:
    """Return the positions and velocities that elements read, in the elements' precision `kind`."""
    if kind == np.float64:
        return block.Seen(x, v, 1.0)
    unit = kind.type(2.0 ** (np.ceil(np.log2(_STRETCH * mesh.largest_extent())) - 31))
    return block.Seen(nodal_zeros(len(x), np.dtype(np.int32)), nodal_zeros(len(v), kind), unit)


def _element_masses(model: Model, state: Array, topology: Topology, volumes: Array) -> Array:
    """Return the element masses (E,), t: ρV, times (Δt/Δt_stable)² where the prescribed time step Δt is longer."""
    mesh, how, layers, numbers = model.mesh, model.integration, model.layers, _numbers(model)
    round_ = _precision(model).type
    mass = layers.each(round_(constants.density) for constants in numbers) * volumes
    if how.time_step is None:
        return np.asarray(mass)
    steps = np.stack([element_steps(topology, mesh.nodes, state, mass, constants) for constants in numbers])
    own = how.safety * steps[layers.of, np.arange(len(mass))]
    return np.asarray(mass * np.maximum(1.0, how.time_step / own) ** 2)


def _element_state(model: Model, lanes: Lanes, volumes: Array) -> Array:
    length, layers = np.cbrt(volumes), model.layers
    state = _aligned_zeros((len(lanes.runs), block.STATE_ROWS, block.LANES), _precision(model))
    state[:, block.ALIVE] = lanes.spread(np.ones_like(volumes), 0.0)
    state[:, block.RATE_FACTOR] = 1.0
    state[:, block.VISCOUS_LENGTH] = lanes.spread(length, 1.0)
    limits = layers.each(law.own_failure_strain for law in layers.materials)
    state[:, block.FAILURE_STRAIN] = lanes.spread(limits, 1.0)
    # hourglass stiffness of a modal sum Γ·u, N/mm: a = 0.038 · hourglass · (λ+2μ) V^⅓
    moduli = layers.each(law.p_wave_modulus for law in layers.materials)
    stiffness = model.hourglass * (HOURGLASS_SHARE * moduli * length)
    state[:, block.HOURGLASS_STIFFNESS] = lanes.spread(stiffness, 0.0)
    return state


def _candidates(tools: int, nodes: int, elements: int, skin: int) -> Candidates:
    return Candidates(
        nodes=np.zeros((tools, nodes), dtype=np.int32),
        node_counts=np.zeros(tools, dtype=np.int32),
        skin=np.zeros((tools, skin), dtype=np.int32),
        skin_counts=np.zeros(tools, dtype=np.int32),
        covered=np.zeros(nodes, dtype=bool),
        faces=np.zeros((6 * elements, 4), dtype=np.int32),
        corner_mass=np.zeros(6 * elements),
        crowns=np.zeros(6 * elements),
        face_count=np.zeros(1, dtype=np.int32),
    )
