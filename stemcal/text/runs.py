"""What is said of runs: what they are warned of, values that are only bounds, runs that failed."""

from collections import Counter
from collections.abc import Mapping

from stemcal import run_warnings as of_runs
from stemcal.run_warnings import RunWarning
from stemcal.runs.outcome import LowerBound
from stemcal.stages.result import StageResult
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import sentence, states


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


# ---- warnings

states(
    of_runs.EnergyDrifts,
    "The energy balance drifts by {percent:.1f} %. Lower solver.time_step_safety and solver.time_step.",
)
states(
    of_runs.MaximumNotPassed,
    "The test ended after {stroke:.3g} mm without having passed its maximum: maximum_force, travel and work are lower "
    "bounds, the slope is not. Lengthen the stroke of the test.",
)
states(
    of_runs.Buckles,
    "The pressed piece bends or wrinkles before it breaks: it is out of shape by {percent:.0f} % of how far it has "
    "widened. Travel, work and, less so, the maximum force then depend on the mesh, the slope does not. Take a shorter "
    "piece; where the wall wrinkles, fit the slope alone.",
)
states(
    of_runs.InertiaInForce,
    "Inertia has {percent:.1f} % of the force: blade and supports differ by that at the peak, with kinetic energy up "
    "to {kinetic_percent:.1f} % of internal energy. Divide solver.mass_scaling by 100 and solver.time_step by 10, for "
    "either adds mass.",
)
states(
    of_runs.HourglassEnergy,
    "Hourglass energy is {percent:.1f} % of internal energy. Refine the mesh or change solver.hourglass.",
)
states(
    of_runs.ForceAfterBreak,
    "After the break at {travel:.3g} mm the force rose again, to {force:.1f} N, above the peak of {peak:.1f} N: the "
    "released stem swings against the blade. That is not the force of cutting.",
)
states(
    of_runs.NothingDeleted,
    "The material has no failure criterion: at the failure strain elements only lost their shear stress, none was "
    "deleted.",
)


@sentence.register
def _(warning: of_runs.StrokeTooShort, names: Names) -> str:
    return names.say(_STROKES.get(warning.ending, _STROKES["rising"]), **vars(warning))


# By how the stroke ended.
_STROKES = {
    "rising": "The force still rose at the end of the {stroke:.3g} mm stroke: the true maximum is larger. Lengthen "
    "loading.duration.",
    "regained": "A peak of {peak:.1f} N at {peak_travel:.3g} mm was passed, the force fell to {valley:.1f} N and "
    "regained {end:.1f} N within the {stroke:.3g} mm stroke: a larger maximum may follow. Lengthen loading.duration.",
    "falling": "A peak of {peak:.1f} N at {peak_travel:.3g} mm was passed, but the force fell only to {end:.1f} N "
    "within the {stroke:.3g} mm stroke: a larger maximum may follow. Lengthen loading.duration.",
}


def warning_text(warning: RunWarning) -> str:
    """Return what a run is warned of, as one or two sentences."""
    return sentence(warning, Names())


def warned_of(warnings: Mapping[str, RunWarning], count: int) -> str:
    """Say a kind of warning: how many of `count` runs have it, and that of the first, by its label."""
    first, warning = next(iter(warnings.items()))
    return say_number(
        "{warned} of {count} run, first {first}: {warning}",
        "{warned} of {count} runs, first {first}: {warning}",
        count,
        warned=len(warnings),
        first=first,
        warning=warning_text(warning),
    )


def compiling(seconds: float | None) -> str:
    """Say that kernels are compiled, and how many seconds that took the last time."""
    first = "compiling the solver for this machine, once for all studies of this precision"
    again = "compiling the solver for this machine, once for all studies of this precision; {seconds:.0f} s last time"
    return say(first) if seconds is None else say(again, seconds=seconds)


# ---- runs that failed


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
