"""From a sheet that is filled in to records: every row checked, the right ones recorded, the others told with a reason.

A result is recorded like that of any other run, with who entered it and when. One that is there already is never
overwritten by another, unless that is asked for with a reason; the record then keeps what stood there.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from stemcal.by_hand import refusals as why
from stemcal.by_hand.awaited import run_name
from stemcal.by_hand.numbers import Unread, number_in, readings
from stemcal.by_hand.reading import Filled, narrow
from stemcal.by_hand.sheet import FAILED, REPLICATE, WITHDRAWN, entered_responses
from stemcal.folder.study_folder import StudyFolder, now, provenance
from stemcal.measured.statistics import grubbs
from stemcal.naming import Named
from stemcal.runs.answer import keep
from stemcal.runs.outcome import NOT_RUN, answer_of, record_key, stands
from stemcal.runs.outcome import WITHDRAWN as TAKEN_BACK
from stemcal.runs.retries import Computed
from stemcal.solvers import make_solver
from stemcal.solvers.protocol import RESPONSES, Answer, Request, Solver
from stemcal.study.model import Study

_LEVEL = 1e-4  # of a factor's range: levels that differ by more were not asked for
_SAME = 1e-9  # of a value: what writing and reading may change
_DOUBTED = 1e-3  # chance that a value as far from the others comes of a normal sample
_FEWEST = 4  # values that make a sample


@dataclass(frozen=True)
class Correction:
    """That results may take the place of others, and why; `who` enters them; `sure` of values far off."""

    replaces: bool = False
    reason: str = ""
    who: str = ""
    sure: bool = False


@dataclass(frozen=True)
class Entered:
    """What became of a sheet: names of the runs taken, of those known already, of those replaced; what was refused."""

    taken: tuple[str, ...] = ()
    known: tuple[str, ...] = ()
    replaced: tuple[str, ...] = ()
    refused: tuple[why.Refused, ...] = ()


@dataclass(frozen=True)
class _Result:
    """A row that is right by itself."""

    filled: Filled
    request: Request
    key: str
    answer: Answer


@dataclass
class _Sorted:
    """Results on the way to their records."""

    new: list[_Result] = field(default_factory=list)
    known: list[_Result] = field(default_factory=list)
    others: list[_Result] = field(default_factory=list)
    refused: list[why.Refused] = field(default_factory=list)


def enter(
    study: Study, folder: StudyFolder, runs: Sequence[Request], sheet: Sequence[Filled], how: Correction = Correction()
) -> Entered:
    """Record what a sheet tells of the `runs` that may be entered; the folder must be locked.

    Rows that are right are taken, whatever is wrong with the others.
    """
    solver = make_solver(study)
    found = _sorted(study, folder, solver, runs, [one for one in sheet if not one.is_empty], how)
    if not how.sure:
        found = _without_far_off(study, folder, found)
    for result in (*found.new, *found.others):
        _record(result, solver, folder, how)
    return Entered(
        taken=tuple(run_name(result.request) for result in found.new),
        known=tuple(run_name(result.request) for result in found.known),
        replaced=tuple(run_name(result.request) for result in found.others),
        refused=tuple(found.refused),
    )


def _sorted(
    study: Study, folder: StudyFolder, solver: Solver, runs: Sequence[Request], sheet: Sequence[Filled], how: Correction
) -> _Sorted:
    """Check every row by itself, then against the others and against the records."""
    found, seen = _Sorted(), dict[str, _Result]()
    for filled in sheet:
        result = _result(study, solver, runs, filled)
        if isinstance(result, why.Refused):
            found.refused.append(result)
        elif result.key not in seen:
            seen[result.key] = result
        elif not _agree(result.answer, seen[result.key].answer):
            found.refused += [
                why.ToldTwice(filled.place, filled.run, seen[result.key].filled.place),
                why.ToldTwice(seen[result.key].filled.place, filled.run, filled.place),
            ]
    twice = {one.place for one in found.refused if isinstance(one, why.ToldTwice)}
    for key, result in seen.items():
        if result.filled.place not in twice:
            _against_record(found, result, folder.load(key), study, how)
    return found


# ---- a row by itself


def _result(study: Study, solver: Solver, runs: Sequence[Request], filled: Filled) -> _Result | why.Refused:
    place = filled.place, filled.run
    if filled.extra:
        return why.BrokenRow(*place)
    if filled.study and filled.study != narrow(study.name):
        return why.OtherStudy(*place, filled.study, study.name)
    request = _request(study, runs, filled)
    if isinstance(request, why.Refused):
        return request
    answer = _answer(study, filled)
    return answer if isinstance(answer, why.Refused) else _Result(filled, request, record_key(solver, request), answer)


def _request(study: Study, runs: Sequence[Request], filled: Filled) -> Request | why.Refused:
    """Return the run that is meant: of the same name, and of the same levels as far as they are told."""
    called = " ".join(filled.run.split()).casefold()
    named = [run for run in runs if run_name(run) == called]
    if not named:
        return why.UnknownRun(filled.place, filled.run)
    told = filled.levels.get(REPLICATE, "")
    replicates = [run for run in named if not told or told == str(run.replicate)]
    if not replicates:
        return why.OtherReplicate(filled.place, filled.run, told)
    wrong = [_other_level(study, run, filled) for run in replicates]
    meant = [run for run, other in zip(replicates, wrong, strict=True) if other is None]
    if len({(run.condition, run.replicate) for run in meant}) > 1:
        return why.SeveralMeant(filled.place, filled.run)
    return meant[0] if meant else wrong[0] or replicates[0]


def _other_level(study: Study, run: Request, filled: Filled) -> why.OtherLevels | None:
    """Return the first level of a run that is told otherwise than it was asked for."""
    at = study.naming.condition
    for factor in study.factors:
        asked, near = run.levels[factor.name], _LEVEL * (factor.high - factor.low)
        if not _is_level(filled, factor.name, asked, near, factor.unit):
            unit = Named("", "", "", factor.unit).unit_suffix
            return why.OtherLevels(filled.place, filled.run, factor.name, filled.levels[factor.name], asked, unit)
    if at is not None and not _is_level(filled, at.name, run.condition, _LEVEL * abs(run.condition), at.unit):
        return why.OtherLevels(filled.place, filled.run, at.name, filled.levels[at.name], run.condition, at.unit_suffix)
    return None


def _is_level(filled: Filled, name: str, asked: float, near: float, unit: str) -> bool:
    """Whether a level is told as it was asked for; what is not told is not judged."""
    if name not in filled.levels:
        return True
    given, heading = filled.levels[name], filled.units.get(name, unit)
    told = number_in(given, filled.decimal, heading, unit)
    possible = readings(given) if isinstance(told, Unread) else [told]
    return any(abs(value - asked) <= near for value in possible)


def _answer(study: Study, filled: Filled) -> Answer | why.Refused:
    """Return the result that a row tells: a value of every response, or why the run gave none."""
    place = filled.place, filled.run
    said = {text for text in (*filled.values.values(), filled.remark) if text.casefold().startswith(FAILED)}
    given = {name: text for name, text in filled.values.items() if text and text not in said}
    if any(text.casefold() == WITHDRAWN for text in given.values()):
        return Answer("failed", reason=TAKEN_BACK)
    if said:
        reason = " ".join(said)[len(FAILED) :].lstrip(" :,-–").strip()
        if given:
            return why.FailedWithValue(*place)
        return Answer("failed", reason=NOT_RUN, message=reason) if reason else why.NoReason(*place)
    values: dict[str, float] = {}
    for response in entered_responses(study):
        text = filled.values.get(response.name, "")
        if not text:
            return why.Incomplete(*place, response.name)
        heading = filled.units.get(response.name, response.unit)
        value = number_in(text, filled.decimal, heading, response.unit)
        if isinstance(value, Unread):
            return why.Unreadable(*place, response.name, text, value.why, value.unit, response.unit, value.readings)
        values[response.name] = value
    first, *others = values
    return Answer("ok", values[first], details={RESPONSES: {name: values[name] for name in others}} if others else {})


# ---- against what is known


def _against_record(
    found: _Sorted, result: _Result, record: Mapping[str, Any] | None, study: Study, how: Correction
) -> None:
    """Tell a new result from one that is known, and from one that is known otherwise."""
    before = None if record is None or not stands(record, study.runs) else answer_of(record)
    if result.answer.reason == TAKEN_BACK:
        if before is None:
            found.refused.append(why.NothingToWithdraw(result.filled.place, result.filled.run))
            return
    elif before is None:
        found.new.append(result)
        return
    assert record is not None and before is not None
    if _agree(before, result.answer):
        found.known.append(result)
    elif how.replaces or (not before.ok and result.answer.ok):
        found.others.append(result)
    else:
        told = record["details"]
        found.refused.append(
            why.KnownOtherwise(
                result.filled.place,
                result.filled.run,
                _said(result.answer),
                _said(before),
                str(told.get("entered_by", "")),
                str(told.get("entered", "")),
            )
        )


def _agree(one: Answer, other: Answer) -> bool:
    """Whether two results are the same, of every response."""
    if not (one.ok and other.ok):
        return (one.ok, one.reason) == (other.ok, other.reason)
    pairs = zip(_values(one), _values(other), strict=True)
    return all(math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12) for a, b in pairs)


def _values(answer: Answer) -> list[float]:
    return [answer.response or 0.0, *answer.details.get(RESPONSES, {}).values()]


def _said(answer: Answer) -> str:
    """Return a result as a message tells it."""
    if answer.ok:
        return ", ".join(f"{value:g}" for value in _values(answer))
    return WITHDRAWN if answer.reason == TAKEN_BACK else f"{FAILED}: {answer.message}"


def _without_far_off(study: Study, folder: StudyFolder, found: _Sorted) -> _Sorted:
    """Refuse new values that are far from all others at their condition, by Grubbs' test, one after the other."""
    doubted: dict[str, why.FarOff] = {}
    fresh = [result for result in (*found.new, *found.others) if result.answer.ok]
    for condition in {result.request.condition for result in fresh}:
        at = [result for result in fresh if result.request.condition == condition]
        before = _recorded(folder, condition, {result.key for result in fresh}, study)
        for i, response in enumerate(entered_responses(study)):
            values = {result.key: _values(result.answer)[i] for result in at}
            for key, value, others in _suspects(values, [_values(answer)[i] for answer in before]):
                filled = next(result.filled for result in at if result.key == key)
                far = why.FarOff(filled.place, filled.run, response.name, value, min(others), max(others), len(others))
                doubted.setdefault(key, far)
    return replace(
        found,
        new=[result for result in found.new if result.key not in doubted],
        others=[result for result in found.others if result.key not in doubted],
        refused=[*found.refused, *doubted.values()],
    )


