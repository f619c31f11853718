"""Runs done by hand: which a study waits for, the sheet of them in its folder, and the results entered from a sheet.

Every row is checked; the right ones are recorded like any other run, with who entered them and when, the others refused
with a reason. A result that is there already is never overwritten by another without a reason; the log of the study
has both.
"""

import getpass
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from stemcal.by_hand.row_checks import RowRefused, by_name, first_of, meant_run, result_in
from stemcal.by_hand.run_sheet import (
    FAILED,
    MAX_BYTES,
    REMARK,
    STUDY,
    WHEN,
    WHO,
    Filled,
    SheetRow,
    entered_responses,
    filled,
    narrow,
    run_name,
    sheet_text,
)
from stemcal.errors import StemcalError, UsageError, Waiting
from stemcal.overview.plan import asked, missing
from stemcal.overview.status import SHEET, ledger
from stemcal.runs.answer import Watch, ignore, keep
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import Run, by_key, stands
from stemcal.runs.study_folder import StudyFolder, provenance
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.replicates import seed_of
from stemcal.stages.fresh import make
from stemcal.stages.stage import stage_called, stages_of
from stemcal.storage.atomic import make_folder, move_new, write_atomic
from stemcal.storage.log import now
from stemcal.storage.plain import read_plain
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

_SAME = 1e-9  # of a value: what writing and reading may change
OLD, INPUTS = "sheets", "inputs"


def gone_on(study: Study, folder: StudyFolder, watch: Watch = ignore) -> Waiting | None:
    """Take a study through its stages as far as its results allow; return what it waits for, None at the end.

    Raises
    ------
    StemcalError
        Any error of a stage that further results cannot correct.
    """
    try:
        for stage in stages_of(study):
            make(stage, study, folder, InlineExecutor(), watch)
    except Waiting as waiting:
        return waiting
    return None


def awaited_runs(study: Study, folder: StudyFolder, waiting: Waiting) -> list[Request]:
    """Return the runs without results: all that the waiting stage will ask for, if that is known already.

    Where equal runs may differ they are in random order, so that no drift is taken for an effect.
    """
    study = stage_called(waiting.stage).seen(study)
    solver = make_solver(study)
    wanted = by_key(solver, waiting.requests)
    for part in asked(study, solver, folder):
        left = by_key(solver, missing(part, study, solver, folder))
        if part.stage == waiting.stage and part.settled and wanted.keys() <= left.keys():
            wanted = left
    rows = list(wanted.values())
    if study.solver.repeats:
        rows.sort(key=lambda row: seed_of(row))
    return rows


def _known_runs(study: Study, folder: StudyFolder, waiting: Waiting | None) -> dict[str, Request]:
    """Return by their keys the runs whose results may be entered: those that are awaited, and those that have some."""
    elsewhere = {stage.name for stage in stages_of(study) if stage.seen(study) is not study}
    there = study.by_hand is not study
    solver = make_solver(study.by_hand)
    awaited = () if waiting is None else waiting.requests
    asked_for = [entry.request for entry in ledger(study, folder) if (entry.stage in elsewhere) is there]
    return by_key(solver, (*awaited, *asked_for))


class OwnSheet:
    """The run sheet in the study folder. Whatever was saved to it is entered before another sheet replaces it.

    The folder must be locked.
    """

    def __init__(self, study: Study, folder: StudyFolder) -> None:
        self.study, self.folder, self.path = study, folder, folder.path / SHEET
        self.earlier: Path | None = None
        """The place of the sheet that was replaced."""
        self._entered: bytes | None = None

    def enter_saved(self) -> bool:
        """Enter the results that were saved since the last call; return whether any is new.

        Raises
        ------
        UsageError
            If rows are rejected; the sheet stays where it is.
        """
        content = self._saved(self.path)
        if content is None or content == self._entered:
            return False
        found = enter(self.study, self.folder, filled(content, str(self.path), self.study.by_hand))
        found.require_all()
        self._entered = content
        return bool(found.taken or found.replaced)

    def hand_out(self, waiting: Waiting) -> int:
        """Write a sheet with the results that were entered and a row for each awaited run; return their number.

        It is 0 if the present sheet was saved after it was last entered: the study can then continue.
        """
        if self.enter_saved():
            return 0
        study, runs = self.study, awaited_runs(self.study, self.folder, waiting)
        remarks = self._remarks(runs)
        rows: list[SheetRow] = [*_entered(study, self.folder, runs), *zip(runs, remarks, strict=True)]
        if not self._replace(sheet_text(study.by_hand, rows)):
            return self.hand_out(waiting)
        solver = make_solver(study.by_hand)
        for name, request in _named(study.by_hand, runs):
            solver.write_inputs(self.folder.path / INPUTS, name, request)
        return len(runs)

    def _saved(self, path: Path) -> bytes | None:
        try:
            return read_plain(path, MAX_BYTES)
        except FileNotFoundError:
            return None

    def _replace(self, text: str) -> bool:
        """Put the present sheet aside and write another; False if it has been saved since it was entered.

        A program may save the sheet at any moment, so it is first moved, then compared with what was entered.
        """
        if self._entered == text.encode() == self._saved(self.path):
            return True
        stamp = f"{datetime.now(UTC):%Y%m%dT%H%M%S%f}"
        earlier = make_folder(self.folder.path / OLD) / f"{stamp}-{SHEET}"
        try:
            self.path.replace(earlier)
        except FileNotFoundError:
            return write_atomic(self.path, text, new=True)
        self.earlier = earlier
        if self._saved(earlier) != self._entered:
            move_new(earlier, self.path)  # unless it has been saved once more
            return False
        return write_atomic(self.path, text, new=True)

    def _remarks(self, runs: Sequence[Request]) -> list[dict[str, str | float]]:
        """Return who, when and remark of each run in the present sheet, where the run has no result yet."""
        study, solver, named = self.study.by_hand, make_solver(self.study.by_hand), by_name(runs)
        found: dict[str, dict[str, str | float]] = {}
        for row in filled(self._entered, str(self.path), study) if self._entered else []:
            with suppress(RowRefused):
                said = {name: text for name, text in row.said.items() if name != STUDY and row.is_empty}
                found[Run.of(solver, meant_run(study, named, row)).key] = {**said}
        return [found.get(Run.of(solver, run).key, {}) for run in runs]


