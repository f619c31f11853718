"""What is said of runs: values that are only bounds."""

from __future__ import annotations

from stemcal.runs.policy import LowerBound
from stemcal.text.names import Names
from stemcal.text.notes import sentence


@sentence.register
def _(note: LowerBound, names: Names) -> str:
    one, many = _LOWER_BOUNDS.get(note.stroke_end, _LOWER_BOUNDS["unknown"])
    return names.say_number(one, many, len(note.rows), rows=note.rows)


# By how the stroke ended: one run, several.
_LOWER_BOUNDS = {
    "rising": (
        "In run {rows:all} the response still rose when the stroke ended: its maximum is a lower bound. Lengthen the "
        "stroke (loading.duration) or say what such runs count as (runs.censored).",
        "In runs {rows:all} the response still rose when the stroke ended: their maxima are lower bounds. Lengthen the "
        "stroke (loading.duration) or say what such runs count as (runs.censored).",
    ),
    "regained": (
        "In run {rows:all} a peak was passed and partly regained when the stroke ended: its maximum is a lower bound. "
        "Lengthen the stroke (loading.duration) or say what such runs count as (runs.censored).",
        "In runs {rows:all} a peak was passed and partly regained when the stroke ended: their maxima are lower "
        "bounds. Lengthen the stroke (loading.duration) or say what such runs count as (runs.censored).",
    ),
    "falling": (
        "In run {rows:all} a peak was passed, but the response had fallen little when the stroke ended: its maximum is "
        "a lower bound. Lengthen the stroke (loading.duration) or say what such runs count as (runs.censored).",
        "In runs {rows:all} a peak was passed, but the response had fallen little when the stroke ended: their maxima "
        "are lower bounds. Lengthen the stroke (loading.duration) or say what such runs count as (runs.censored).",
    ),
    "unknown": (
        "In run {rows:all} the response had not fallen when the stroke ended: its maximum is a lower bound. Lengthen "
        "the stroke (loading.duration) or say what such runs count as (runs.censored).",
        "In runs {rows:all} the response had not fallen when the stroke ended: their maxima are lower bounds. Lengthen "
        "the stroke (loading.duration) or say what such runs count as (runs.censored).",
    ),
}
