"""How a fault is tried: so many times, each time in a folder of its own, with a seed, and what came of it counted."""

from __future__ import annotations

import random
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

__all__ = ["Fault", "Missing", "Tally", "each"]


class Missing(Exception):
    """What the trial needs is not there: a right, a tool, an operating system."""


@dataclass
class Tally:
    """How often a fault was tried, and what each trial that was not survived says."""

    tried: int = 0
    broken: list[str] = field(default_factory=list)
    remark: str = ""

    @property
    def survived(self) -> int:
        """How many trials went as they must."""
        return self.tried - len(self.broken)


Trials = Callable[[Path, int, random.Random], Tally]
Trial = Callable[[Path, int, random.Random], None]


@dataclass(frozen=True)
class Fault:
    """One row: the fault, how it is caused, what must come of it, and how often it is tried."""

    name: str
    cause: str
    must: str
    trials: Trials
    quick: int
    long: int


def each(trial: Trial) -> Trials:
    """Return the trials of which one is `trial(folder, number, random)`; a loss is an `AssertionError` or a
    command that does not end.
    """

    def trials(place: Path, times: int, rng: random.Random) -> Tally:
        tally = Tally()
        for number in range(times):
            folder = place / f"trial-{number}"
            folder.mkdir(parents=True)
            tally.tried += 1
            try:
                trial(folder, number, rng)
            except (AssertionError, subprocess.TimeoutExpired) as error:
                tally.broken.append(f"trial {number}: {str(error).strip()[:400]}")
            shutil.rmtree(folder, ignore_errors=True)
        return tally

    return trials
