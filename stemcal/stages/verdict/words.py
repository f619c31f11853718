"""Sentences on the verdict, and on the conditions at which the result may be used."""

import re
from dataclasses import asdict
from typing import Any

from stemcal.doe.comparison import NORMAL
from stemcal.formats import fixed
from stemcal.notes import Note
from stemcal.stages.result import Judged, Prediction
from stemcal.stages.verdict.result import Verdict
from stemcal.vocabulary import Wording, capital

_WORDS = {"calibrated": "Calibrated", "not_calibrated": "Not calibrated"}
_WORDS["with_reservations"] = f"{_WORDS['calibrated']}, with reservations"
_OF_GOAL = {"calibrated": "The optimum is confirmed", "not_calibrated": "The optimum is not confirmed"}
_OF_GOAL["with_reservations"] = f"{_OF_GOAL['calibrated']}, with reservations"


def word(verdict: Verdict) -> str:
    """Return the verdict in words."""
    return (_OF_GOAL if verdict.goal else _WORDS)[verdict.verdict]


def brief(reason: Note) -> str:
    """Return the first sentence of a reason."""
    return f"{reason.text.split('. ')[0].rstrip('.')}."


def opening(verdict: Verdict) -> str:
    """Return the verdict and the first reason."""
    return " ".join([f"{word(verdict)}.", *(reason.text for reason in verdict.reasons[:1])])


def lines(verdict: Verdict, names: Wording) -> list[str]:
    """Return lines with the verdict, the reasons by importance, the use of the result, and the next step."""
    several = len(verdict.reasons) > 1
    reasons = [f"{number}. {brief(reason)}" for number, reason in enumerate(verdict.reasons, 1)] if several else []
    next_step = [f"Next: {reason.remedy.text}" for reason in verdict.reasons[:1] if reason.remedy]
    return [f"{word(verdict)}." if several else opening(verdict), *reasons, *uses(verdict, names), *next_step]


def in_full(verdict: Verdict, names: Wording) -> list[str]:
    """Return lines with the verdict, the use of the result, and every reason with its remedy."""
    reasons = [
        f"{number}. {reason.text}" + (f" Next: {reason.remedy.text}" if reason.remedy else "")
        for number, reason in enumerate(verdict.reasons, 1)
    ]
    return [f"{word(verdict)}.", *uses(verdict, names), *reasons]


def verdict_json(verdict: Verdict, names: Wording) -> dict[str, Any]:
    """Return the verdict for JSON output: the verdict, the reasons as notes, and the use of the result."""
    reasons = [asdict(reason) for reason in verdict.reasons]
    return {"verdict": verdict.verdict, "reasons": reasons, "use": " ".join(uses(verdict, names))}


def uses(verdict: Verdict, names: Wording) -> list[str]:
    r"""Return the conditions at which the simulated response agrees, and the largest error elsewhere, as one line.

    Without a comparison nothing is returned.

    >>> from stemcal.stages.verdict.result import Use
    >>> use = Use(10.0, (7.0, 8.0), Judged("force", 11.0, 21.2, False), largest_percent=3.64)
    >>> print(uses(Verdict.of([], use), Wording())[0].replace(". ", ".\n"))
    The error of the simulation is at most 3.6 % (limit: 10 %) at diameters of 7 and 8 mm.
    The largest error is in the maximum force: 21 % too low at a diameter of 11 mm.
    """
    if (where := verdict.use) is None:
        return [" ".join(map(capital, verdict.gains))] if verdict.gains else []
    if where.good:
        size = f"{where.largest_percent:.1f} % (limit: {where.within_percent:g} %)"
        sentences = [f"The error of the simulation is at most {size}{names.at(*where.good)}."]
    else:
        every = f" at every {names.condition.noun}" if names.has_condition else ""
        sentences = [f"The error of the simulation exceeds {where.within_percent:g} %{every}."]
    if where.worst is not None and where.worst != where.held_out:
        sentences.append(f"The largest error is in the {_signed(where.worst, names)}.")
    if where.held_out is not None and where.fitted and names.has_condition:
        sentences.append(f"The parameters were fitted to data{names.at(*where.fitted)}.")
        if all(prediction.in_turn for prediction in where.predictions):
            sentences.append(f"The largest held-out error is in the {_signed(where.held_out, names)}.")
    in_order = sorted(where.predictions, key=lambda prediction: prediction.in_turn)  # held-out conditions come first
    return [" ".join([*sentences, *(predicted(prediction, names, where.held_out) for prediction in in_order)])]


def predicted(prediction: Prediction, names: Wording, worst: Judged | None = None) -> str:
    """Return a sentence on the largest error of values that were not fitted, compared with the error of a formula.

    >>> from stemcal.doe.comparison import Formula
    >>> print(predicted(Prediction(2.88, Formula(2.53, 3.67, 4.4), (8.0, 10.0)), Wording()).replace(" (", "\\n("))
    At the held-out diameters of 8 and 10 mm the error is at most 2.9 %
    (formula F = a·d^2.53: 3.7 %; no significant difference: a measured mean has a 95 % interval of ± 8.6 %).
    >>> predicted(Prediction(13.46, None, in_turn="stem diameter"), Wording())
    'Cross-validation (one stem diameter predicted from the others): the error is at most 13.5 %.'
    """
    side = ""
    if prediction.in_turn:
        start = f"Cross-validation (one {prediction.in_turn} predicted from the others): the error is at most"
    else:
        place = re.sub(r"^ at (a )?", "At the held-out ", names.at(*prediction.conditions))
        start = f"{place} the error is at most"
        if worst is not None and len(prediction.conditions) > 1:
            side = f", {_side(worst)}{names.at(worst.condition)}"
    text = f"{start} {prediction.worst_percent:.1f} %{side}"
    if (formula := prediction.formula) is None:
        return f"{text}."
    compared = f"formula F = a·d^{formula.exponent:.3g}: {formula.worst_held_out_percent:.1f} %"
    if prediction.better == "neither" and formula.standard_error_percent:
        half_width = NORMAL * formula.standard_error_percent
        compared += f"; no significant difference: a measured mean has a 95 % interval of ± {half_width:.1f} %"
    return f"{text} ({compared})."


def predicted_note(kind: str, prediction: Prediction, names: Wording) -> Note:
    """Return the note of a stage on its prediction of values that were not fitted."""
    return Note(kind, "warning" if prediction.better == "formula" else "info", predicted(prediction, names))


def miss(worst: Judged, names: Wording) -> str:
    """Return a clause on the error of a simulated response: size, direction and condition.

    >>> miss(Judged("force", 11.0, 42.3, fitted=False), Wording())
    'The simulated maximum force is 42 % too low at a diameter of 11 mm'
    """
    return f"The simulated {names.naming.named(worst.response).long} is {_error(worst, names)}"


def _error(worst: Judged, names: Wording) -> str:
    return f"{size_of(worst.size)} % {_side(worst)}{names.at(worst.condition)}"


def _side(worst: Judged) -> str:
    return f"too {'low' if (worst.error_percent or 0.0) > 0.0 else 'high'}"


def _signed(worst: Judged, names: Wording) -> str:
    return f"{names.naming.named(worst.response).long}: {_error(worst, names)}"


def size_of(percent: float) -> str:
    """Return a percentage with one decimal below 10, otherwise with none.

    >>> size_of(42.3), size_of(4.23)
    ('42', '4.2')
    """
    return fixed(percent, 0 if percent >= 10.0 else 1)
