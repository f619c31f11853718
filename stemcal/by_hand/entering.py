"""Record the results of manual runs, and list the runs whose results a study is waiting for.

Every row of a sheet is checked. Correct rows are recorded, even for runs that are not requested now; other rows are
refused with a reason. A result is replaced only if the user states a reason; the study log then contains both results.
"""

import getpass
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from stemcal.by_hand.likely import likely_columns, misplaced_value, require_likely
from stemcal.by_hand.row_checks import RowRefused, by_name, first_of, meant_run, result_in
from stemcal.by_hand.run_sheet import FAILED, STUDY, WHEN, WHO, Filled, fields_of, narrow, rows_from_mappings, run_name
from stemcal.errors import StemcalError, UsageError, Waiting
from stemcal.runs.answer import keep, watch_nothing
from stemcal.runs.executors import InlineExecutor
from stemcal.runs.record import Run, by_key, is_final
from stemcal.runs.study_folder import StudyFolder, now, place_of, provenance
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.solvers.replicates import seed_of
from stemcal.stages.fresh import make
from stemcal.stages.ledger import ledger, missing, required_runs
from stemcal.stages.stage import stage_called, stages_of
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

_SAME = 1e-9  # relative difference below which two values are the same, because a spreadsheet program may round


@dataclass(frozen=True)
class Entered:
    """Outcome of entering a sheet: names of the runs with new (`taken`), known and replaced results; refused rows."""

    taken: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    replaced: tuple[str, ...] = ()
    refused: tuple[RowRefused, ...] = ()

    def summary(self) -> str:
        """Return sentences with the numbers of accepted, known and replaced results."""
        sentences = [f"Results accepted: {len(self.taken)}."]
        if self.known:
            sentences.append(f"Results already recorded: {len(self.known)}.")
        if self.replaced:
            sentences.append(f"Results replaced: {len(self.replaced)} ({', '.join(self.replaced)}).")
        return " ".join(sentences)

    def require_all(self) -> None:
        """Raise `UsageError` with the refused rows, if there are any; the other results remain recorded."""
        if self.refused:
            were = "row was" if len(self.refused) == 1 else "rows were"
            head = f"{len(self.refused)} {were} rejected; correct the sheet, then enter the results again."
            raise UsageError("\n".join([head, *first_of(list(map(str, self.refused)))]))


@dataclass(frozen=True)
class _Result:
    """A row without errors (`filled`), the run to which it refers (`request`), and the result in it (`answer`)."""

    filled: Filled
    request: Request
    answer: Answer


def record_results(study: Study, folder: StudyFolder, sheet: Sequence[Filled], *, replace_because: str = "") -> Entered:
    """Record the results in the rows of a sheet; the folder must be locked.

    Correct rows are accepted even if others are refused. The name of the user is recorded for rows without a person.
    A result replaces another one only if `replace_because` states a reason. Raises `UsageError` if the solver of the
    study is not `sheet`, or if a row is from another study.
    """
    _require_sheet(study)
    seen, rows = study.by_hand, [row for row in sheet if not row.is_empty]
    for row in rows:
        if row.origin.get(STUDY) and row.origin[STUDY] != narrow(study.name):
            raise UsageError(f"{row.place}: the sheet is for the study {row.origin[STUDY]!r}, not for {study.name!r}")
    requests = _enterable(study, folder, rows) if sheet else {}
    solver, runs, refused = make_solver(seen), by_name(requests.values()), list[RowRefused]()
    results = _by_run(seen, solver, runs, rows, refused)
    recorded = {key: folder.peek(key) for key in requests.keys() - results.keys()}
    answers = {key: _answer_in(record) for key, record in recorded.items() if record is not None}
    answers |= {key: first.answer for key, (first, *_) in results.items()}
    columns = likely_columns(seen, ((key, run, answers[key]) for key, run in requests.items() if key in answers))
    refused += [wrong for row in sheet if (wrong := misplaced_value(seen, columns, runs, row)) is not None]
    names: dict[str, list[str]] = {"taken": [], "known": [], "replaced": []}
    for key, (first, *others) in results.items():
        if other := next((result for result in others if not _agree(result.answer, first.answer)), None):
            for row, twin in ((first.filled, other.filled), (other.filled, first.filled)):
                message = f"{row.run} has a different result at {twin.place}; delete the wrong row"
                refused.append(RowRefused(row, "two_results", message))
            continue
        try:
            state = _against_record(first, folder.load(key), study, replace_because)
            if state != "known":
                require_likely(seen, columns, key, first.filled, first.request, first.answer)
                _record(key, first, solver, folder, replace_because)
        except RowRefused as refusal:
            refused.append(refusal)
            continue
        names[state].append(run_name(first.request))
    return Entered(**{state: tuple(runs_of) for state, runs_of in names.items()}, refused=tuple(refused))


