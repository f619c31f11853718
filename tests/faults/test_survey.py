"""The quick part of `survey.py`: every fault some times. The long part is `python tests/faults/survey.py`."""

from __future__ import annotations

import pytest
from survey import FAULTS, row, tried
from tally import Fault, Missing, Tally

# The kills have a test of their own (test_kill.py).
QUICK = [fault for fault in FAULTS if fault.quick and fault.name != "kill -9 of the study"]
# What takes longest, most of it also tried elsewhere: test_kill, test_disk, tests/executors/test_cluster, tests/folder.
LONG = (
    "physics goes wrong",
    "a link in the place of an output",
    "Ctrl-C, SIGTERM",
    "an operation on the disk fails",
    "the disk is full",
    "stage files without a seal",
    "the scheduler is lost",
    "a command on a cluster is interrupted",
    "something else in the place of a record",
)


@pytest.mark.parametrize(
    "fault", [pytest.param(f, id=f.name, marks=pytest.mark.slow if f.name in LONG else ()) for f in QUICK]
)
def test_survives(fault: Fault) -> None:
    try:
        tally = tried(fault, fault.quick, seed=0)
    except Missing as missing:
        pytest.skip(str(missing))
    assert tally.tried and not tally.broken, "\n".join(tally.broken)


def test_the_long_ones_are_known_by_name() -> None:
    assert set(LONG) <= {fault.name for fault in QUICK}


def test_a_row_with_a_loss_names_the_first() -> None:
    assert "| 3 | 1 | seen; 2 lost, the first: trial 0: no end |" in row(
        FAULTS[0], Tally(3, ["trial 0: no\nend", "trial 2: x"], "seen")
    )
