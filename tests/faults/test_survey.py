"""The quick part of `survey.py`: every fault some times. The long part is `python tests/faults/survey.py`."""

from __future__ import annotations

import pytest
from survey import FAULTS, PAGE, tried
from tally import Fault, Missing

# The kills have a test of their own (test_kill.py), and so have system calls that fail (test_disk.py).
QUICK = [fault for fault in FAULTS if fault.quick and fault.name != "kill -9 of the study"]


@pytest.mark.parametrize("fault", QUICK, ids=lambda fault: fault.name)
def test_survives(fault: Fault) -> None:
    try:
        tally = tried(fault, fault.quick, seed=0)
    except Missing as missing:
        pytest.skip(str(missing))
    assert tally.tried and not tally.broken, "\n".join(tally.broken)


def test_the_page_has_every_fault() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert [fault.name for fault in FAULTS if f"| {fault.name} | {fault.cause} | {fault.must} |" not in page] == []
