"""The mesh in other places, coarser away from the cut, and simulations that stop after the peak."""

from dataclasses import replace

import numpy as np
import pytest

from stemcal.cutting.build import stem_mesh
from stemcal.cutting.parts import Blade, Discretisation, Loading, ShearTest, Stem, Supports
from stemcal.cutting.result import BreakWatch, break_row, moving_mean
from stemcal.cutting.simulate import placed, shear
from stemcal.fem import state
from stemcal.fem.material import Material, Transverse
from stemcal.fem.model import Integration

COARSE = Discretisation(
    element_size=2.0, through_wall=2, integration=Integration(mass_scaling=1.0e5, outputs=100), filter_window=0.02
)
MATERIAL = Material(1.1e-9, 1000.0, 0.3, 12.0, 0.5, 0.05, 90.0, 8.0, 0.01, "paper")
TEST = ShearTest(MATERIAL, stem=Stem(length=30.0), discretisation=COARSE, loading=Loading(duration=0.5))


def test_a_shift_moves_the_mesh_by_that_share_of_an_element() -> None:
    still, moved = (stem_mesh(test.stem, test.discretisation) for test in (placed(TEST, 0.125), placed(TEST, 0.375)))
    step = np.diff(np.unique(still.nodes[:, 0].round(9)))[0]
    np.testing.assert_allclose(moved.nodes - still.nodes, [[0.25 * step, 0.0, 0.0]] * len(still.nodes), atol=1e-12)


def test_shifts_and_their_mirror_images_agree() -> None:
    """A half model shifted by −s is the mirror image of one shifted by s, so is its force (to round-off and chaos)."""
    half = replace(TEST, discretisation=replace(COARSE, symmetry="half"))
    there, back = (
        shear(replace(half, discretisation=replace(half.discretisation, shift=shift))).peak_force
        for shift in (0.3, -0.3)
    )
    assert there == pytest.approx(back, rel=1e-3)


@pytest.mark.slow
def test_no_vibration_of_a_stem_with_fibres() -> None:
    """Nodes .05 mm beside the edge: with a surface of 20 steps ago they vibrate, with 0.3 % of the internal energy.

    That vibration spread through the stem, and lowered the peak force by 5 % at some positions of the mesh.
    """
    across = Transverse(272.0, 151.0, 0.3, 8.17, 4.72)
    wood = Material(1.1e-9, 1360.0, 0.3, 24.5, 0.5, 0.05, failure_strain=0.08, internal_length=11 / 4.5,
                    transverse=across)  # fmt: skip
    how = Discretisation(
        element_size=11 / 16, coarsening=6.0, coarsening_around=2.0,
        integration=Integration(mass_scaling=1e4, outputs=120, time_step=4e-5, precision="mixed"),
    )  # fmt: skip
    test = ShearTest(wood, stem=Stem(outer_diameter=11.0), blade=Blade(edge_spread=11 / 9.5), discretisation=how,
                     loading=Loading(duration=0.6))  # fmt: skip
    curve = shear(placed(test, 1 / 12)).history
    later = curve.travel > 0.5
    assert (curve.kinetic[later] / curve.internal[later]).max() < 5e-4


@pytest.mark.slow
def test_a_soft_stem_has_the_force_of_a_surface_of_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """E = 20 σ_y: with a surface of up to 20 steps ago, 4805 N instead of 3855 N."""
    cane = Material(1.067e-9, 600.0, 0.33, 30.0, 5.0, 0.05, failure_strain=0.08, internal_length=25 / 4.5)
    how = Discretisation(
        element_size=25 / 12, coarsening=6.0, coarsening_around=2.0,
        integration=Integration(mass_scaling=1e4, time_step=4e-5, precision="mixed"),
    )  # fmt: skip
    test = ShearTest(
        cane, stem=Stem(25.0, 0.0, 120.0), supports=Supports(clearance=40.0), discretisation=how,
        blade=Blade(thickness=4.0, edge_angle=30.0, edge_spread=25 / 9.5), loading=Loading(50 / 60, 15.0),
    )  # fmt: skip
    force = shear(test).peak_force
    monkeypatch.setattr(state, "SOFT_LIFE", 1)
    assert force == pytest.approx(shear(test).peak_force, rel=0.01)
    assert force == pytest.approx(3855.0, rel=0.02)


