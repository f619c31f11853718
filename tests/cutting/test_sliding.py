"""An oblique edge that slides along itself: straight at 0°, the same to either side, less force the more it slides."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from test_whole_cut import cut

from stemcal.cutting.result import CuttingResult
from stemcal.cutting.simulate import shear


@cache
def slid(angle: float) -> CuttingResult:
    test = cut(elements=12, symmetry="none")
    return shear(replace(test, loading=replace(test.loading, sliding_angle=angle)))


def test_both_ways_are_alike() -> None:
    """Mirrored in y the forces are the same to round-off, which 7000 steps let grow to some 1e-9."""
    assert slid(20.0).peak_force == pytest.approx(slid(-20.0).peak_force, rel=1e-6)
    assert slid(20.0).cutting_energy == pytest.approx(slid(-20.0).cutting_energy, rel=1e-6)
    np.testing.assert_allclose(
        slid(20.0).history.along_edge[5:200].mean(), -slid(-20.0).history.along_edge[5:200].mean(), rtol=1e-5
    )


def test_force_falls_as_the_edge_slides() -> None:
    """The force along the travel falls from 0 to 10 to 20 to 30°; an edge that does not slide has none along itself."""
    forces = [slid(angle).peak_force for angle in (0.0, 10.0, 20.0, 30.0)]
    assert forces == sorted(forces, reverse=True) and forces[3] < 0.92 * forces[0]
    assert not slid(0.0).history.along_edge.any()


def test_force_along_the_travel_does_the_work() -> None:
    """∫ F du of the force along the travel is the work of the blade; the balance is that of a straight cut."""
    result = slid(30.0)
    curve = result.history
    travelled = np.diff(curve.travel, prepend=curve.travel[0])
    assert result.severed and result.cutting_energy == pytest.approx(float(curve.force @ travelled), rel=2e-3)
    assert result.energy_drift_percent < 0.1 and result.contact_energy_percent > 0.0
