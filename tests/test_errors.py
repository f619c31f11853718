"""Errors cross the border of a process, and are copied, whole: their text, their attributes, their exit code."""

import copy
import pickle

import pytest

from stemcal import errors
from stemcal.processes.limits import RunTimedOut
from stemcal.runs.executors import ClusterLost, WorkerDied
from stemcal.study.types.units import UnitError

RAISED = [
    errors.StemcalError("a"),
    errors.SpecError([errors.SpecProblem("s.yaml", 3, 1, "name", "a"), errors.SpecProblem("s.yaml", 1, 1, "", "b")]),
    errors.UsageError("a"),
    errors.RunsFailed("a"),
    errors.TargetUnreachable(120.0, 50.0, 100.0, " mJ"),
    errors.FolderLocked("a"),
    errors.Waiting("screen", [("request", 1)]),
    errors.SimulationFailed("nan", "a number is not finite"),
    WorkerDied("a"),
    RunTimedOut(3.0),
    ClusterLost("a"),
    UnitError("8 has no unit", "write 8 mm"),
]  # fmt: skip


def test_every_error_is_here() -> None:
    named = {kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, Exception)}
    assert named <= {type(error) for error in RAISED}


@pytest.mark.parametrize("error", RAISED, ids=lambda error: type(error).__name__)
def test_errors_are_pickled_and_copied(error: errors.StemcalError) -> None:
    for found in (pickle.loads(pickle.dumps(error)), copy.copy(error), copy.deepcopy(error)):
        assert type(found) is type(error) and str(found) == str(error) and found.args == error.args
        assert vars(found) == vars(error) and found.exit_code == error.exit_code