def _suspects(values: Mapping[str, float], before: Sequence[float]) -> Iterator[tuple[str, float, list[float]]]:
    """Yield key and value of each new value that is too far from the others, and these."""
    left, keys = [*values.values(), *before], list(values)
    while len(left) > _FEWEST:
        test = grubbs(left, _DOUBTED)
        if test is None or not test.is_outlier or test.index >= len(keys):
            return
        value, key = left.pop(test.index), keys.pop(test.index)
        yield key, value, list(left)


def _recorded(folder: StudyFolder, condition: float, besides: Iterable[str], study: Study) -> list[Answer]:
    """Return the results at a condition that stand, without those that are to be replaced."""
    records = [folder.peek(key) for key in folder.keys() if key not in besides]  # noqa: SIM118
    there = [r for r in records if r is not None and r["request"]["condition"] == condition and stands(r, study.runs)]
    count = len(entered_responses(study))
    return [answer for r in there if (answer := answer_of(r)).ok and len(_values(answer)) == count]


# ---- recorded


def _record(result: _Result, solver: Solver, folder: StudyFolder, how: Correction) -> None:
    """Save a result with who entered it and when; what stood there stays in the record."""
    before, filled, time = folder.peek(result.key), result.filled, now()
    told: dict[str, Any] = {"entered": time, "entered_by": filled.who or how.who}
    told |= {name: text for name, text in (("done", filled.when), ("remark", filled.remark)) if text}
    message = result.answer.message
    if before is not None:
        old = {name: before[name] for name in ("status", "response", "reason", "message")}
        further = before["details"].get(RESPONSES)
        entry = old | ({RESPONSES: further} if further else {}) | {"until": time, "because": how.reason}
        entry |= {name: before["details"].get(name, "") for name in ("entered", "entered_by")}
        told["replaced"] = [*before["details"].get("replaced", []), entry]
        values = {"before": before["response"], "now": result.answer.response}
        folder.log("result_replaced", key=result.key, run=filled.run, reason=how.reason, **values)
    if result.answer.reason == TAKEN_BACK:
        message = how.reason
    answer = replace(result.answer, message=message, details={**result.answer.details, **told})
    keep(result.key, result.request, Computed(answer, {**provenance(), "finished": time}), solver, folder)
