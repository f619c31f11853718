"""Sentences of the verdict: the verdict itself, and where the result may be used."""

from dataclasses import asdict
from typing import Any

from stemcal.formats import counted, fixed
from stemcal.stages.result import Judged
from stemcal.stages.verdict.result import Use, Verdict
from stemcal.vocabulary import Wording

_WORDS = {
    "calibrated": "Calibrated",
    "with_reservations": "Calibrated, with reservations",
    "not_calibrated": "Not calibrated",
}


def word(verdict: Verdict) -> str:
    """Return the verdict in words."""
    return _WORDS[verdict.verdict]


def opening(verdict: Verdict) -> str:
    """Return the verdict and the first reason."""
    return " ".join([f"{word(verdict)}.", *(reason.text for reason in verdict.reasons[:1])])


def lines(verdict: Verdict, names: Wording) -> list[str]:
    """Return three lines at most: the verdict with its first reason, where it may be used, the next step."""
    more = len(verdict.reasons) - 1
    rest = f" (`stemcal status SPEC` lists {counted(more, 'more reason')}.)" if more > 0 else ""
    next_step = [f"Next: {reason.remedy.text}" for reason in verdict.reasons[:1] if reason.remedy]
    return [opening(verdict) + rest, *uses(verdict, names), *next_step]


def in_full(verdict: Verdict, names: Wording) -> list[str]:
    """Return the verdict, where it may be used, and every reason with its remedy."""
    reasons = [
        f"{number}. {reason.text}" + (f" Next: {reason.remedy.text}" if reason.remedy else "")
        for number, reason in enumerate(verdict.reasons, 1)
    ]
    return [f"{word(verdict)}.", *uses(verdict, names), *reasons]


def verdict_json(verdict: Verdict, names: Wording) -> dict[str, Any]:
    """Return the verdict as commands print it: the word, the reasons as notes, and where the result may be used."""
    reasons = [asdict(reason) for reason in verdict.reasons]
    return {"verdict": verdict.verdict, "reasons": reasons, "use": " ".join(uses(verdict, names))}


# ---- where it may be used


def uses(verdict: Verdict, names: Wording) -> list[str]:
    r"""Return the conditions at which the simulated response agrees, and the largest error elsewhere, as one line.

    Without a comparison nothing is returned.

    >>> use = Use(10.0, (7.0, 8.0), Judged("force", 11.0, 21.2, False))
    >>> print(uses(Verdict.of([], use), Wording())[0].replace(". ", ".\n"))
    The error of the simulation is at most 10 % at diameters of 7 and 8 mm.
    The largest error is in the maximum force: 21 % too low at a diameter of 11 mm.
    """
    if (where := verdict.use) is None:
        return []
    if where.good:
        sentences = [f"The error of the simulation is at most {where.within_percent:g} %{names.at(*where.good)}."]
    else:
        every = f" at every {names.condition.noun}" if names.placed else ""
        sentences = [f"The error of the simulation exceeds {where.within_percent:g} %{every}."]
    if where.worst is not None and where.worst != where.held_out:
        sentences.append(f"The largest error is in the {_signed(where.worst, names)}.")
    return [" ".join([*sentences, *_held_out(where, names)])]


def _held_out(where: Use, names: Wording) -> list[str]:
    """Return the largest held-out error, with that of a formula through the fitted forces.

    >>> _held_out(Use(10.0, (), None, Judged("force", 8.0, -2.9, False), (7.0, 9.0), 3.7), Wording())[1][33:]
    'the maximum force: 2.9 % too high at a diameter of 8 mm (formula F = a·d^b: 3.7 %).'
    """
    if where.held_out is None or not where.fitted or not names.placed:
        return []
    formula = "" if where.formula_percent is None else f" (formula F = a·d^b: {where.formula_percent:.1f} %)"
    fitted = f"The parameters were fitted to data{names.at(*where.fitted)}."
    return [fitted, f"The largest held-out error is in the {_signed(where.held_out, names)}{formula}."]


def miss(worst: Judged, names: Wording) -> str:
    """Return the error of a simulated response and its side.

    >>> miss(Judged("force", 11.0, 42.3, fitted=False), Wording())
    'The simulated maximum force is 42 % too low at a diameter of 11 mm'
    """
    return f"The simulated {names.naming.named(worst.response).long} is {_error(worst, names)}"


def _error(worst: Judged, names: Wording) -> str:
    """Return the size of an error, its side and its place."""
    side = "low" if (worst.error_percent or 0.0) > 0.0 else "high"
    return f"{size_of(worst.size)} % too {side}{names.at(worst.condition)}"


def _signed(worst: Judged, names: Wording) -> str:
    """Return a response with its error."""
    return f"{names.naming.named(worst.response).long}: {_error(worst, names)}"


def size_of(percent: float) -> str:
    """Return a percentage, with a decimal below 10.

    >>> size_of(42.3), size_of(4.23)
    ('42', '4.2')
    """
    return fixed(percent, 0 if percent >= 10.0 else 1)
