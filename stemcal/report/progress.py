"""Progress of runs: a bar on a terminal and in Jupyter, otherwise a line every half minute."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Self

from stemcal.formats import significant
from stemcal.stages.stage import STAGES
from stemcal.vocabulary import CUTTING, Vocabulary, Wording

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

    from stemcal.runs.answer import Progress

_SPARSE_SECONDS = 30.0
COMPILING = "compiling the solver for this machine (required only once, about half a minute)"
_OTHERS = {"material": "Failure strain for this element size"}


def _title(stage: str) -> str:
    if stage in _OTHERS:  # not a stage: a look-up would read the entry points of all packages
        return _OTHERS[stage]
    known = STAGES.named(stage)
    return stage if known is None else known.title


def make_watch(console: Console | None, naming: Vocabulary = CUTTING) -> Watcher:
    """Return a context manager that shows progress: a bar on a terminal, lines on another console, else nothing."""
    if console is None:
        return Watcher()
    return _Bar(console, naming=naming) if console.is_terminal else _Lines(console, naming=naming)


def notebook_watch(wanted: bool | None = None, naming: Vocabulary = CUTTING) -> Watcher:
    """Return a context manager that shows a progress bar if `wanted`; by default in a terminal and in Jupyter."""
    from rich.console import Console

    console = Console(stderr=True)
    shown = console.is_terminal or console.is_jupyter
    return _Bar(console, naming=naming) if (shown if wanted is None else wanted) else Watcher()


def describe(progress: Progress, naming: Vocabulary = CUTTING) -> str:
    """Return one line on the progress of a stage.

    >>> from types import SimpleNamespace as Progress
    >>> describe(Progress(stage="screen", done=5, total=12, cached=2, failed=1, last_response=120.43,
    ...                   last_condition=8.0, preparing=False, points=14))
    'Screening: 5/12 runs for 14 design points, 2 from earlier, 1 failed, last 120.4 N at 8 mm'
    """
    title = _title(progress.stage)
    if progress.preparing:
        return f"{title}: {COMPILING}"
    repeated = f" for {progress.points} design points" if progress.points > progress.total else ""
    return ", ".join([f"{title}: {progress.done}/{progress.total} runs{repeated}", *_remarks(progress, naming)])


def _remarks(progress: Progress, naming: Vocabulary) -> list[str]:
    counts = (progress.cached, "from earlier"), (progress.failed, "failed")
    remarks = [f"{count} {what}" for count, what in counts if count]
    if progress.last_response is not None:
        place, known = progress.last_condition, naming.condition is not None
        at = f" at {Wording(naming).conditions([place])}" if known and place is not None else ""
        value = significant(progress.last_response)
        remarks.append(f"last {value}{naming.response.unit_suffix}{at}")
    return remarks


class Watcher:
    """Base class of progress displays: receives progress reports and prints nothing."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def __call__(self, progress: Progress) -> None:
        """Receive a progress report."""

    def busy(self, what: str) -> None:
        """Receive the name of the step that follows the runs."""


class _Lines(Watcher):
    """Prints a line at the start and end of a stage, and every half minute."""

    def __init__(
        self, console: Console, clock: Callable[[], float] = time.monotonic, naming: Vocabulary = CUTTING
    ) -> None:
        self.console, self.clock, self.naming = console, clock, naming
        self.stage, self.completed, self.last_line, self.last_time = "", "", "", -_SPARSE_SECONDS

    def __call__(self, progress: Progress) -> None:
        line = describe(progress, self.naming)
        complete = progress.done >= progress.total and self.completed != progress.stage  # only one line at the end
        begins_or_ends = progress.stage != self.stage or complete or progress.preparing
        due = self.clock() - self.last_time >= _SPARSE_SECONDS
        if complete:
            self.completed = progress.stage
        if line != self.last_line and (begins_or_ends or due):
            self.console.print(line, soft_wrap=True)
            self.stage, self.last_line, self.last_time = progress.stage, line, self.clock()


class _Bar(Watcher):
    """Shows a bar for each stage: runs done, elapsed and remaining time, failures, last response."""

    def __init__(self, console: Console, naming: Vocabulary = CUTTING) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        self.naming = naming
        self.tasks: dict[str, TaskID] = {}
        self.bars = Bars(
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=12),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(compact=True),
            TextColumn("{task.fields[tail]}", markup=False),
            console=console,
            redirect_stdout=False,  # otherwise data for standard output would go to standard error
        )

    def __enter__(self) -> Self:
        self.bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bars.stop()

    def __call__(self, progress: Progress) -> None:
        """Update the bar of the stage; the bar pulses while the solver is compiled."""
        stage, compiling = progress.stage, progress.preparing
        if stage not in self.tasks:
            self.busy(_title(stage), stage)
        tail = "compiling, once" if compiling else ", ".join(_remarks(progress, self.naming))
        total = None if compiling else progress.total
        self.bars.update(self.tasks[stage], completed=progress.done, total=total, tail=tail)

    def busy(self, what: str, stage: str = "") -> None:
        self.tasks[stage] = self.bars.add_task(what, total=None, tail="")
