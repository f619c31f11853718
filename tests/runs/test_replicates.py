"""Points simulated several times over: their means, their scatter, their records."""

import math

from stemcal.runs.record import Outcome, merged, validated
from stemcal.runs.study_folder import place_of
from stemcal.solvers.protocol import Answer, Request
from stemcal.solvers.replicates import Replicates, repeated
from stemcal.vocabulary import FIRST


def run(force: float | None, bulk: float, key: str) -> Outcome:
    status = "failed" if force is None else "ok"
    return Outcome(response=force, responses=None if force is None else {"bulk": bulk}, status=status, key=key)


def test_requests_are_numbered_from_one_and_left_alone_without_chance():
    asked = [Request("validate", row, {"a": 1.0}, 8.0) for row in range(2)]
    assert [(r.row, r.replicate) for r in repeated(asked, 2)] == [(0, 1), (0, 2), (1, 1), (1, 2)]
    assert repeated(asked, 0) == asked


def test_a_point_is_the_mean_of_each_response():
    (found,) = merged([run(10.0, 5.0, "a"), run(14.0, 7.0, "b")], 2)
    assert (found.response, found.of("bulk"), found.keys) == (12.0, 6.0, ("a", "b"))
    assert found.replicates is not None and found.replicates.of("bulk") == (5.0, 7.0)


def test_a_failed_replicate_is_left_out_but_its_record_is_named():
    (found,) = merged([run(None, 0.0, "a"), run(14.0, 7.0, "b")], 2)
    assert found.ok and found.response == 14.0 and found.keys == ("a", "b")
    (lost,) = merged([run(None, 0.0, "a"), run(None, 0.0, "b")], 2)
    assert not lost.ok and lost.response is None and lost.replicates == Replicates((), ("a", "b"))


def test_travel_and_work_are_means_too() -> None:
    """Of 1 and 3 mm 2 mm, not the first replicate's 1 mm; work that one of them lacks is that of the other."""
    both = [Outcome(response=10.0, travel=1.0, key="a"), Outcome(response=14.0, travel=3.0, work=8.0, key="b")]
    (found,) = merged(both, 2)
    assert (found.response, found.travel, found.work) == (12.0, 2.0, 8.0)
    (without,) = merged([Outcome(response=10.0, key="a"), Outcome(response=14.0, key="b")], 2)
    assert (without.travel, without.work) == (None, None)


def test_a_failed_run_is_no_number() -> None:
    assert validated(Answer("ok", response=float("nan"))).reason == "nan"
    assert Outcome(response=0.0).number(FIRST) == 0.0
    assert math.isnan(Outcome(response=None, status="failed").number(FIRST))


def test_the_default_folder_of_a_study() -> None:
    assert place_of("smoke").as_posix() == "runs/smoke"