def test_coarsening_keeps_the_cut_and_the_length() -> None:
    """Lengths are even over three tenths of the elements, then grow to 3; same volume, nodes mirrored about the cut."""
    stem = Stem(length=30.0)
    even = stem_mesh(stem, replace(COARSE, symmetry="half", element_size=1.0))
    graded = stem_mesh(stem, replace(COARSE, symmetry="half", element_size=1.0, coarsening=3.0))
    layers = np.unique(graded.nodes[:, 0].round(9))
    lengths = np.diff(layers)
    assert len(graded.hexes) < 0.65 * len(even.hexes)
    assert graded.volumes().sum() == pytest.approx(even.volumes().sum(), rel=1e-12)
    np.testing.assert_allclose(layers, -layers[::-1], atol=1e-9)
    assert lengths.max() / lengths.min() == pytest.approx(3.0, rel=1e-6)
    outwards = lengths[len(lengths) // 2 :] / lengths.min()
    t = np.arange(len(outwards)) / (len(outwards) - 1)
    np.testing.assert_allclose(outwards, np.where(t < 0.3, 1.0, 1.0 + 2.0 * (t - 0.3) / 0.7), rtol=1e-6)


@pytest.mark.parametrize(("drop", "row"), [(0.3, 5), (0.5, 6), (0.8, 8), (1.0, None)])
def test_the_stem_has_broken_once_the_force_has_dropped(drop: float, row: int | None) -> None:
    """The fall from 8 to 1 N before anything has failed is none; a later, larger force does not undo a break."""
    force = np.array([0.0, 8.0, 1.0, 20.0, 30.0, 21.0, 14.0, 16.0, 5.0, 50.0])
    deleted = np.array([0, 0, 0, 0, 1, 1, 2, 2, 3, 3])
    assert break_row(force, deleted, drop) == row


@pytest.mark.parametrize("window", [1, 4, 11])
@pytest.mark.parametrize("drop", [0.3, 0.5, 1.0])
def test_watching_finds_the_break_that_the_whole_curve_has(window: int, drop: float) -> None:
    """Of a hundred random walks from rest; the watch knows half a window later, and what it saw by then is enough."""
    random = np.random.default_rng(5)
    for _ in range(100):
        force = np.abs(np.cumsum(random.normal(0.3, 2.0, 200))) * (np.arange(200) >= window)
        deleted = np.cumsum(random.random(200) < 0.02)
        watch = BreakWatch(drop, window)
        stopped = next((i for i in range(200) if watch.is_past(force[i], int(deleted[i]))), None)
        broken = break_row(moving_mean(force, window), deleted, drop)
        if stopped is None:
            assert broken is None or broken >= 200 - window // 2
            continue
        kept = moving_mean(force[: stopped + 1], window)
        assert broken is not None
        assert broken <= stopped - window // 2
        assert break_row(kept, deleted[: stopped + 1], drop) == broken
        assert kept[:broken].max() == moving_mean(force, window)[:broken].max()


def test_stopping_after_the_peak_keeps_the_peak() -> None:
    """A stroke twice as long as the peak needs: the same force (the filter sees the same rows) for fewer steps."""
    long = replace(TEST, loading=Loading(duration=1.0))
    through, stopped = (
        shear(replace(long, discretisation=replace(COARSE, stop_after_peak=stop))) for stop in (False, True)
    )
    assert through.stroke_was_enough
    assert stopped.peak_force == through.peak_force
    assert stopped.steps < 0.8 * through.steps
