"""Check a row of a sheet: find the run of the row and the result in it, or the reason to refuse the row."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from math import nan

from stemcal.by_hand.run_sheet import FAILED, REPLICATE, Filled, entered_responses, run_name
from stemcal.errors import UsageError
from stemcal.measured.cells import as_number, not_a_number
from stemcal.solvers.protocol import NOT_RUN, RESPONSES, Answer, Request
from stemcal.study.model.study import Study
from stemcal.study.types.field_types import MOST
from stemcal.study.types.units import UnitError, convert, from_internal, parse_unit
from stemcal.vocabulary import Variable

_MOST_LISTED = 20
_OTHER = {".": ",", ",": "."}
_LEVEL = 1e-4  # largest difference between an entered and the requested level, as a share of the factor's range


class Unread(UsageError):
    """Raised for a cell that contains no number in the required unit; the message states the remedy."""


class RowRefused(UsageError):
    """Raised for a row that is not recorded, with its place, its run, the kind of error, and the remedy."""

    def __init__(self, row: Filled, kind: str, message: str) -> None:
        self.place, self.run, self.kind = row.place, row.run, kind
        super().__init__(f"{row.place}: {message}")


def first_of(problems: Sequence[str]) -> list[str]:
    """Return the first `_MOST_LISTED` problems, and the number of further ones."""
    more = len(problems) - _MOST_LISTED
    return [*problems[:_MOST_LISTED], *([f"and {more} more"] if more > 0 else [])]


def by_name(runs: Iterable[Request]) -> dict[str, list[Request]]:
    """Group runs by name; replicates, and runs of the same row at several conditions, have the same name."""
    named: dict[str, list[Request]] = {}
    for run in runs:
        named.setdefault(run_name(run), []).append(run)
    return named


def meant_run(study: Study, runs: Mapping[str, Sequence[Request]], row: Filled) -> Request:
    """Return the run to which a row refers, which has the name and the levels in the row; else raise `RowRefused`."""
    named = runs.get(row.run_name, ())
    if not named:
        message = f"the study has no run {row.run!r}; write the name as in the sheet, such as rsm 3"
        raise RowRefused(row, "unknown_run", message)
    wrong = [other_level(study, run, row) for run in named]
    meant = [run for run, other in zip(named, wrong, strict=True) if other is None]
    if not meant:
        raise next(other for other in wrong if other is not None)
    if len({(run.condition, run.replicate) for run in meant}) > 1:
        message = f"several runs are called {row.run}; add the condition and the replicate, as in the sheet"
        raise RowRefused(row, "several_meant", message)
    return meant[0]


def other_level(study: Study, run: Request, row: Filled) -> RowRefused | None:
    """Return a refusal if a level, the condition or the replicate in a row differs from a run; else None."""
    if (number := row.levels.get(REPLICATE, "")) and REPLICATE not in study.names and number != str(run.replicate):
        message = f"{row.run} has no replicate {number!r}; write the number as in the sheet"
        return RowRefused(row, "other_replicate", message)
    requested = [(f.name, run.levels[f.name], _LEVEL * (f.high - f.low), f.unit) for f in study.factors]
    if (at := study.naming.condition) is not None:
        requested.append((at.name, run.condition, _LEVEL * abs(run.condition), at.unit))
    for name, level, near, unit in requested:
        if name not in row.levels:  # a level without a column is not checked
            continue
        entered = nan
        with suppress(Unread):
            entered = number_in(row.levels[name], row.decimal, row.units.get(name, unit), unit)
        if not abs(entered - level) <= near:
            message = (
                f"{row.run} was requested at {name} = {level:.6g}{Variable('', '', '', unit).unit_suffix}, but the row "
                f"has {row.levels[name]!r}; copy the row from the sheet, or repeat the run at the requested levels"
            )
            return RowRefused(row, "other_levels", message)
    return None


def result_in(study: Study, row: Filled) -> Answer:
    """Return the result of a row: a value of every response, or a failed answer with the reason in the row."""
    failures = {text for text in (*row.values.values(), row.remark) if text.casefold().startswith(FAILED)}
    if failures and any(text and text not in failures for text in row.values.values()):
        message = f"{row.run} has a value but is marked as failed; delete the value or the word `failed`"
        raise RowRefused(row, "failed_with_value", message)
    if failures:
        reason = " ".join(failures)[len(FAILED) :].lstrip(" :,-–").strip()
        if not reason:
            message = f"{row.run} is marked as failed without a reason; add one, such as `failed: the stem slipped`"
            raise RowRefused(row, "no_reason", message)
        return Answer("failed", reason=NOT_RUN, message=reason)
    values: dict[str, float] = {}
    for response in entered_responses(study):
        if not (text := row.values.get(response.name, "")):
            message = f"{row.run} has no {response.name}; add this value, or write `failed: REASON`"
            raise RowRefused(row, "incomplete", message)
        unit = row.units.get(response.name, response.unit)
        try:
            values[response.name] = number_in(text, row.decimal, unit, response.unit)
        except Unread as why:
            raise RowRefused(row, "unreadable", f"{row.run}, {response.name}: {why}, or `failed: REASON`") from None
    first, *others = values
    return Answer("ok", values[first], details={RESPONSES: {name: values[name] for name in others}} if others else {})


def values_in_row(study: Study, answer: Answer) -> dict[str, float]:
    """Return the value of each response of a result, by its name; empty for a failed run."""
    if answer.response is None:
        return {}
    return {entered_responses(study)[0].name: answer.response, **answer.details.get(RESPONSES, {})}


def number_in(cell: str, decimal: str, heading: str, wanted: str) -> float:
    """Return the number in a cell (with this `decimal` mark), converted from the unit `heading` to the unit `wanted`.

    >>> number_in("12,5", ".", "N", "N"), number_in("12.5", ".", "kN", "N"), number_in("1,234", ",", "N", "N")
    (12.5, 12500.0, 1.234)

    Raises `Unread` if the cell is not a number, the unit cannot be converted, or the number is ambiguous (1,234).
    """
    other = _OTHER[decimal]
    first, second = as_number(cell, decimal), as_number(cell, other)
    if first is not None and second is not None and first != second and other in cell:
        raise Unread(f"{cell!r} is ambiguous ({first:.6g} or {second:.6g}); write the number without a comma")
    value = second if first is None else first
    if value is None:
        raise Unread(f"{not_a_number(cell)}; write a number without a unit")
    if heading != wanted and (heading or wanted != "1"):
        try:
            from_unit, to_unit = parse_unit(heading), parse_unit(wanted)
            if from_unit != to_unit:
                value = from_internal(convert(value, heading, to_unit.dimension), wanted)
        except UnitError:
            raise Unread(f"{cell!r} is in {heading}, not in {wanted}; convert the value") from None
    if abs(value) > MOST:
        raise Unread(f"{cell!r} exceeds 1e30; correct the value")
    return value
