"""A deck as a study of the embedded solver, to compare the deck with a known answer."""

from stemcal.solvers.deck import Deck
from stemcal.solvers.deck.model import HOURGLASS
from stemcal.solvers.options import EmbeddedSolver
from stemcal.study.model.study import Study
from stemcal.study.types.factor import PARAMETERS
from stemcal.study.types.field_types import Length


def as_embedded(deck: Deck) -> Study:
    """Return the study with which the embedded solver computes the deck's own model: its mesh, edge, law and lengths.

    Nothing in it is a factor. What is symmetric is mirrored, which changes no force but for rounding.
    """
    study, values = deck.study, dict(zip(PARAMETERS, deck.card.values(), strict=True))
    # a nose and a program's nonlocal length represent the study's own lengths; without them there are none
    lengths = {} if deck.form.lengths else {"internal_length": Length(0.0)}
    edge = {} if deck.form.lengths else {"edge_spread": Length(0.0)}
    return study.model_copy(
        update={
            "factors": (),
            "material": study.material.model_copy(update=values | lengths),
            "blade": study.blade.model_copy(update=edge),
            "solver": _solver(deck, "cowper_symonds" if deck.material["c"] > 0.0 else "none"),
        }
    )


def _solver(deck: Deck, rate_law: str) -> EmbeddedSolver:
    """Return the embedded solver with the deck's mesh and time step."""
    given, same = deck.solver, {"rate_law": rate_law}
    if isinstance(given, EmbeddedSolver):
        return given.model_copy(update={**same, "replicates": None})
    names = "element_size", "elements_through_wall", "mass_scaling", "time_step_safety", "outputs", "filter_window"
    taken = {name: getattr(given, name) for name in names}
    local = {"edge_over": "elements", "coarsening": 1.0, "coarsening_around": 1.0, "hourglass": HOURGLASS}
    return EmbeddedSolver().model_copy(update={**same, **taken, **local, "time_step": None})