def _entered(study: Study, folder: StudyFolder, awaited: Sequence[Request]) -> Iterator[SheetRow]:
    """Yield the runs whose results were entered, with these."""
    solver = make_solver(study.by_hand)
    left = by_key(solver, awaited)
    for key, run in _known_runs(study, folder, None).items():
        record = folder.peek(key) if key not in left else None
        if record is not None and "entered" in record["details"]:
            yield run, _known(study.by_hand, record)


def _known(study: Study, record: dict[str, Any]) -> dict[str, str | float]:
    """Return what a record has for the columns of the sheet."""
    details, first = record["details"], entered_responses(study)[0].name
    said = {WHO: details.get("entered_by", ""), WHEN: details.get("done", ""), REMARK: details.get("remark", "")}
    if record["status"] != "ok":
        return said | {REMARK: f"{FAILED}: {record['message']}"}
    return {**said, first: record[FIRST], **details.get(RESPONSES, {})}


def _named(study: Study, runs: Sequence[Request]) -> Iterator[tuple[str, Request]]:
    """Yield the folder of each run's input files, called by its run, its condition and its replicate.

    No name has a space: decks include files by their paths, and not all programs read a path with spaces.
    """
    several = len({run.condition for run in runs}) > 1
    for run in runs:
        at = f"-at-{run.condition:g}" if several else ""
        replicate = f"-replicate-{run.replicate}" if study.solver.repeats > 1 else ""
        yield f"{run_name(run).replace(' ', '-')}{at}{replicate}", run


# ---- entering


@dataclass(frozen=True)
class Entered:
    """The names of the runs that were taken, were known already, were replaced; the rows that were refused."""

    taken: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    replaced: tuple[str, ...] = ()
    refused: tuple[RowRefused, ...] = ()

    def summary(self) -> str:
        """Return how many results were accepted."""
        said = [f"Results accepted: {len(self.taken)}."]
        if self.known:
            said.append(f"Results already recorded: {len(self.known)}.")
        if self.replaced:
            said.append(f"Results replaced: {len(self.replaced)} ({', '.join(self.replaced)}).")
        return " ".join(said)

    def require_all(self) -> None:
        """Raise `UsageError` with the rows that were refused; the others stay recorded."""
        if self.refused:
            were = "row was" if len(self.refused) == 1 else "rows were"
            head = f"{len(self.refused)} {were} rejected; correct the sheet, then enter the results again."
            raise UsageError("\n".join([head, *first_of(list(map(str, self.refused)))]))


@dataclass(frozen=True)
class _Result:
    """A row that is right by itself."""

    filled: Filled
    request: Request
    answer: Answer


