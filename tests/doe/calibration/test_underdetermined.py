"""Fewer measured means than factors: of all points that fit, the one nearest to the centre."""

from __future__ import annotations

import numpy as np
import pytest

from stemcal.doe.calibration.joint_fit import fit_jointly
from stemcal.doe.calibration.misfit import Observation, misfit_of
from stemcal.doe.calibration.search_region import Region
from stemcal.doe.designs.catalogue import central_composite
from stemcal.doe.regression.surface import fit_surface


def test_two_planes_over_three_factors() -> None:
    """a + b + c = 1.2 and a − b = 0.4: the nearest point to the origin is (0.6, 0.2, 0.4)."""
    design = np.asarray(central_composite(3))
    laws = [(design.sum(axis=1), 1.2), (design[:, 0] - design[:, 1], 0.4)]
    surfaces = [(fit_surface(design, 10.0 + values, ("a", "b", "c")), 10.0 + wanted) for values, wanted in laws]
    observed = [Observation(surface, mean, 0.1, 5, str(i)) for i, (surface, mean) in enumerate(surfaces)]
    fit = fit_jointly(misfit_of(observed), Region(np.full(3, -1.682), np.full(3, 1.682), 1.682))
    assert fit.coded == pytest.approx([0.6, 0.2, 0.4], abs=1e-5)
    assert fit.errors_percent == pytest.approx([0.0, 0.0], abs=1e-5) and fit.df == -1
