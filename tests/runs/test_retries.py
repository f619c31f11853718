"""What of a solver's answer may enter an analysis."""

import math

import pytest

from stemcal.runs.record import validated
from stemcal.solvers.protocol import RESPONSES, Answer
from stemcal.vocabulary import Variable, Vocabulary

HEAP = Vocabulary(
    None, (Variable("angle", "Angle of repose", "θ", "deg"), Variable("density", "Bulk density", "ρ", "kg/m3"))
)


def of(angle: float | None, density: float = 745.0) -> Answer:
    return validated(Answer("ok", angle, details={RESPONSES: {"density": density}}), HEAP)


def test_an_answer_in_numbers_stands() -> None:
    assert of(32.6) == Answer("ok", 32.6, details={RESPONSES: {"density": 745.0}})
    assert of(0.0, -1e30).ok


@pytest.mark.parametrize(("value", "reason"), [(1e300, "bad_result"), (-2e30, "bad_result"), (math.nan, "nan")])
def test_every_response_is_bounded_and_named(value: float, reason: str) -> None:
    first, further = of(value), of(32.6, value)
    assert (first.status, first.reason, further.status, further.reason) == ("failed", reason, "failed", reason)
    assert "the angle of repose" in first.message and "the bulk density" in further.message
    assert first.response is None and further.response is None
    assert further.details == {}  # nothing that no file of JSON could hold


def test_no_response_is_no_number() -> None:
    assert of(None).reason == "nan"