def _enterable(study: Study, folder: StudyFolder, rows: Sequence[Filled]) -> dict[str, Request]:
    """Return the runs whose results may be entered, by key. If there are rows, the study is continued first."""
    waiting = None  # stays None if a stage fails; the rows may correct the results that caused the failure
    with suppress(StemcalError):
        if not rows:
            return enterable_runs(study, folder, None)
        waiting = advance_study(study, folder)
    return enterable_runs(study, folder, waiting) if rows else {}


def _require_sheet(study: Study) -> None:
    """Raise `UsageError` if the study has no manual runs."""
    if study.by_hand.kind.answers != "asks_people":
        kind = study.by_hand.solver.kind
        raise UsageError(
            f"solver.kind: the `{kind}` solver computes all runs; to enter results by hand, write "
            "`solver: {kind: sheet}`"
        )


def _by_run(
    study: Study,
    solver: Solver,
    runs: Mapping[str, Sequence[Request]],
    sheet: Sequence[Filled],
    refused: list[RowRefused],
) -> dict[str, list[_Result]]:
    """Return the rows without errors, grouped by the record keys of their runs; add the other rows to `refused`."""
    results: dict[str, list[_Result]] = {}
    for row in sheet:
        try:
            if row.broken:
                raise RowRefused(row, "broken_row", row.broken)
            request = meant_run(study, runs, row)
            result = _Result(row, request, result_in(study, row))
        except RowRefused as refusal:
            refused.append(refusal)
            continue
        results.setdefault(Run.of(solver, request).key, []).append(result)
    return results


def _against_record(
    result: _Result, record: Mapping[str, Any] | None, study: Study, because: str
) -> Literal["taken", "known", "replaced"]:
    """Classify a result as new, known or a replacement; raise `RowRefused` for a replacement without a reason."""
    filled = result.filled
    before = None if record is None or not is_final(record, study.by_hand.solver.run_limit) else _answer_in(record)
    if before is None or record is None:
        return "taken"
    if _agree(before, result.answer):
        return "known"
    if because or (not before.ok and result.answer.ok):
        return "replaced"
    origin = [str(record["details"].get(name, ""))[:16] for name in ("entered", "entered_by")]
    raise RowRefused(
        filled,
        "known_otherwise",
        f"{filled.run} already has the result {_shown(before)} ({' '.join(origin).strip()}), but the new "
        f"result is {_shown(result.answer)}; to replace the result, enter the sheet again with `--replace REASON`",
    )


def _answer_in(record: Mapping[str, Any]) -> Answer:
    return Answer(**{name: record[name] for name in ("status", FIRST, "reason", "message", "details")})


def _agree(first: Answer, second: Answer) -> bool:
    if not (first.ok and second.ok):
        return (first.ok, first.reason) == (second.ok, second.reason)
    pairs = zip(_values(first), _values(second), strict=True)
    return all(math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12) for a, b in pairs)


def _values(answer: Answer) -> list[float]:
    return [answer.response or 0.0, *answer.details.get(RESPONSES, {}).values()]


