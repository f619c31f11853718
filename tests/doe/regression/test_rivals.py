"""Kinds of surface side by side: known cross-validation errors, the same folds for all, nothing adopted."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from stemcal.doe.designs.box_behnken import box_behnken
from stemcal.doe.regression.rivals import Comparison, compare_surfaces, require_networks
from stemcal.doe.regression.surface import fit_surface
from stemcal.errors import UsageError

pytest.importorskip("sklearn")
CORNERS = np.array([[a, b] for a in (-1.0, 0.0, 1.0) for b in (-1.0, 0.0, 1.0)])


def compared(x: np.ndarray, y: np.ndarray) -> Comparison:
    found = compare_surfaces(fit_surface(x, y, "abc"[: x.shape[1]]))
    assert found is not None
    return found


def test_the_quadratic_s_errors_are_those_of_press() -> None:
    """Leaving runs out one by one is what PRESS does in closed form."""
    rng = np.random.default_rng(3)
    y = 20.0 + CORNERS @ [3.0, -2.0] + CORNERS[:, 0] ** 2 + rng.normal(0.0, 0.5, 9)
    surface, found = fit_surface(CORNERS, y, "ab"), compared(CORNERS, y)
    quadratic = found.rivals[0]
    assert (quadratic.method, found.folds, found.runs, found.passed_over) == ("quadratic", 9, 9, 0)
    assert quadratic.rms_error == pytest.approx(np.sqrt(surface.press / 9), rel=1e-9)
    assert quadratic.predicted_r2 == pytest.approx(surface.predicted_r2, rel=1e-9)
    assert quadratic.r2 == pytest.approx(surface.r2, rel=1e-9)


def test_what_bends_more_than_a_quadratic_is_predicted_better_by_the_others() -> None:
    """A ridge tanh(4x) on 30 points of a Latin hypercube: the quadratic misses it, the other two do not."""
    rng = np.random.default_rng(0)
    x = np.column_stack([rng.permutation(30), rng.permutation(30)]) / 14.5 - 1.0
    quadratic, process, network = compared(x, 10.0 * np.tanh(4.0 * x[:, 0]) + x[:, 1]).rivals
    assert quadratic.predicted_r2 < 0.92
    assert process.predicted_r2 > 0.99 and network.predicted_r2 > 0.99


def test_runs_of_a_point_are_left_out_together() -> None:
    """Twins differ by 0.2, and so would one predict the other; without both the point is off by more than 1."""
    x = np.vstack([CORNERS, CORNERS])
    y = np.exp(x[:, 0] + 2.0 * x[:, 1]) + np.repeat([0.1, -0.1], 9)
    found = compared(x, y)
    assert (found.folds, found.runs) == (9, 18)
    assert all(rival.largest_error > 1.0 for rival in found.rivals)


def test_a_point_that_the_quadratic_needs_stays_in_every_fit() -> None:
    """Without its centre a Box–Behnken design cannot tell its squares from the mean."""
    x = box_behnken(3, centre_points=1)
    found = compared(x, x[:, 0] + x[:, 1] ** 2 + 0.1 * np.sin(np.arange(13.0)))
    assert (found.folds, found.runs, found.passed_over) == (12, 12, 1)


def test_many_runs_are_left_out_in_ten_parts() -> None:
    x = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 2))
    first, second = (compared(x, x[:, 0] ** 2 + x[:, 1]) for _ in range(2))
    assert first == second and first.folds == 10
    assert first.rivals[0].rms_error < 1e-12


def test_nothing_is_compared_where_nothing_varies() -> None:
    assert compare_surfaces(fit_surface(CORNERS, np.full(9, 3.0), "ab")) is None


def test_a_missing_library_is_named_before_any_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sklearn.neural_network", None)
    with pytest.raises(UsageError, match=r'pip install "stemcal\[compare\]"'):
        require_networks()
