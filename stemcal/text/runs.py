"""What is said of runs: values that are only bounds, runs that failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from stemcal.runs.policy import LowerBound
from stemcal.stages.result import StageResult
from stemcal.text.language import say, say_number
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


def counted_reasons(reasons: Mapping[str, int]) -> str:
    """List why runs failed, each reason with its count."""
    return ", ".join(say("{reason} ({count})", reason=reason, count=count) for reason, count in reasons.items())


def failed_runs(result: StageResult) -> str:
    """Count the failed runs of a stage with their reasons; nothing if none failed."""
    outcomes = [outcome for _, outcome in result.runs()]
    reasons = Counter(outcome.reason or say("no reason given") for outcome in outcomes if not outcome.ok)
    if not reasons:
        return ""
    return say_number(
        "{stage}: {failed} of {count} run failed: {reasons}; see {stage}.json",
        "{stage}: {failed} of {count} runs failed: {reasons}; see {stage}.json",
        len(outcomes),
        stage=result.name,
        failed=reasons.total(),
        reasons=counted_reasons(reasons),
    )
