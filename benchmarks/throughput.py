"""Time and memory per run of stemcal itself: a study of many runs with a solver that returns immediately.

python benchmarks/throughput.py [RUNS]                        on this machine
python benchmarks/throughput.py [RUNS] dask://HOST:PORT       on a Dask cluster; its workers need this folder:
                                                              start them with PYTHONPATH=benchmarks

As in any study, every run passes through a worker process and is recorded durably.
"""

from __future__ import annotations

import sys
import tempfile
import time
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stemcal.runs.answer import answer_all
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers.protocol import Answer, Request, Solver

RUNS = 10_000
CURVE = [0.1 * i for i in range(200)]


@dataclass(frozen=True)
class InstantSolver(Solver):
    """Answers at once, with a curve as long as those of the embedded solver."""

    def identity(self, request: Request) -> dict[str, Any]:
        """Return levels and diameter."""
        return {"kind": "instant", "levels": dict(request.levels), "diameter": request.diameter}

    def solve(self, request: Request) -> Answer:
        """Answer the sum of the levels."""
        details = {"curve": {"travel": CURVE, "force": CURVE}}
        return Answer("ok", force=sum(request.levels.values()), details=details)


def main() -> None:
    """Measure with the executor that the command line names."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    address = sys.argv[2] if len(sys.argv) > 2 else ""
    for count in (100, runs):
        with executor_of(address) as executor, tempfile.TemporaryDirectory() as place:
            measure(executor, Path(place), count)


def executor_of(address: str) -> Executor:
    """Return the executor at an address, the local one without."""
    if not address:
        return LocalExecutor()
    from stemcal.runs.executors.cluster import DaskExecutor

    return DaskExecutor(address.removeprefix("dask://"))


def measure(executor: Executor, place: Path, runs: int) -> None:
    """Print throughput and memory of a study of `runs` runs, computed and then read again."""
    solver = InstantSolver()
    requests = [Request("screen", row, {"a": float(row), "b": 2.0, "c": 3.0}, 8.0) for row in range(runs)]
    executor.submit(abs, 1).result()  # workers have started
    with StudyFolder(place / "study") as folder:
        computed = timed(requests, solver, folder, executor)
        read = timed(requests, solver, folder, executor)
    print(
        f"{type(executor).__name__}: {runs} runs, {runs / computed:.0f} runs/s, {1000 * computed / runs:.2f} ms each; "
        f"read again {1000 * read / runs:.2f} ms each{peak_memory()}"
    )


def peak_memory() -> str:
    """Return the most memory this process ever had, where the system tells."""
    try:
        import resource
    except ImportError:
        return ""
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return f"; at most {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit:.0f} MiB"


def timed(requests: list[Request], solver: InstantSolver, folder: StudyFolder, executor: Executor) -> float:
    """Return how many seconds it takes to answer the requests."""
    begun = time.perf_counter()
    answers = answer_all(requests, solver, folder, executor)
    assert [answer.force for answer in answers] == [sum(request.levels.values()) for request in requests]
    return time.perf_counter() - begun


if __name__ == "__main__":
    import throughput  # by its name, so that workers elsewhere find the solver

    throughput.main()
