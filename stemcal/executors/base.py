"""What an executor of runs must offer beyond `concurrent.futures.Executor`."""

from abc import abstractmethod
from concurrent.futures import Executor
from math import inf


class RunExecutor(Executor):
    """Computes runs; `ahead` is how many it may be given before one of them is done."""

    ahead: float = inf

    @property
    @abstractmethod
    def workers(self) -> int:
        """How many runs it computes at a time."""
