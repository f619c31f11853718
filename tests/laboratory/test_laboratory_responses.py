"""Responses read from known curves."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import material, piece

from stemcal.fem.contact import Tool
from stemcal.laboratory import RadialCompression, build, secant
from stemcal.laboratory.parts import plate, roller
from stemcal.laboratory.result import Gauges, _distance


def test_a_secant_is_the_line_between_its_shares() -> None:
    """Soft up to 10 N, then 20 N/mm up to 60 N, then 5 N/mm up to 100 N: between 20 and 50 % it is 20 N/mm."""
    travel = np.linspace(0.0, 12.0, 2401)
    force = np.interp(travel, [0.0, 1.5, 4.0, 12.0], [0.0, 10.0, 60.0, 100.0])
    line = secant(travel, force, (0.2, 0.5))
    assert line is not None
    assert line.slope == pytest.approx(20.0, rel=1e-9)
    assert line.r2 == pytest.approx(1.0, rel=1e-9)
    bent = secant(travel, force, (0.0, 1.0))
    assert bent is not None
    assert bent.r2 < 0.98


def test_too_few_rows_have_no_slope() -> None:
    assert secant(np.array([0.0, 1.0]), np.array([0.0, 1.0]), (0.2, 0.5)) is None


@pytest.mark.parametrize("tool", [roller(3.0, 2.0, 0.0, 1.0), plate(3.0, 10.0, upwards=False, speed=0.0)])
def test_distances_from_tools(tool: Tool) -> None:
    """2 mm above a roller's axis at (3, 1), and 0.25 mm into a plate whose face is at z = 3."""
    point = np.array([[3.0, 3.0 if tool.radius == 2.0 else 3.25]]) - [0.0, tool.height]
    depth = tool.radius - float(_distance(np.array(tool.corners), point)[0])
    assert depth == pytest.approx(0.002 if tool.radius == 2.0 else 0.25, abs=1e-9)


def test_the_give_of_the_contact_is_taken_out() -> None:
    """Nodes 0.01 mm deep in both plates: the travel of the stem is 0.02 mm less than that of the plate."""
    from stemcal.fem.state import start

    test = piece(RadialCompression(), material(), 4.0, 0.1, 0.5, through_wall=2, coarsening_around=2.0)
    model = build(test)
    gauges, state = Gauges(test, model), start(model)
    state.tools.height[:] += [-0.01, 0.01]
    gauges(0.0, state)
    assert gauges.give == [pytest.approx(0.02, rel=1e-6)]
