"""The files of a run of OpenRadioss, and its own ones around a deck: for what its reader of decks does not convert."""

from collections.abc import Iterable

from stemcal.solvers.deck.model import Deck
from stemcal.solvers.deck.writer import STEM

# Files of a run: all are named after the deck.
DECK, STARTER_LISTING, ENGINE_INPUT, ENGINE_LISTING, HISTORY, TABLE = (
    *("run.k", "run_0000.out", "run_0001.rad", "run_0001.out"),
    *("runT01", "runT01.csv"),
)
STARTER_INPUT = "run_0000.rad"  # around the deck, where that alone does not say all
# Without it the time histories have no titles, and th_to_csv leaves impulses instead of forces.
TITLES = "/TH/TITLE"


def starter_text(deck: Deck, name: str) -> str:
    """Return the starter's file that includes the deck of a file `name` (run.k)."""
    return starter_around(name, deck.nonlocal_length)


def starter_around(name: str, nonlocal_length: float, further: Iterable[str] = ()) -> str:
    """Return the starter's file around any deck, with `further` lines; a length (mm) makes the failure nonlocal."""
    length = (f"/NONLOCAL/MAT/{STEM}", f"#{'LENGTH':>19}{'LE_MAX':>20}", f"{nonlocal_length!r:>20}{0:>20}")
    averaging = length if nonlocal_length > 0.0 else ()
    units = f"{'Mg':>20}{'mm':>20}{'s':>20}"
    return "\n".join(
        [
            "#RADIOSS STARTER",
            "/BEGIN",
            name.rpartition(".")[0] or name,
            f"{2022:10d}{0:10d}",
            units,
            units,
            "/INCLUDE_LS-DYNA/",
            name,
            *averaging,
            *further,
            "/END",
            "",
        ]
    )


def engine_text(deck: Deck, run: str) -> str:
    """Return the engine's file of a run: the whole stroke in the elements' own time step, and its outputs."""
    seconds = deck.study.loading.duration_at(deck.diameter)
    return engine_over(run, seconds, deck.solver.outputs, deck.solver.time_step_safety)


def engine_over(run: str, duration: float, outputs: int, safety: float) -> str:
    """Return the engine's file of a run: its duration in s, its outputs, its part of the stable step."""
    return "\n".join(
        [
            f"/RUN/{run}/1/",
            f"{duration!r}",
            "/TFILE/4",
            f"{duration / outputs!r}",
            "/DT",
            f"{safety!r} 0",
            "/PARITH/OFF",
            TITLES,
            "/PRINT/-1000",
            "",
        ]
    )
