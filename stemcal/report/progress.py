"""The progress bar: a bar on a terminal and in Jupyter, a line now and then elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

from stemcal.stages.base import STAGES

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

    from stemcal.runs.answer import Progress

SPARSE_SECONDS = 30.0
TITLES = {stage.name: stage.title for stage in STAGES}


def make_watch(console: Console | None) -> Watcher:
    """Return the watcher that suits a console, a silent one without; use it as a context manager."""
    if console is None:
        return Watcher()
    return Bar(console) if console.is_terminal else Lines(console)


def notebook_watch(wanted: bool | None = None) -> Watcher:
    """Return a bar in a terminal and in Jupyter, silence elsewhere; `wanted` decides otherwise."""
    from rich.console import Console

    console = Console(stderr=True)
    shown = console.is_terminal or console.is_jupyter
    return Bar(console) if (shown if wanted is None else wanted) else Watcher()


def describe(progress: Progress) -> str:
    """Return one line on where a stage stands.

    >>> from types import SimpleNamespace as Progress
    >>> describe(Progress(stage="screen", done=5, total=12, cached=2, failed=1, last_force=120.43))
    'Screening: 5/12 runs, 2 from earlier, 1 failed, last 120.4 N'
    """
    parts = [f"{TITLES.get(progress.stage, progress.stage)}: {progress.done}/{progress.total} runs"]
    if progress.cached:
        parts.append(f"{progress.cached} from earlier")
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    if progress.last_force is not None:
        parts.append(f"last {progress.last_force:.1f} N")
    return ", ".join(parts)


class Watcher:
    """Watches and says nothing; the others say more."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def __call__(self, progress: Progress) -> None:
        """Take a progress report."""


class Lines(Watcher):
    """A line at a stage's start and end, and one every half minute between."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic) -> None:
        self.console, self.clock = console, clock
        self.stage, self.last_line, self.last_time = "", "", -SPARSE_SECONDS

    def __call__(self, progress: Progress) -> None:
        """Print the line if it is new and due."""
        line = describe(progress)
        edge = progress.stage != self.stage or progress.done >= progress.total
        due = self.clock() - self.last_time >= SPARSE_SECONDS
        if line != self.last_line and (edge or due):
            self.console.print(line, soft_wrap=True)
            self.stage, self.last_line, self.last_time = progress.stage, line, self.clock()


class Bar(Watcher):
    """A bar per stage: runs done, time left, failures and the last force."""

    def __init__(self, console: Console) -> None:
        self.bars = _bars(console)
        self.tasks: dict[str, TaskID] = {}

    def __enter__(self) -> Self:
        self.bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bars.stop()

    def __call__(self, progress: Progress) -> None:
        """Move the stage's bar."""
        name = TITLES.get(progress.stage, progress.stage)
        if progress.stage not in self.tasks:
            self.tasks[progress.stage] = self.bars.add_task(name, total=progress.total, tail="")
        tail = describe(progress).partition(" runs")[2].lstrip(", ")
        self.bars.update(self.tasks[progress.stage], completed=progress.done, total=progress.total, tail=tail)


def _bars(console: Console) -> Bars:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=12),
        MofNCompleteColumn(),
        TimeRemainingColumn(compact=True, elapsed_when_finished=True),
        TextColumn("{task.fields[tail]}", markup=False),
        console=console,
        speed_estimate_period=600,
    )
