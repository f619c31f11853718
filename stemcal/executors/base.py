"""What an executor of runs must offer beyond `concurrent.futures.Executor`, and what may go wrong with it."""

from abc import abstractmethod
from concurrent.futures import Executor
from math import inf

from stemcal.errors import StemcalError


class RunExecutor(Executor):
    """Computes runs; `ahead` is how many it may be given before one of them is done."""

    ahead: float = inf

    @property
    @abstractmethod
    def workers(self) -> int:
        """How many runs it computes at a time."""


class WorkerDied(StemcalError):
    """The process that computed a run ended without an answer."""


class RunTimedOut(StemcalError):
    """A run took longer than its time limit and was ended."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"it took longer than its time limit of {limit:g} s and was ended")


class ClusterLost(StemcalError):
    """The connection to the cluster broke: no run failed, but none can be computed now."""