def _shown(answer: Answer) -> str:
    return ", ".join(f"{value:g}" for value in _values(answer)) if answer.ok else f"{FAILED}: {answer.message}"


def _record(key: str, result: _Result, solver: Solver, folder: StudyFolder, because: str) -> None:
    """Save a result with the person who entered it and the time; write a replaced result to the log of the study."""
    before, filled, time = folder.peek(key), result.filled, now()
    who = filled.origin.get(WHO, "")
    if not who:
        with suppress(OSError, KeyError, ImportError):  # the system does not provide the name of the user
            who = getpass.getuser()
    origin: dict[str, Any] = {"entered": time, "entered_by": who}
    origin |= {name: text for name, text in (("done", filled.origin.get(WHEN)), ("remark", filled.remark)) if text}
    if before is not None:
        values = {"before": _shown(_answer_in(before)), "now": _shown(result.answer)}
        values |= {name: before["details"].get(name, "") for name in ("entered", "entered_by")}
        folder.log("result_replaced", key=key, run=filled.run, reason=because, **values)
    answer = replace(result.answer, details={**result.answer.details, **origin})
    keep(Run.of(solver, result.request), (answer, {**provenance(), "finished": time}), folder)


def advance_study(study: Study, folder: StudyFolder) -> Waiting | None:
    """Compute stages until results are missing; return the pending runs, or None if all stages are complete."""
    try:
        for stage in stages_of(study):
            make(stage, study, folder, InlineExecutor(), watch_nothing)
    except Waiting as waiting:
        return waiting
    return None


def awaited_runs(study: Study, folder: StudyFolder, waiting: Waiting) -> list[Request]:
    """Return all known pending runs of the waiting stage; replicates in random order, so that drift causes no bias."""
    study = stage_called(waiting.stage).seen(study)
    solver = make_solver(study)
    wanted = by_key(solver, waiting.requests)
    for part in required_runs(study, solver, folder):
        left = by_key(solver, missing(part, study, solver, folder))
        if part.stage == waiting.stage and part.settled and wanted.keys() <= left.keys():
            wanted = left
    rows = list(wanted.values())
    if study.solver.repeats:
        rows.sort(key=seed_of)
    return rows


def enterable_runs(study: Study, folder: StudyFolder, waiting: Waiting | None) -> dict[str, Request]:
    """Return the runs whose results may be entered, by their keys: pending runs and runs with a recorded result."""
    of_other_model = {stage.name for stage in stages_of(study) if stage.seen(study) is not study}
    by_hand_there = study.by_hand is not study
    awaited = () if waiting is None else waiting.requests
    recorded = [entry.request for entry in ledger(study, folder) if (entry.stage in of_other_model) is by_hand_there]
    return by_key(make_solver(study.by_hand), (*awaited, *recorded))


@dataclass(frozen=True)  # all instances are equal, so that two copies of a study are equal, too
class AskAndTell:
    """Implements `Study.ask` and `Study.tell`: lists the pending runs of a study folder and records their results."""

    def ask(self, study: Study, out: str | Path | None) -> list[dict[str, Any]]:
        _require_sheet(study)
        with StudyFolder(place_of(study.name, out)) as folder:
            waiting = advance_study(study, folder)
            runs = [] if waiting is None else awaited_runs(study, folder, waiting)
        empty, columns = ("response", "origin"), fields_of(study.by_hand)
        return [{c.name: None if c.kind in empty else c.cell(run) for c in columns} for run in runs]

    def tell(
        self, study: Study, rows: Sequence[Mapping[str, Any]], out: str | Path | None, *, replace: str = ""
    ) -> int:
        _require_sheet(study)
        with StudyFolder(place_of(study.name, out)) as folder:
            sheet = rows_from_mappings(rows, study.by_hand)
            entered = record_results(study, folder, sheet, replace_because=replace)
        entered.require_all()
        return len(entered.taken) + len(entered.replaced)
