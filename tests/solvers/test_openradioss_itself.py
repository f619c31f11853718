"""OpenRadioss itself, where one is: its forces against those that the embedded solver computes from the same decks."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from stemcal.cli.app import app
from stemcal.solvers import make_solver
from stemcal.solvers.check_deck import run_deck
from stemcal.solvers.deck import Deck
from stemcal.solvers.deck.as_embedded import as_embedded
from stemcal.solvers.deck.form import form_of
from stemcal.solvers.embedded import simulate
from stemcal.solvers.openradioss.installation import HOME
from stemcal.solvers.protocol import Request
from stemcal.study.model import Study
from stemcal.study.reading import load_study

CONFIG = Path(__file__).parents[2] / "configs" / "openradioss.yaml"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(HOME not in os.environ, reason=f"{HOME} names no OpenRadioss"),
]


def foretold_and_given(study: Study, diameter: float, **levels: float) -> tuple[float, float]:
    """Return the force that a deck is to give and the one that OpenRadioss gives, N."""
    levels = {**study.midlevels(), **levels}
    answer = make_solver(study).solve(Request("simulate", 0, levels, diameter))
    assert answer.ok, answer.message
    assert answer.details["program_version"]
    deck = Deck.of(study, levels, diameter, form_of(study))
    return simulate(as_embedded(deck), {}, diameter).peak_force, answer.response or 0.0


@pytest.mark.parametrize("law", ["none", "cowper_symonds"])
def test_local_deck_gives_the_force_that_is_foretold(law: str) -> None:
    study = load_study(CONFIG)
    faster = study.solver.model_copy(update={"mass_scaling": 4e4, "rate_law": law})
    study = study.model_copy(update={"solver": faster})
    foretold, given = foretold_and_given(study, 8.0, yield_stress=18.0, failure_strain=0.036)
    assert given == pytest.approx(foretold, rel=0.06)  # the worst of sixteen decks


def test_deck_with_lengths_gives_the_force_that_is_foretold_and_is_verified(tmp_path: Path) -> None:
    """The deck as `export deck --for openradioss` writes it, with its force in its comments, run by its path."""
    spec, deck = CONFIG.with_name("wild-chrysanthemum.yaml"), tmp_path / "run.k"
    options = ["--for", "openradioss", "--set", "yield_stress=12", "--set", "failure_strain=0.02"]
    text = spec.read_text("utf-8")
    cheaply = {"coarsening: 6 ": "coarsening: 10 ", "around: 2 ": "around: 3 ", "duration: 0.5 s": "duration: 0.36 s"}
    for given, cheaper in cheaply.items():
        assert text.count(given) == 1
        text = text.replace(given, cheaper)
    (tmp_path / "quicker.yaml").write_text(text, encoding="utf-8")
    assert (
        CliRunner().invoke(app, ["export", "deck", str(tmp_path / "quicker.yaml"), *options, str(deck)]).exit_code == 0
    )
    found = run_deck(deck)
    assert found.off_percent is not None, found.answer.message
    assert abs(found.off_percent) < 10.0
