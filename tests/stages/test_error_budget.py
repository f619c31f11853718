"""What the error of the force is made of, source by source, at each diameter."""

from __future__ import annotations

import numpy as np

from stemcal.doe.calibration.misfit import Observation, misfit_of
from stemcal.doe.designs.composite import central_composite
from stemcal.doe.regression.surface import fit_surface
from stemcal.stages.invert.certainty import Measured
from stemcal.stages.invert.result import Certainty
from stemcal.stages.mesh.error_budget import Carried

RUNS = central_composite(2, centre_points=1)
SURFACE = fit_surface(RUNS, 100.0 + RUNS @ [10.0, 3.0], ("x", "y"))


def budget(*observations: Observation) -> list[tuple[float, str, float, float]]:
    means = [Measured(float(place), one.kind, one.measured) for place, one in enumerate(observations)]
    certainty = Certainty.__new__(Certainty)
    rows = Carried(means, misfit_of(observations), None, None, {}, {}, certainty, None).budget()
    return [(row.condition, row.source, row.sd, row.share_percent) for row in rows if row.source == "laboratory"]


def test_each_diameter_has_its_laboratory_once() -> None:
    """Curves at two diameters are known apart; the force without curves takes the scatter of all."""
    observed = [
        Observation(SURFACE, 100.0, 6.0, 9, specimens="7"),
        Observation(SURFACE, 100.0, 3.0, 9, specimens="8"),
        Observation(SURFACE, 100.0, 4.0, 16),
    ]
    rows = budget(*observed)
    assert [(at, name) for at, name, _, _ in rows] == [(0.0, "laboratory"), (1.0, "laboratory"), (2.0, "laboratory")]
    pooled = (8 * 6.0**2 + 8 * 3.0**2 + 15 * 4.0**2) / 31
    np.testing.assert_allclose([sd for _, _, sd, _ in rows], [2.0, 1.0, np.sqrt(pooled / 16)])


def test_a_laboratory_without_scatter_is_told_as_none() -> None:
    rows = budget(Observation(SURFACE, 100.0, 0.0, 9), Observation(SURFACE, 50.0, 2.0, 9, "travel"))
    assert rows[0][:3] == (0.0, "laboratory", 0.0)
    assert len(rows) == 1
