"""OpenRadioss itself, where one is: its forces against those that the embedded solver computes from the same decks."""

import os
from pathlib import Path

import pytest
from deck_as_embedded import as_embedded

from stemcal.solvers import make_solver
from stemcal.solvers.deck import Deck
from stemcal.solvers.deck.keywords import form_of
from stemcal.solvers.deck.openradioss import HOME
from stemcal.solvers.embedded import simulate_levels
from stemcal.solvers.options import DeckSolver, EmbeddedSolver
from stemcal.solvers.protocol import Request
from stemcal.study.model.study import Study
from stemcal.study.reading import load_study

CONFIG = Path(__file__).parents[2] / "configs" / "openradioss.yaml"
pytestmark = [pytest.mark.slow, pytest.mark.skipif(HOME not in os.environ, reason=f"{HOME} names no OpenRadioss")]


def foretold_and_given(study: Study, diameter: float, **levels: float) -> tuple[float, float]:
    """Return the force that a deck is to give and the one that OpenRadioss gives, N."""
    levels = {**study.midlevels(), **levels}
    answer = make_solver(study).solve(Request("simulate", 0, levels, diameter))
    assert answer.ok, answer.message
    assert answer.details["program_version"]
    deck = Deck.of(study, levels, diameter, form_of(study))
    return simulate_levels(as_embedded(deck), {}, diameter).peak_force, answer.response or 0.0


@pytest.mark.parametrize("law", ["none", "cowper_symonds"])
def test_local_deck_gives_the_force_that_is_foretold(law: str) -> None:
    study = load_study(CONFIG)
    faster = study.solver.model_copy(update={"mass_scaling": 4e4, "rate_law": law})
    study = study.model_copy(update={"solver": faster})
    foretold, given = foretold_and_given(study, 8.0, yield_stress=18.0, failure_strain=0.036)
    assert given == pytest.approx(foretold, rel=0.06)  # the worst of sixteen decks


def test_deck_with_lengths_gives_the_force_that_is_foretold() -> None:
    """The deck as `export deck --for openradioss` writes it, run for a shorter stroke on a coarser mesh."""
    spec, coarse = CONFIG.with_name("wild-chrysanthemum-as-published.yaml"), {"coarsening": 10, "coarsening_around": 3}
    study = load_study(spec, solver=coarse, loading={"duration": "0.36 s"})
    names = DeckSolver.model_fields.keys() & EmbeddedSolver.model_fields.keys() - {"kind", "hourglass"}
    same = {name: getattr(study.solver, name) for name in names}
    there = DeckSolver(program="openradioss", nonlocal_failure=True, time_limit=36000.0).model_copy(update=same)
    study = study.model_copy(update={"solver": there})
    foretold, given = foretold_and_given(study, 8.0, yield_stress=12.0, failure_strain=0.02)
    assert given == pytest.approx(foretold, rel=0.1)
