"""What the record of a run keeps for pictures: which moments, how exactly, and up to which size of the mesh."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stemcal.cutting.end_state import Shape
from stemcal.fem.kernels.block import PLASTIC_STRAIN
from stemcal.solvers.embedded import pictured
from stemcal.solvers.film import Film, frames_of
from stemcal.solvers.kept_curve import kept_curve, kept_rows

CUBE = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)


def shape_of(nodes: int = 8, moved: float = 0.0) -> Shape:
    """One element of side 1 mm, moved along z, and loose nodes up to a number of nodes."""
    reference = np.concatenate([CUBE, np.zeros((nodes - 8, 3))])
    tools = (np.array([[0.0, 2.0], [1.0, 3.0]]), np.array([[0.0, -1.0]]))
    hexes = np.arange(8, dtype=np.int32)[None]
    ends = reference + np.array([0.0, 0.0, moved])
    return Shape(reference, ends, hexes, np.array([True]), np.array([0.25]), tools, "none")


def state(nodes: np.ndarray, strain: float = 0.0) -> Any:
    """The part of the state of a simulation that a film keeps."""
    values = np.zeros((1, PLASTIC_STRAIN + 2))
    values[:, PLASTIC_STRAIN] = strain
    lanes = SimpleNamespace(gathered=lambda column: column.copy())
    body = SimpleNamespace(state=values, x=nodes)
    return SimpleNamespace(topology=SimpleNamespace(standing=np.array([1])), lanes=lanes, body=body)


def result_of(shape: Shape | None, end: float = 50.0) -> Any:
    """A test at 0.1 mm/s whose force is 2 N/s; the energies are thirds."""
    time = np.linspace(0.0, end, 101)
    names = ("kinetic", "internal", "hourglass", "eroded", "contact", "external", "balance")
    curves = {"time": time, "travel": 0.1 * time, "force_filtered": 2.0 * time}
    return SimpleNamespace(shape=shape, history=SimpleNamespace(**curves, **dict.fromkeys(names, time / 3.0)))


def filmed(count: int, shape: Shape) -> Film:
    """The film of `count` outputs, one each second, in which the element rises by 0.01 mm a second."""
    film = Film()
    for second in range(count):
        risen = np.array([0.0, 0.0, 0.01 * second])
        film(float(second), state(shape.reference + risen, 0.001 * second))
    return film


@pytest.mark.parametrize(("outputs", "apart"), [(25, 1), (26, 2), (50, 2), (51, 4), (100, 4), (101, 8)])
def test_a_film_has_at_most_24_intervals_of_equal_length(outputs: int, apart: int) -> None:
    film = filmed(outputs, shape_of())
    assert [moment.time for moment in film.moments] == list(range(0, outputs, apart))


def test_a_film_ends_as_the_test_does() -> None:
    """At 7 s, between two outputs: the final shape; the frames are those of the outputs to a 2000th of the range."""
    end = shape_of(moved=0.5)
    packed = filmed(7, end).packed(result_of(end, 6.5))
    assert packed["travel"] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65], abs=1e-12)
    assert packed["force"] == pytest.approx([0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 13.0], abs=1e-12)
    assert packed["stroke"] == 0.65
    assert (packed["displacement"]["step"], packed["plastic_strain"]["step"]) == (0.5 / 2000, 0.25 / 2000)
    frames = frames_of(end, packed)
    assert [float(frame.shape.nodes[4, 2]) - 1.0 for frame in frames] == pytest.approx(
        [*(0.01 * second for second in range(7)), 0.5], abs=0.5 / 4000
    )
    assert frames[-1].shape.plastic_strain[0] == pytest.approx(0.25) and frames[-1].shape.standing.all()
    assert [float(frame.shape.tools[0][0, 1]) for frame in frames] == pytest.approx(
        [2.65, 2.55, 2.45, 2.35, 2.25, 2.15, 2.05, 2.0]
    )
    assert all(np.array_equal(frame.shape.tools[1], end.tools[1]) for frame in frames)
    at_output = filmed(7, end).packed(result_of(end, 6.0))
    assert len(at_output["travel"]) == 7


def test_numbers_of_a_film_have_four_decimals() -> None:
    packed = filmed(2, shape_of()).packed(result_of(shape_of(), 1.0 / 3.0))
    assert (packed["travel"][-1], packed["force"][-1], packed["stroke"]) == (0.0333, 0.6667, 0.0333)


def test_a_film_without_motion_has_a_step_of_one() -> None:
    still = filmed(1, shape_of()).packed(result_of(shape_of(), 0.0))
    assert (still["displacement"]["step"], still["plastic_strain"]["step"]) == (1.0, 1.0)


@pytest.mark.parametrize(("nodes", "kept"), [(10_000, True), (10_001, False)])
def test_a_film_has_at_most_ten_thousand_nodes(nodes: int, kept: bool) -> None:
    shape = shape_of(nodes)
    assert bool(filmed(2, shape).packed(result_of(shape, 1.0))) is kept
    assert Film().packed(result_of(shape, 1.0)) == {}
    assert set(pictured(result_of(shape, 1.0), filmed(2, shape))) == (
        {"energies", "shape", "film"} if kept else {"energies", "shape"}
    )


@pytest.mark.parametrize(("nodes", "kept"), [(40_000, True), (40_001, False), (None, False)])
def test_a_shape_has_at_most_forty_thousand_nodes(nodes: int | None, kept: bool) -> None:
    shape = None if nodes is None else shape_of(nodes)
    assert ("shape" in pictured(result_of(shape), Film())) is kept


def test_energies_are_kept_at_two_hundred_points_with_six_decimals() -> None:
    energies = pictured(result_of(None, 2.0), Film())["energies"]
    assert set(energies) == {"travel", "kinetic", "internal", "hourglass", "eroded", "contact", "external"}
    assert len(energies["travel"]) == 101
    assert energies["travel"][1] == 0.002 and energies["kinetic"][1] == 0.006667
    assert energies["kinetic"][-1] == 0.666667


@pytest.mark.parametrize("count", [1, 2, 200, 201, 500])
def test_a_kept_curve_has_both_ends_and_at_most_two_hundred_points(count: int) -> None:
    rows = kept_rows(count)
    assert (rows[0], rows[-1], len(rows)) == (0, count - 1, min(count, 200))
    assert set(np.diff(rows)) <= {1, 2, 3}


def test_a_kept_curve_is_rounded() -> None:
    curve = kept_curve(np.array([0.0, 1.0 / 3.0]), np.array([0.0, 200.0 / 3.0]))
    assert curve == {"travel": [0.0, 0.333333], "force": [0.0, 66.6667]}
