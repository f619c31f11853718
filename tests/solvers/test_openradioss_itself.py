"""OpenRadioss itself, where one is: its forces against those that the embedded solver computes from the same decks."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from stemcal.solvers import make_solver
from stemcal.solvers.deck import Deck
from stemcal.solvers.deck.as_embedded import as_embedded
from stemcal.solvers.deck.form import form_of
from stemcal.solvers.embedded import simulate
from stemcal.solvers.openradioss.installation import HOME
from stemcal.solvers.protocol import Request
from stemcal.study.reading import load_study

CONFIG = Path(__file__).parents[2] / "configs" / "openradioss.yaml"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(HOME not in os.environ, reason=f"{HOME} names no OpenRadioss"),
]


def test_local_deck_gives_the_force_that_is_foretold() -> None:
    study = load_study(CONFIG)
    faster = study.solver.model_copy(update={"mass_scaling": 4e4, "rate_law": "none"})
    study = study.model_copy(update={"solver": faster})
    levels = {**study.midlevels(), "yield_stress": 18.0, "failure_strain": 0.036}
    answer = make_solver(study).solve(Request("simulate", 0, levels, 8.0))
    assert answer.ok, answer.message
    foretold = simulate(as_embedded(Deck.of(study, levels, 8.0, form_of(study))), {}, 8.0).peak_force
    assert answer.response == pytest.approx(foretold, rel=0.1)
