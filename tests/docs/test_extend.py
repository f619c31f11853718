"""The classes on the page about extensions work as printed: known answers."""

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shown import DOCS

from stemcal.doe.designs.catalogue import SurfaceOptions
from stemcal.doe.regression.terms import term_columns
from stemcal.solvers.protocol import Request


@pytest.fixture(scope="module")
def printed() -> dict[str, Any]:
    names: dict[str, Any] = {}
    page = (DOCS / "howto" / "extend.md").read_text("utf-8")
    for block in re.findall(r"```{code-block} python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "extend.md", "exec"), names)
    return names


def test_a_class_returns_its_responses(printed: dict[str, Any]) -> None:
    assert printed["MySolver"]().solve({"shear_strength": 2.0}, 8.0) == {"force": 128.0}


def test_a_kind_of_solver_makes_one_from_its_keys(printed: dict[str, Any]) -> None:
    study = SimpleNamespace(solver=printed["SpringOptions"](stiffness=4.0))
    answer = printed["Spring"]().make(study).solve(Request("rsm", 0, {"stretch": 2.5}, 8.0))
    assert (answer.status, answer.response) == ("ok", 10.0)


@pytest.mark.parametrize("k", [2, 3, 6])
def test_a_design_estimates_a_quadratic(printed: dict[str, Any], k: int) -> None:
    """2^k corners, 2 k points on the axes and the centre, as many as a quadratic has terms or more."""
    coded = printed["Star"]().points(k, SurfaceOptions(centre_points=1))
    assert coded.shape == (2**k + 2 * k + 1, k) and np.linalg.norm(coded[2**k : -1], axis=1) == pytest.approx(1.0)
    assert np.linalg.matrix_rank(term_columns(coded)) == (k + 1) * (k + 2) // 2
