"""Reading in a process that can be ended."""

import math
import os
import re

import pytest

from stemcal.solvers.programs import helper_process
from stemcal.solvers.programs.helper_process import run_in_helper
from stemcal.solvers.programs.reductions import NoResult, Series, reduce_series


def test_gives_what_the_function_gives_and_keeps_its_process():
    first, second = run_in_helper(10.0, os.getpid), run_in_helper(10.0, os.getpid)
    assert first == second != os.getpid()
    assert run_in_helper(10.0, math.hypot, 3.0, 4.0) == 5.0


def test_a_missing_result_keeps_its_reason():
    with pytest.raises(NoResult, match="no numbers") as caught:
        run_in_helper(10.0, reduce_series, Series([]), "max")
    assert caught.value.reason == "no_result"


def test_what_a_reading_raises_is_named():
    with pytest.raises(NoResult, match="ValueError: ") as caught:
        run_in_helper(10.0, math.sqrt, -1.0)
    assert caught.value.reason == "bad_result"


def test_a_pattern_without_end_is_ended_and_the_next_reading_has_a_process_of_its_own():
    with pytest.raises(NoResult) as caught:
        run_in_helper(0.5, re.fullmatch, "(a+)+", "a" * 60 + "b")
    assert caught.value.reason == "timeout"
    assert run_in_helper(10.0, math.hypot, 3.0, 4.0) == 5.0


def test_a_process_that_dies_costs_one_reading():
    with pytest.raises(NoResult, match="exit code 7") as caught:
        run_in_helper(10.0, os._exit, 7)
    assert caught.value.reason == "bad_result"
    assert run_in_helper(10.0, math.hypot, 3.0, 4.0) == 5.0


def test_a_process_that_was_ended_while_it_waited_is_replaced():
    before = run_in_helper(10.0, os.getpid)
    helper_process._idle[-1].kill()
    assert run_in_helper(10.0, os.getpid) != before


def test_an_interrupted_reading_leaves_no_answer_behind(monkeypatch):
    run_in_helper(10.0, os.getpid)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(helper_process._idle[-1], "answer", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_in_helper(10.0, os.getpid)
    assert run_in_helper(10.0, math.hypot, 3.0, 4.0) == 5.0
