"""Why a run of OpenRadioss gives no force: what starter, engine and ``th_to_csv`` may leave, as reasons."""

import re
from pathlib import Path

from stemcal.solvers.deck import Deck
from stemcal.solvers.deck.writer import STEM
from stemcal.solvers.openradioss.files import ENGINE_LISTING, HISTORY, STARTER_LISTING, TABLE
from stemcal.solvers.openradioss.listing import differences, is_normal_end, problems
from stemcal.solvers.programs.program_base import code_is_zero
from stemcal.solvers.programs.readers import read_text
from stemcal.solvers.programs.reductions import NoResult
from stemcal.solvers.time_limited_program import Ended


def starter_accepted(folder: Path, ended: Ended) -> str:
    """Return the starter's listing; raise `NoResult` if it tells of errors."""
    listing = text_left(folder, STARTER_LISTING)
    found = problems(listing) or problems(ended.output)
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise NoResult("starter_error", f"the starter refused the deck: {found[0]}{more}")
    code_is_zero(ended)
    return listing


def read_as_written(folder: Path, deck: Deck, ended: Ended) -> None:
    """Raise `NoResult` unless the starter has read the deck's material as it was written."""
    wrong = differences(starter_accepted(folder, ended), STEM, deck.material, deck.nonlocal_length)
    if wrong:
        raise NoResult("not_as_written", f"the starter read another material than was written: {'; '.join(wrong)}")


def engine_ran(folder: Path, ended: Ended) -> None:
    """Raise `NoResult` unless the engine came to its normal end."""
    said = f"{text_left(folder, ENGINE_LISTING)}\n{ended.output}"
    if missing := re.search(r"ERROR: FILE (\S+) NOT FOUND", said):
        raise NoResult("no_restart", f"the engine found no {missing[1]}: the starter's restart file is not there")
    if ended.code == 0 and is_normal_end(said):
        return
    if "ERROR TERMINATION" in said:
        wrong = [line.strip() for line in said.splitlines() if "** ERROR" in line]
        raise NoResult("engine_error", f"the engine stopped with an error{f': {wrong[0][:200]}' if wrong else ''}")
    code_is_zero(ended)
    raise NoResult("no_termination", "the engine did not say that it came to its normal end")


def table_made(folder: Path, ended: Ended) -> None:
    """Raise `NoResult` unless there is a table of the time histories."""
    if ended.code != 0 or not (folder / TABLE).is_file():
        because = "" if (folder / HISTORY).is_file() else f": the engine has left no {HISTORY}"
        raise NoResult("no_history", f"th_to_csv ended with code {ended.code} and no table{because}")


def text_left(folder: Path, name: str) -> str:
    """Return a text file of the run, empty if there is none."""
    try:
        return read_text(folder, name)
    except NoResult:
        return ""
