"""What the embedded solver says of itself, without a simulation."""

from __future__ import annotations

from pathlib import Path

from stemcal.solvers import make_solver
from stemcal.solvers.protocol import Belonging
from stemcal.study.spec import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


def test_calibrated_values_belong_to_lengths() -> None:
    """Shares of the diameter and what they come to at 8 mm: 8/16, 8/8 and 8/4.5 mm."""
    solver = make_solver(load_study(CONFIGS / "wild-chrysanthemum.yaml"))
    assert isinstance(solver, Belonging)
    assert solver.belongings(8.0) == {
        "element_size": "d/16 (0.5 mm)",
        "edge_spread": "d/8 (1 mm)",
        "internal_length": "d/4.5 (1.78 mm)",
    }
