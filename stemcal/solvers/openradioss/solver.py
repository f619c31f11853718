"""A run of OpenRadioss from beginning to end: deck, starter, engine, time histories, peak force."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from stemcal.measured.curve_modes import CurveModes
from stemcal.outputs import write_output
from stemcal.run_warnings import nothing_deleted
from stemcal.solvers.deck import Deck, deck_text
from stemcal.solvers.deck.form import form_of
from stemcal.solvers.openradioss.failure_reasons import (
    engine_ran,
    read_as_written,
    table_made,
    text_left,
)
from stemcal.solvers.openradioss.files import (
    DECK,
    ENGINE_INPUT,
    HISTORY,
    STARTER_INPUT,
    engine_text,
    starter_text,
)
from stemcal.solvers.openradioss.installation import Installation, installation, program_version
from stemcal.solvers.openradioss.listing import (
    contact_force,
    deleted_elements,
    deletes_elements,
)
from stemcal.solvers.programs.inputs import Inputs
from stemcal.solvers.programs.peak import peak_answer
from stemcal.solvers.programs.program_base import Program, run_in
from stemcal.solvers.programs.readers import read_text
from stemcal.solvers.programs.reductions import NoResult
from stemcal.solvers.programs.run_folders import OUTPUT
from stemcal.solvers.protocol import Answer, Request
from stemcal.solvers.time_limited_program import Ended
from stemcal.study.model import LoadingSection, OpenRadiossSolver

_LEAST_SECONDS = 2.0  # for each program, also after one that took all of the time


class _Step(NamedTuple):
    """One program of a run: its name, command, and what raises `NoResult` if it ended badly."""

    name: str
    command: Sequence[str]
    check: Callable[[Ended], None]


@dataclass(frozen=True)
class OpenRadioss(Program):
    """Answers requests by OpenRadioss; see `study.outside.OpenRadiossSolver`."""

    revision: ClassVar[int] = 6

    @property
    def options(self) -> OpenRadiossSolver:
        """What the spec says of OpenRadioss."""
        assert isinstance(self.study.solver, OpenRadiossSolver)
        return self.study.solver

    def prepare(self) -> None:
        """Refuse to begin if a program is not there."""
        self._installation()

    def _installation(self) -> Installation:
        return installation(self.options, self.study.source.parent)

    def _inputs(self) -> Inputs:
        return Inputs.of([], self.options.files)

    def _determining(self, request: Request) -> dict[str, Any]:
        dump = self.study.model_dump(mode="json")
        apart = {"home", "starter", "engine", "th_to_csv", "environment", "time_limit", "files", "version", "keep"}
        return {
            "options": self.options.model_dump(mode="json", exclude=apart),
            "model": {name: dump[name] for name in ("specimen", "blade", "supports", "loading", "contact")},
            "material": self.study.parameters(request.levels, request.condition),
        }

    def _write(self, folder: Path, request: Request) -> dict[str, Any]:
        self.inputs.write(folder, {})
        deck = self._deck(request)
        write_output(folder / DECK, deck_text(deck))
        if deck.nonlocal_length > 0.0:
            write_output(folder / STARTER_INPUT, starter_text(deck, DECK))
        return {}

    def _deck(self, request: Request) -> Deck:
        """Return the deck in the form that OpenRadioss reads, without pictures: 50 files for each run."""
        return Deck.of(self.study, request.levels, request.condition, replace(form_of(self.study), pictures=False))

    def _run(self, folder: Path, request: Request) -> Answer:
        deck = self._deck(request)
        given = STARTER_INPUT if deck.nonlocal_length > 0.0 else DECK
        modes = self.study.targets.modes_at(request.condition)
        read = partial(force_of_run, folder, self.options, self.study.loading, modes=modes)
        return run_programs(
            folder, self._installation(), self.options, given, partial(_starter_ran, folder, deck), read
        )


def run_programs(
    folder: Path,
    there: Installation,
    options: OpenRadiossSolver,
    given: str,
    starter_ran: Callable[[Ended], None],
    read: Callable[[Ended], Answer],
) -> Answer:
    """Run starter, engine and ``th_to_csv`` one after the other, in one time limit; then read the force.

    The starter begins with the file `given`; `starter_ran` raises `NoResult` if it went wrong, and leaves the engine
    its input.
    """
    options = options.model_copy(update={"environment": there.environment})
    several = ["-nt", str(options.threads)] if options.threads > 1 else []
    *first, last = (
        _Step("starter", [there.starter, "-i", given, "-np", "1", *several], starter_ran),
        _Step("engine", [there.engine, "-i", ENGINE_INPUT, *several], partial(engine_ran, folder)),
        _Step("th_to_csv", [there.th_to_csv, HISTORY], partial(table_made, folder)),
    )
    seconds: dict[str, float] = {}

    def run(step: _Step, read: Callable[[Ended], Answer]) -> Answer:
        left = max(options.time_limit - sum(seconds.values()), _LEAST_SECONDS)
        answer = run_in(folder, step.command, options, read, left, step.check)
        seconds[step.name] = answer.details.get("program_seconds", 0.0)
        return replace(answer, details={**answer.details, "program_seconds": dict(seconds)})

    try:
        for step in first:
            answer = run(step, lambda _: Answer("ok"))
            if not answer.ok:
                return answer
        answer = run(last, read)
        return replace(answer, details={**answer.details, "program_version": program_version(there)})
    finally:
        _remove_restart_files(folder)


def force_of_run(
    folder: Path,
    options: OpenRadiossSolver,
    loading: LoadingSection,
    ended: Ended | None = None,
    run: str = "run",
    modes: CurveModes | None = None,
) -> Answer:
    """Return the peak force of a finished run of this name, by what its programs have left in `folder`.

    Its curve is scored on the `modes` of those that were measured.
    """
    table, listing = f"{run}T01.csv", text_left(folder, f"{run}_0000.out")
    contact = contact_force(read_text(folder, table), options.interface)
    gone = deleted_elements(read_text(folder, f"{run}_0001.out"), text_left(folder, OUTPUT))
    warnings = [] if deletes_elements(listing) else [nothing_deleted()]
    return peak_answer(contact, options, loading, gone, warnings, modes)


def _starter_ran(folder: Path, deck: Deck, ended: Ended) -> None:
    """Raise `NoResult` unless the starter has read the deck as it was written; then leave the engine its input."""
    read_as_written(folder, deck, ended)
    leave_engine_input(folder, engine_text(deck, "run") if deck.nonlocal_length > 0.0 else None)


def leave_engine_input(folder: Path, text: str | None) -> None:
    """Write the engine's input, by default what the starter has left for it, with the name of our runs."""
    if (folder / ENGINE_INPUT).is_symlink():
        raise NoResult("no_engine_input", f"{ENGINE_INPUT} is a link, which is not written through")
    try:
        engine = read_text(folder, ENGINE_INPUT) if text is None else text
    except NoResult as missing:
        raise NoResult("no_engine_input", f"the starter has left no {ENGINE_INPUT} to go on with: {missing}") from None
    # the starter calls the run after the whole name of the deck, runk; its restart file is run's
    write_output(folder / ENGINE_INPUT, re.sub(r"^/RUN/[^/\r\n]+/", "/RUN/run/", engine, flags=re.MULTILINE))


def _remove_restart_files(folder: Path) -> None:
    """Remove what takes most room and no one reads."""
    for path in folder.glob("run_*.rst"):
        path.unlink(missing_ok=True)
