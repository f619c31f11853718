"""The internal length of failure: plastic strain averaged as a substance spreads, against closed forms."""

import numpy as np
import pytest
from called import called
from numpy.typing import NDArray

from stemcal.cutting.build import build
from stemcal.cutting.parts import Discretisation, ShearTest, Stem
from stemcal.fem.kernels import nonlocal_mean
from stemcal.fem.kernels.block import ALIVE, LANES, PLASTIC_STRAIN, STATE_ROWS
from stemcal.fem.kernels.search import Topology
from stemcal.fem.material import Material
from stemcal.fem.mesh import Mesh, brick
from stemcal.fem.state import exchange

Array = NDArray[np.float64]


def states(strain: Array) -> Array:
    """Return the elements' state rows with a plastic strain in each, all alive."""
    state = np.zeros((-(-len(strain) // LANES), STATE_ROWS, LANES))
    padded = np.zeros(state.shape[0] * LANES)
    padded[: len(strain)] = strain
    state[:, PLASTIC_STRAIN] = padded.reshape(-1, LANES)
    state[:, ALIVE] = 1.0
    return state


def averaged(mesh: Mesh, strain: Array, length: float, topology: Topology | None = None) -> Array:
    topology = mesh.topology() if topology is None else topology
    state = states(strain)
    spread = exchange(mesh, topology.neighbours, 1.0, length, state[:, PLASTIC_STRAIN])
    called(nonlocal_mean._spread_strains)(spread, topology, state)
    return spread.mean.copy()


def test_strain_of_one_slice_spreads_as_a_bell() -> None:
    """In a long bar the mean of a unit slice is h exp(−x²/ℓ²)/(√π ℓ)."""
    h, length = 0.1, 1.0
    mesh = brick((10.1, 1.0, 1.0), (101, 1, 1))
    strain = np.zeros(101)
    strain[50] = 1.0
    x = (np.arange(101) - 50) * h
    expected = h * np.exp(-((x / length) ** 2)) / (np.sqrt(np.pi) * length)
    assert averaged(mesh, strain, length) == pytest.approx(expected, abs=0.006 * expected.max())


def test_strain_of_one_element_spreads_as_a_ball() -> None:
    """Around a single element it is V exp(−r²/ℓ²)/(√π ℓ)³, alike in all directions."""
    counts, size = (21, 21, 21), 5.25
    mesh = brick((size, size, size), counts)
    centres = mesh.nodes[mesh.hexes].mean(axis=1)
    middle = int(np.argmin(np.linalg.norm(centres - 0.5 * size, axis=1)))
    strain = np.zeros(len(mesh.hexes))
    strain[middle] = 1.0
    r = np.linalg.norm(centres - centres[middle], axis=1)
    expected = 0.25**3 * np.exp(-(r**2)) / np.pi**1.5
    assert averaged(mesh, strain, 1.0) == pytest.approx(expected, abs=0.03 * expected.max())


def test_the_whole_is_kept_and_a_uniform_strain_stays() -> None:
    """Σ V ε̄ = Σ V ε on a graded ring, whose elements differ in size by a factor of ten and more."""
    how = Discretisation(element_size=0.8, symmetry="half", coarsening=4.0, coarsening_around=3.0, edge_over="nodes")
    mesh = build(ShearTest(Material(1e-9, 1000.0, 0.3), discretisation=how)).mesh
    volumes = mesh.volumes()
    assert volumes.max() > 10.0 * volumes.min()
    strain = np.random.default_rng(1).random(len(volumes))
    assert np.sum(volumes * averaged(mesh, strain, 1.5)) == pytest.approx(np.sum(volumes * strain), rel=1e-12)
    assert averaged(mesh, np.ones(len(volumes)), 1.5) == pytest.approx(1.0, abs=1e-12)


def test_a_mirror_plane_is_as_good_as_the_other_half() -> None:
    """A field symmetric about both planes has the same means in the quarter model."""
    means = {}
    for symmetry in ("none", "quarter"):
        how = Discretisation(element_size=1.0, symmetry=symmetry)  # type: ignore[arg-type]
        model = build(ShearTest(Material(1e-9, 1000.0, 0.3), stem=Stem(length=11.0), discretisation=how))
        centres = model.mesh.nodes[model.mesh.hexes].mean(axis=1)
        strain = np.exp(-(centres[:, 0] ** 2)) * (4.0 + centres[:, 2])
        topology, state = model.mesh.topology(), states(strain)
        spread = exchange(model.mesh, topology.neighbours, 1.0, 1.5, state[:, PLASTIC_STRAIN])
        called(nonlocal_mean._spread_strains)(spread, topology, state)
        places = np.round(np.abs(centres) * np.array([1.0, 1.0, 0.0]) + centres * np.array([0.0, 0.0, 1.0]), 6) + 0.0
        means[symmetry] = {tuple(p): m for p, m in zip(places, spread.mean, strict=True)}
    assert len(means["quarter"]) == len(means["none"]) > 100
    for place, mean in means["quarter"].items():
        assert mean == pytest.approx(means["none"][place], rel=1e-12)


@pytest.mark.parametrize(("symmetry", "over"), [("half", "nodes"), ("quarter", "nodes"), ("half", "elements")])
def test_a_mirror_plane_takes_as_many_passes(symmetry: str, over: str) -> None:
    """The smallest elements stand beside the mirror plane along the stem."""
    passes = []
    for one in ("none", symmetry):
        how = Discretisation(element_size=0.7, symmetry=one, edge_over=over, coarsening=6.0, coarsening_around=2.0)  # type: ignore[arg-type]
        model = build(ShearTest(Material(1e-9, 1000.0, 0.3), discretisation=how))
        strains = np.zeros((-(-len(model.mesh.hexes) // LANES), LANES))
        passes.append(exchange(model.mesh, model.mesh.topology().neighbours, 1.0, 1.5, strains).passes)
    assert passes[0] == passes[1] > 20


def test_strain_of_what_has_failed_still_counts() -> None:
    """In a long bar the mean beside a failed slice is that of before: h exp(−x²/ℓ²)/(√π ℓ)."""
    h, length = 0.1, 1.0
    mesh = brick((10.1, 1.0, 1.0), (101, 1, 1))
    topology = mesh.topology()
    topology.standing[50] = False
    strain = np.zeros(101)
    strain[50] = 1.0
    mean = averaged(mesh, strain, length, topology)
    assert mean[55] == pytest.approx(h * np.exp(-0.25) / np.sqrt(np.pi), rel=0.01)
    assert mean[45] == pytest.approx(mean[55], rel=1e-12)


def test_what_stands_beside_a_gap_fails_as_if_there_were_none() -> None:
    """The means beside a slice of strain 0.3, with ℓ = 4: 0.3 exp(−1/16)/(4√π) = 0.0397 and 0.0330 one further."""
    mesh = brick((40.0, 1.0, 1.0), (40, 1, 1))
    topology, strain = mesh.topology(), np.zeros(40)
    strain[20] = 0.3
    state = states(strain)
    state[20 // LANES, ALIVE, 20 % LANES] = 0.0
    topology.standing[20] = False
    spread = exchange(mesh, topology.neighbours, 0.038, 4.0, np.zeros_like(state[:, PLASTIC_STRAIN]))
    assert called(nonlocal_mean.fail_by_mean_strain)(spread, topology, state)
    assert np.flatnonzero(state[:, ALIVE].ravel()[:40] == 0.0).tolist() == [19, 20, 21]


def test_elements_fail_by_their_mean_strain_alone() -> None:
    """One strained slice of many does not fail at a strain far above the limit, a wide field does just at it."""
    mesh = brick((40.0, 1.0, 1.0), (40, 1, 1))
    topology = mesh.topology()
    spread = exchange(mesh, topology.neighbours, 0.05, 4.0, states(np.zeros(40))[:, PLASTIC_STRAIN])
    single, wide = np.zeros(40), np.full(40, 0.05)
    single[20] = 0.3  # mean 0.3/(4√π) = 0.0423
    assert not called(nonlocal_mean.fail_by_mean_strain)(spread, topology, states(single))
    assert called(nonlocal_mean.fail_by_mean_strain)(spread, topology, states(wide))


def test_no_length_leaves_each_element_to_itself() -> None:
    alone, one = np.full((1, 6), -1, dtype=np.int32), np.ones(1)
    spread = exchange(brick((1.0, 1.0, 1.0), (1, 1, 1)), alone, 0.1, 0.0, states(one)[:, PLASTIC_STRAIN])
    assert spread.passes == 0
    assert Material(1e-9, 1000.0, 0.3, failure_strain=0.1).own_failure_strain == 0.1
    nonlocal_ = Material(1e-9, 1000.0, 0.3, failure_strain=0.1, internal_length=1.0)
    assert nonlocal_.own_failure_strain == np.inf


def test_means_end_where_the_material_does() -> None:
    """A bar of two materials: strain of one half stays there, its mean as in a bar that ends at the interface."""
    bar, half = brick((4.0, 1.0, 1.0), (40, 1, 1)), brick((2.0, 1.0, 1.0), (20, 1, 1))
    topology, strain = bar.topology(), np.concatenate([np.linspace(0.0, 0.03, 20), np.zeros(20)])
    state, of = states(strain), np.repeat([0, 1], 20)
    spread = exchange(bar, topology.neighbours, 1.0, 1.0, state[:, PLASTIC_STRAIN], of)
    called(nonlocal_mean._spread_strains)(spread, topology, state)
    assert np.abs(spread.mean[20:]).max() == 0.0
    np.testing.assert_allclose(spread.mean[:20], averaged(half, strain[:20], 1.0), rtol=1e-9)


def test_each_material_has_its_limit_and_length() -> None:
    """A strain of 0.04 everywhere: only the half with a limit of 0.03 fails, though its mean is not averaged."""
    bar, of = brick((4.0, 1.0, 1.0), (40, 1, 1)), np.repeat([0, 1], 20)
    topology, state = bar.topology(), states(np.full(40, 0.04))
    limits, lengths = np.where(of == 0, 0.05, 0.03), np.where(of == 0, 1.0, 0.0)
    spread = exchange(bar, topology.neighbours, limits, lengths, state[:, PLASTIC_STRAIN], of)
    assert called(nonlocal_mean.fail_by_mean_strain)(spread, topology, state)
    alive = state[:, ALIVE].ravel()[:40]
    np.testing.assert_array_equal(alive, np.where(of == 0, 1.0, 0.0))
