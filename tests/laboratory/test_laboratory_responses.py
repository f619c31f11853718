"""Responses read from known curves."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from called import called
from pieces import material, piece

from stemcal.errors import SimulationFailed
from stemcal.fem.kernels.contact import push_skin_out
from stemcal.fem.kernels.search import list_near_skin
from stemcal.fem.state import start
from stemcal.laboratory.build import build_piece
from stemcal.laboratory.perform import Gauges
from stemcal.laboratory.radial_compression import RadialCompression
from stemcal.responses import secant, work_until
from stemcal.solvers import laboratory_runs


def test_a_secant_is_the_line_between_its_shares() -> None:
    """Soft up to 10 N, then 20 N/mm up to 60 N, then 5 N/mm up to 100 N: between 20 and 50 % it is 20 N/mm."""
    travel = np.linspace(0.0, 12.0, 2401)
    force = np.interp(travel, [0.0, 1.5, 4.0, 12.0], [0.0, 10.0, 60.0, 100.0])
    assert secant(travel, force, (0.2, 0.5)) == pytest.approx(20.0, rel=1e-9)


def test_too_few_rows_have_no_slope() -> None:
    assert secant(np.array([0.0, 1.0]), np.array([0.0, 1.0]), (0.2, 0.5)) is None


@pytest.mark.parametrize("known", [True, False])
def test_a_response_that_the_curve_does_not_determine_fails_the_run(
    known: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reason names the test and the response."""
    values = {"slope": 20.0} if known else {}
    performed = SimpleNamespace(with_responses=lambda _: SimpleNamespace(responses=values, warnings=()))
    monkeypatch.setattr(laboratory_runs, "perform_or_fail", lambda _: performed)
    section: Any = SimpleNamespace(name="pull", responses=(), measured=("slope",), called=lambda name: f"pull_{name}")
    if known:
        assert laboratory_runs.perform_all([(section, None)])[0] == {"pull_slope": 20.0}  # type: ignore[list-item]
        return
    with pytest.raises(SimulationFailed, match="pull: the slope cannot be determined") as caught:
        laboratory_runs.perform_all([(section, None)])  # type: ignore[list-item]
    assert caught.value.reason == "no_response"


def test_the_give_of_the_contact_is_taken_out() -> None:
    """Flat plates 0.05 mm deep in a round skin bear over ∝ 1 − s² of their breadth: four fifths of that in the mean.

    The travel of the stem is so much less than that of the plate, on both sides.
    """
    test = piece(RadialCompression(), material(), 4.0, 0.1, 0.25, through_wall=2)
    model = build_piece(test)
    gauges, state = Gauges(test, model), start(model)
    tools, near, body = state.tools, state.candidates, state.body
    tools.height[:] += [-0.05, 0.05]
    called(list_near_skin)(near, state.topology, tools, body.x, 0.0)
    still = np.zeros_like(body.x)
    called(push_skin_out)(tools, near.skin, near.skin_counts, body.x, still, body.pushes, 1e-6, 1e-6, state.friction)
    gauges(0.0, state)
    assert gauges.deflection == [pytest.approx(0.08, rel=0.02)]
    for skin in np.unique(tools.skin[:, :4])[::7]:  # what falls to the faces around a node is all of its mass
        assert tools.skin_mass[tools.skin[:, :4] == skin].sum() == pytest.approx(body.mass[skin], rel=1e-12)


def test_work_is_the_integral_from_first_touch() -> None:
    """W = ½·10·1.5² of F = 10 u."""
    assert work_until([-1.0, 0.0, 1.0, 2.0], [0.0, 0.0, 10.0, 20.0], 1.5) == 11.25
