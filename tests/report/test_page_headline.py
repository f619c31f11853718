"""The top box of the page: every reason in a line, in the order of the verdict."""

from stemcal.notes import Note
from stemcal.report.page.headline import lead
from stemcal.stages.verdict.result import Verdict


def test_all_reasons_are_at_the_top_each_with_its_first_sentence() -> None:
    reasons = [Note(f"kind_{i}", "warning", f"Reason {i} is 1.5 %. More of {i}. And more.") for i in range(12)]
    assert lead(Verdict.of(reasons, None), "used") == [f"Reason {i} is 1.5 %." for i in range(12)]
    assert lead(Verdict.of([], None), "Within 10 %.") == ["Within 10 %."]
    assert lead(Verdict.of([], None), "") == []
