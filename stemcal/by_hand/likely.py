"""Find probable typing errors in a sheet: values that are far from other values, or in the wrong column."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import log
from statistics import median

from stemcal.by_hand.row_checks import RowRefused, other_level, values_in_row
from stemcal.by_hand.run_sheet import RUN, STUDY, Field, Filled, entered_responses, narrow
from stemcal.measured.cells import as_number
from stemcal.solvers.protocol import Answer, Request
from stemcal.stages.stage import stage_called
from stemcal.study.model.study import Study
from stemcal.vocabulary import FIRST

_CONFIRMED = "confirmed"
"""Word with which the remark of a row confirms that its unusual values are correct."""
_FEWEST = 4  # a value is compared only with this number of known values or more
_FACTOR, _SPREADS = 3.0, 2.5  # limit for the deviation from the median: ln 3 + 2.5 s, see `_is_far`
_SIGMA = 1.4826  # ratio of standard deviation to median absolute deviation of a normal distribution

Columns = Mapping[tuple[float, str], Mapping[str, float]]
"""The known values of each (condition, response) by the record key of the run; the key of a measured target is ""."""


def likely_columns(study: Study, answers: Iterable[tuple[str, Request, Answer]]) -> Columns:
    """Return the known values: the results in `answers` (key, request, answer), and the means of the targets."""
    columns: dict[tuple[float, str], dict[str, float]] = defaultdict(dict)
    first, *_ = names = [response.name for response in entered_responses(study)]
    for target in study.targets.means:
        for name in names:
            mean, _ = target.mean_of(FIRST if name == first else name)
            if mean is not None:
                columns[target.condition, name][""] = mean
    for key, request, answer in answers:
        for name, value in values_in_row(study, answer).items():
            columns[request.condition, name][key] = value
    return columns


def _is_far(value: float, others: Sequence[float]) -> bool:
    """Check whether a value v is so far from the others that a misplaced decimal point or a wrong column is probable.

    It is far if its sign differs, or if |ln |v| − m| > ln 3 + 2.5 s. m is the median of the logarithms of the others,
    and s their robust standard deviation, 1.4826 times the median of |ln |other| − m|.

    >>> heaps = [28.2, 25.9, 30.6, 31.0, 27.4]
    >>> [_is_far(value, heaps) for value in (295.0, 2.95, -29.5, 35.0)]
    [True, True, True, False]
    """
    if min(others) <= 0.0 <= max(others):  # zeros have no logarithm: compare with the largest magnitude instead
        return abs(value) > 10.0 * max(map(abs, others))
    if value * others[0] <= 0.0:
        return True
    logs = [log(abs(other)) for other in others]
    middle = median(logs)
    spread = _SIGMA * median(abs(value_log - middle) for value_log in logs)
    return abs(log(abs(value)) - middle) > log(_FACTOR) + _SPREADS * spread


def require_likely(study: Study, columns: Columns, key: str, row: Filled, request: Request, answer: Answer) -> None:
    """Raise `RowRefused` for a value far from those of other runs at its condition, unless the remark confirms it.

    Runs at the calibrated levels must reproduce the measured mean, so one known value is enough for them.
    """
    fewest = 1 if stage_called(request.stage).pictured else _FEWEST
    if _CONFIRMED in row.remark.casefold():
        return
    for response in entered_responses(study) if answer.ok else ():
        value = values_in_row(study, answer)[response.name]
        known = columns.get((request.condition, response.name), {})
        others = [other for run, other in known.items() if run != key]
        if len(others) >= fewest and _is_far(value, others):
            low, high = (f"{end:.4g}{response.unit_suffix}" for end in (min(others), max(others)))
            text = (
                f"{row.run}: is {response.name} = {value:.6g}{response.unit_suffix} correct? The other values are "
                f"{low} to {high}; correct the cell, or write `{_CONFIRMED}` in the remark"
            )
            raise RowRefused(row, "far_from_others", text)


def misplaced_value(
    study: Study, columns: Columns, runs: Mapping[str, Sequence[Request]], row: Filled
) -> RowRefused | None:
    """If the result of a row is missing but probably is in another column, return the refusal of the row, else None."""
    if not row.is_empty:
        return None
    named = runs.get(row.run_name, ())
    filled = row.without_empty_levels()
    single = [(name, replace(filled, levels={name: text})) for name, text in filled.levels.items()]
    changed = [[name for name, cells in single if other_level(study, run, cells) is not None] for run in named]
    nearest = min(changed, key=len, default=[])
    # a column of levels probably contains the result if it is the only one that differs from a run
    names = nearest if len(nearest) == 1 and _number(row.levels[nearest[0]]) is not None else []
    names = [*names, *_result_among_remarks(study, columns, named, row)]
    if not named and _number(row.run) is not None:
        names.append(RUN)
    if not names:
        return None
    first, cell = entered_responses(study)[0], {RUN: row.run, **row.levels, **row.origin}[names[0]]
    text = (
        f"the row of {row.run} has no {first.name}, but the column {names[0]} contains {cell!r}; move the value to the "
        f"column {Field(first.name, first.unit, 'response').heading}, or correct the cell"
    )
    return RowRefused(row, "wrong_column", text)


def _result_among_remarks(study: Study, columns: Columns, runs: Sequence[Request], row: Filled) -> list[str]:
    """Return those columns for person, date and remark that contain a number similar to the known results."""
    places = {(run.condition, response.name) for run in runs for response in entered_responses(study)}
    known = [list(columns[place].values()) for place in places if place in columns]
    numbers = {name: _number(text) for name, text in row.origin.items() if (name, text) != (STUDY, narrow(study.name))}
    return [
        name
        for name, number in numbers.items()
        if number is not None and any(not _is_far(number, others) for others in known)
    ]


def _number(text: str) -> float | None:
    point = as_number(text, ".")
    return as_number(text, ",") if point is None else point
