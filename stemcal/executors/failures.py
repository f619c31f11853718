"""How an executor may fail to give a run's answer, whatever the executor."""

from stemcal.errors import StemcalError


class WorkerDied(StemcalError):
    """The process that computed a run ended without an answer."""


class RunTimedOut(StemcalError):
    """A run took longer than its time limit and was ended."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        super().__init__(f"it took longer than its time limit of {limit:g} s and was ended")

    def __reduce__(self) -> tuple[type, tuple[float]]:
        return type(self), (self.limit,)


class ClusterLost(StemcalError):
    """The connection to the cluster broke: no run failed, but none can be computed now."""