def enter(study: Study, folder: StudyFolder, sheet: Sequence[Filled], *, replace_because: str = "") -> Entered:
    """Record the results of a sheet; the folder must be locked.

    Correct rows are accepted even if others are rejected. A row without a name is recorded with that of the user.

    Parameters
    ----------
    replace_because : str
        Why results may replace others; empty: they may not.

    Raises
    ------
    UsageError
        If the study's solver is no sheet, or a row is of another study.
    """
    require_sheet(study)
    seen, rows = study.by_hand, [row for row in sheet if not row.is_empty]
    for row in rows:
        if row.said.get(STUDY) and row.said[STUDY] != narrow(study.name):
            raise UsageError(f"{row.place}: the sheet is for the study {row.said[STUDY]!r}, not for {study.name!r}")
    try:
        waiting = gone_on(study, folder) if rows else None
    except StemcalError:  # results may be the remedy; if not, it is reported when the study continues
        waiting = None
    solver, refused = make_solver(seen), list[RowRefused]()
    found: dict[str, list[str]] = {"taken": [], "known": [], "replaced": []}
    runs = by_name(_known_runs(study, folder, waiting).values() if rows else ())
    for key, (first, *others) in _by_run(seen, solver, runs, rows, refused).items():
        if other := next((one for one in others if not _agree(one.answer, first.answer)), None):
            refused += [_told_twice(first.filled, other.filled), _told_twice(other.filled, first.filled)]
            continue
        try:
            sort = _against_record(first, folder.load(key), study, replace_because)
        except RowRefused as one:
            refused.append(one)
            continue
        found[sort].append(run_name(first.request))
        if sort != "known":
            _record(key, first, solver, folder, replace_because)
    return Entered(**{sort: tuple(names) for sort, names in found.items()}, refused=tuple(refused))


def require_sheet(study: Study) -> None:
    """Raise `UsageError` if the solver answers by itself."""
    if study.by_hand.kind.answers != "asks_people":
        kind = study.by_hand.solver.kind
        raise UsageError(
            f"solver.kind: the `{kind}` solver computes all runs; to enter results by hand, write "
            "`solver: {kind: sheet}`"
        )


def _user_name() -> str:
    """Return the name of the user, nothing if the system has none."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""


def _by_run(
    study: Study,
    solver: Solver,
    runs: Mapping[str, Sequence[Request]],
    sheet: Sequence[Filled],
    refused: list[RowRefused],
) -> dict[str, list[_Result]]:
    """Return the rows that are right by themselves by the keys of their runs; the others are added to `refused`."""
    found: dict[str, list[_Result]] = {}
    for row in sheet:
        try:
            if row.broken:
                raise RowRefused(row, "broken_row", row.broken)
            request = meant_run(study, runs, row)
            result = _Result(row, request, result_in(study, row))
        except RowRefused as one:
            refused.append(one)
            continue
        found.setdefault(Run.of(solver, request).key, []).append(result)
    return found


def _told_twice(row: Filled, other: Filled) -> RowRefused:
    return RowRefused(row, "told_twice", f"{row.run} has a different result at {other.place}; delete the wrong row")


# ---- against what is known


def _against_record(
    result: _Result, record: Mapping[str, Any] | None, study: Study, because: str
) -> Literal["taken", "known", "replaced"]:
    """Return whether a result is new, known or replaces another; refuse one that is known otherwise."""
    filled = result.filled
    before = None if record is None or not stands(record, study.by_hand.solver.run_limit) else _answer_in(record)
    if before is None or record is None:
        return "taken"
    if _agree(before, result.answer):
        return "known"
    if because or (not before.ok and result.answer.ok):
        return "replaced"
    told = [str(record["details"].get(name, ""))[:16] for name in ("entered", "entered_by")]
    raise RowRefused(
        filled,
        "known_otherwise",
        f"{filled.run} already has the result {_said(before)} ({' '.join(told).strip()}), but the new "
        f"result is {_said(result.answer)}; to replace the result, enter the sheet again with `--replace REASON`",
    )


def _answer_in(record: Mapping[str, Any]) -> Answer:
    return Answer(**{name: record[name] for name in ("status", FIRST, "reason", "message", "details")})


def _agree(one: Answer, other: Answer) -> bool:
    """Whether two results are the same, of every response."""
    if not (one.ok and other.ok):
        return (one.ok, one.reason) == (other.ok, other.reason)
    pairs = zip(_values(one), _values(other), strict=True)
    return all(math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12) for a, b in pairs)


def _values(answer: Answer) -> list[float]:
    return [answer.response or 0.0, *answer.details.get(RESPONSES, {}).values()]


def _said(answer: Answer) -> str:
    """Return a result as a message has it."""
    return ", ".join(f"{value:g}" for value in _values(answer)) if answer.ok else f"{FAILED}: {answer.message}"


# ---- recorded


def _record(key: str, result: _Result, solver: Solver, folder: StudyFolder, because: str) -> None:
    """Save a result with who entered it and when; an earlier one is in the log."""
    before, filled, time = folder.peek(key), result.filled, now()
    told: dict[str, Any] = {"entered": time, "entered_by": filled.said.get(WHO) or _user_name()}
    told |= {name: text for name, text in (("done", filled.said.get(WHEN)), ("remark", filled.remark)) if text}
    if before is not None:
        values = {"before": _said(_answer_in(before)), "now": _said(result.answer)}
        values |= {name: before["details"].get(name, "") for name in ("entered", "entered_by")}
        folder.log("result_replaced", key=key, run=filled.run, reason=because, **values)
    answer = replace(result.answer, details={**result.answer.details, **told})
    keep(Run.of(solver, result.request), (answer, {**provenance(), "finished": time}), folder)
