"""A deck with the force that it is to give, and the force that a program gives for it."""

import re
import shutil
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from stemcal.errors import UsageError
from stemcal.files.encodings import lenient
from stemcal.files.plain import MIB, read_plain
from stemcal.outputs import write_output
from stemcal.solvers.deck.settings import settings_of
from stemcal.solvers.lsdyna.solver import force_of_finished_run
from stemcal.solvers.openradioss.failure_reasons import starter_accepted
from stemcal.solvers.openradioss.files import DECK, STARTER_INPUT
from stemcal.solvers.openradioss.installation import installation
from stemcal.solvers.openradioss.solver import force_of_run, leave_engine_input, run_programs
from stemcal.solvers.programs.rcforc import FILE as RCFORC
from stemcal.solvers.programs.reductions import NoResult
from stemcal.solvers.programs.run_folders import discard, run_folder
from stemcal.solvers.protocol import Answer
from stemcal.solvers.time_limited_program import Ended
from stemcal.study.model import LoadingSection, LsDynaSolver, OpenRadiossSolver

_SUFFIXES = (".k", ".key", ".dyn")
_TABLE = "T01.csv"
_MOST_BYTES = 400 * MIB


@dataclass(frozen=True)
class Checked:
    """What a program (`lsdyna` or `openradioss`) answered to a deck, and the force (N) that the deck is to give."""

    deck: Path
    program: str
    force_to_give: float
    answer: Answer

    @property
    def off_percent(self) -> float | None:
        """How far the force is from what it is to be, percent; None where the run failed."""
        force = self.answer.response
        return None if force is None else 100.0 * (force / self.force_to_give - 1.0)


class _Kept(NamedTuple):
    """What a deck keeps for its check: the force to give, the motion of the blade, how the force is filtered."""

    force: float
    loading: LoadingSection
    options: dict[str, float]


def run_deck(deck: Path) -> Checked:
    """Run a deck by the OpenRadioss of this machine.

    Raises
    ------
    UsageError
        If the deck does not say its force, or OpenRadioss is not there.
    """
    if (kept := _kept(deck)) is None:
        raise UsageError(f"{deck} does not say which force it is to give; export material and export deck write such")
    options = OpenRadiossSolver().model_copy(update=kept.options)
    there = installation(options, deck.absolute().parent)
    folder = run_folder(None, {})
    shutil.copyfile(deck, folder / DECK)
    starter, engine = (_renamed(deck.with_name(f"{deck.stem}_000{i}.rad"), deck.stem) for i in (0, 1))
    if starter is not None:
        write_output(folder / STARTER_INPUT, starter)

    def started(ended: Ended) -> None:
        starter_accepted(folder, ended)
        leave_engine_input(folder, engine)

    read = partial(force_of_run, folder, options, kept.loading)
    answer = run_programs(folder, there, options, DECK if starter is None else STARTER_INPUT, started, read)
    if answer.ok:
        discard(folder)
    return Checked(deck, "openradioss", kept.force, answer)


def read_run(folder: Path) -> Checked:
    """Read a finished run of LS-DYNA (``rcforc``) or OpenRadioss (``…T01.csv``) in the folder of its deck.

    Raises
    ------
    UsageError
        If there is not one deck that says its force, or not one finished run.
    """
    decks = [path for path in sorted(folder.iterdir()) if path.suffix in _SUFFIXES and path.is_file()]
    told = {path: kept for path in decks if (kept := _kept(path)) is not None}
    if len(told) != 1:
        names = ", ".join(path.name for path in told) or "none"
        raise UsageError(f"{folder}: one deck that says which force it is to give must lie there; found {names}")
    ((deck, kept),) = told.items()
    tables, is_dyna = sorted(folder.glob(f"*{_TABLE}")), (folder / RCFORC).is_file()
    if is_dyna == bool(tables) or len(tables) > 1:
        found = ", ".join([*([RCFORC] if is_dyna else []), *(path.name for path in tables)]) or "none"
        raise UsageError(
            f"{folder}: one finished run must lie there, found {found}; LS-DYNA leaves {RCFORC}, and of OpenRadioss's "
            f"{deck.stem}T01 the program th_to_csv makes {deck.stem}{_TABLE}"
        )
    try:
        if is_dyna:
            of_dyna = LsDynaSolver(command=("ls-dyna",)).model_copy(update=kept.options)
            answer = force_of_finished_run(folder, of_dyna, kept.loading)
        else:
            options, run = OpenRadiossSolver().model_copy(update=kept.options), tables[0].name.removesuffix(_TABLE)
            answer = force_of_run(folder, options, kept.loading, run=run)
    except NoResult as missing:
        answer = Answer("failed", reason=missing.reason, message=f"{missing} ({folder})")
    return Checked(deck, "lsdyna" if is_dyna else "openradioss", kept.force, answer)


def _kept(deck: Path) -> _Kept | None:
    """Return what a deck keeps for its check; None of one that does not say its force."""
    kept = settings_of(_text(deck))
    if kept.force_to_give is None or kept.speed is None:
        return None
    options = {"filter_window": kept.filter_window, "break_drop": kept.break_drop}
    return _Kept(
        kept.force_to_give,
        LoadingSection().model_copy(update={"speed": kept.speed, "gap": kept.gap}),
        {name: value for name, value in options.items() if value is not None},
    )


def _renamed(path: Path, own: str) -> str | None:
    """Return one of OpenRadioss's files beside a deck with the name of our runs in place of its own, if it is there."""
    if not path.is_file():
        return None
    return re.sub(rf"^{re.escape(own)}(?=(\.k)?$)", Path(DECK).stem, _text(path), flags=re.MULTILINE)


def _text(path: Path) -> str:
    return lenient(read_plain(path, _MOST_BYTES))
