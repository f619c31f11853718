"""Format numbers, intervals, units, durations and lists of words for tables and sentences."""

import difflib
import math
import re
from collections.abc import Iterable

MISSING = "–"


def significant(value: float | None, digits: int = 4) -> str:
    """Format `value` with `digits` significant digits, without an exponent from 1e-4 to 1e7: 18921, 0.1875."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    magnitude = math.floor(math.log10(abs(value)))
    if not -4 <= magnitude < 7:
        return minus(f"{value:.{digits - 1}e}")
    return minus(f"{value:.{max(0, digits - 1 - magnitude)}f}")


def short(value: float | None, digits: int = 6) -> str:
    """Format `value` with at most `digits` significant digits and no trailing zeros: 1100, 0.3."""
    return MISSING if value is None or not math.isfinite(value) else minus(f"{value:.{digits}g}")


def fixed(value: float | None, decimals: int = 2) -> str:
    """Format `value` with a fixed number of decimals: −4.75."""
    if value is None or not math.isfinite(value):
        return MISSING
    return minus(f"{round(value, decimals) + 0.0:.{decimals}f}")


def probability(p: float | None) -> str:
    """Format a p-value for a table: <0.0001, 0.0462."""
    if p is None or math.isnan(p):
        return MISSING
    return "<0.0001" if p < 0.00005 else f"{p:.4f}"


def signed_probability(p: float | None) -> str:
    """Format a p-value for a sentence, where it follows the letter p: < 0.0001, = 0.0462."""
    text = probability(p)
    return f"< {text[1:]}" if text.startswith("<") else f"= {text}"


def percent(value: float | None) -> str:
    """Format a percentage with two decimals, or three if it is below 0.005: 60.19, 0.001."""
    if value is None:
        return MISSING
    return fixed(value, 3 if abs(value) < 0.005 else 2)


def direction(error_percent: float | None, unit: str = "", digits: int = 2) -> str:
    """Format the error 100·(measured − simulated)/measured: ``3.83 too low`` if it is positive."""
    size = fixed(None if error_percent is None else abs(error_percent), digits)
    if error_percent is None or size == fixed(0.0, digits):
        return size if error_percent is None else f"{size}{unit}"
    return f"{size}{unit} too {'low' if error_percent > 0.0 else 'high'}"


def interval(
    bounds: list[float] | tuple[float, float] | None, digits: int = 4, bounded: tuple[bool, bool] = (True, True)
) -> str:
    """Format an interval: ``≤ 10.00 to 18.96``; ≤ or ≥ marks an end that is not `bounded`, only a limit of a range."""
    if not bounds:
        return MISSING
    low, high = (significant(end, digits) for end in bounds)
    return f"{'' if bounded[0] else '≤ '}{low} to {'' if bounded[1] else '≥ '}{high}"


def unit_written(unit: str) -> str:
    """Return a unit with superscript exponents, such as kg/m³; empty for the unit 1."""
    raised = re.sub(r"(?<=[A-Za-z])[23]", lambda digit: "²³"[int(digit[0]) - 2], unit)
    return "" if unit == "1" else raised


def with_unit(number: str, unit: str) -> str:
    """Return a number followed by its unit: 1100 kg/m³."""
    return f"{number} {unit_written(unit)}".rstrip()


def change(factor: str, size: float, unit: str) -> str:
    """Describe the change of a factor: ``yield_stress decreases by 1.9 MPa``."""
    return with_unit(f"{factor} {'in' if size > 0 else 'de'}creases by {minus(f'{abs(size):.3g}')}", unit)


def decimals(values: Iterable[float | None], usual: int) -> int:
    """Return the number of decimals with which the largest value has three digits; at least `usual`, at most 9."""
    largest = max((abs(value) for value in values if value is not None and math.isfinite(value)), default=0.0)
    return usual if largest == 0.0 else min(max(usual, 2 - math.floor(math.log10(largest))), 9)


def duration(seconds: float | None) -> str:
    """Format a duration: ``under 1 s``, ``10 min``, ``2 h 30 min``, ``833 days``."""
    if seconds is None:
        return "unknown"
    if seconds < 1.0:
        return "under 1 s"
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds > 100 * 365.25 * 86400:
        return "more than 100 years"
    minutes = round(seconds / 60.0)
    if minutes < 90:
        return f"{minutes} min"
    return f"{minutes // 60} h {minutes % 60} min" if minutes < 240 * 60 else f"{minutes / 1440:.0f} days"


def minus(text: str) -> str:
    """Replace hyphens by minus signs, also in exponents."""
    return text.replace("-", "−")


def in_bytes(count: float | None) -> str:
    """Format an amount of memory: 7.1 GB."""
    if count is None:
        return MISSING
    if count < 1e12:
        return f"{max(count / 1e9, 0.1):.1f} GB"
    return f"{count / 1e12:.1f} TB" if count < 1e15 else "more than 1000 TB"


def outwards(value: float, up: bool) -> float:
    """Round an end of a range outwards to two digits: an upper end (`up`) 44.2 to 45, a lower end 0.0373 to 0.037."""
    if value == 0.0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 1)
    return float(f"{(math.ceil if up else math.floor)(round(value / step, 6)) * step:.6g}")


_MOST = 12  # largest number of names in a list
_LONGEST = 60  # largest number of characters of a name


def near(word: str, known: Iterable[str], most: int = 1) -> list[str]:
    """Return up to `most` known words that are similar to `word`, the most similar first."""
    words = {name.lower(): name for name in known}
    return [words[match] for match in difflib.get_close_matches(word.lower()[:100], list(words), n=most)]


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word most similar to `word`; None if none is similar."""
    return next(iter(near(word, known)), None)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown word: the most similar known word, otherwise all known words."""
    names = list(known)
    meant = nearest(word, names)
    if meant is not None:
        return f"did you mean {meant[:_LONGEST]}?"
    return f"use {listed(names)}" if names else ""


def listed(names: Iterable[str]) -> str:
    """List names as alternatives: ``a, b or c``; cut long names and lists."""
    words = [name[:_LONGEST] for name in names]
    if len(words) > _MOST:
        return ", ".join(words[:_MOST]) + ", …"
    return " or ".join(filter(None, [", ".join(words[:-1]), words[-1] if words else ""]))


def counted(count: int, noun: str) -> str:
    """Return a number with a noun: 1 run, 12 runs."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def series(words: Iterable[object], joint: str = "and") -> str:
    """List several words in a sentence: ``a, b and c``."""
    *first, last = [str(word) for word in words] or [""]
    return f"{', '.join(first)} {joint} {last}" if first else last
