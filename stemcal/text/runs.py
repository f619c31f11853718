"""What is said of runs: what they are warned of, values that are only bounds, runs that failed."""

from collections import Counter
from collections.abc import Mapping

from stemcal.note import Note
from stemcal.stages.result import StageResult
from stemcal.words import counted


def warned_of(warnings: Mapping[str, Note], count: int) -> str:
    """Count the runs with a kind of warning, out of `count`, and quote the warning of the first, by its label."""
    first, warning = next(iter(warnings.items()))
    return f"{len(warnings)} of {counted(count, 'run')}, first {first}: {warning}"


def compiling(seconds: float | None) -> str:
    """Say that kernels are compiled, and how many seconds that took the last time."""
    last = "about half a minute" if seconds is None else f"{seconds:.0f} s last time"
    return f"compiling the solver for this machine ({last}, once for all studies)"


# ---- runs that failed


def counted_reasons(reasons: Mapping[str, int]) -> str:
    """List why runs failed, each reason with its count."""
    return ", ".join(f"{reason} ({count})" for reason, count in reasons.items())


def failed_runs(result: StageResult) -> str:
    """Count the failed runs of a stage with their reasons; nothing if none failed."""
    outcomes = [outcome for _, outcome in result.runs()]
    reasons = Counter(outcome.reason or "no reason given" for outcome in outcomes if not outcome.ok)
    if not reasons:
        return ""
    runs = counted(len(outcomes), "run")
    why = counted_reasons(reasons)
    return f"{result.name}: {reasons.total()} of {runs} failed: {why}; see {result.name}.json"
