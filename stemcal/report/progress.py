"""The progress bar: a bar on a terminal and in Jupyter, a line now and then elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

from stemcal.naming import CUTTING, FORCE, Naming
from stemcal.numbers import duration, significant
from stemcal.stages.base import STAGES
from stemcal.text.language import say
from stemcal.text.runs import compiling
from stemcal.text.tables import line
from stemcal.words import counted

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bars

    from stemcal.runs.answer import Progress

SPARSE_SECONDS = 30.0
TITLES = {stage.name: stage.title for stage in STAGES} | {"regularise": line("regularisation")}
_ENOUGH = 2  # runs from which their mean time tells how long the others take


def make_watch(console: Console | None, naming: Naming = CUTTING) -> Watcher:
    """Return the watcher that suits a console, a silent one without; use it as a context manager."""
    if console is None:
        return Watcher()
    return Bar(console, naming=naming) if console.is_terminal else Lines(console, naming=naming)


def notebook_watch(wanted: bool | None = None, naming: Naming = CUTTING) -> Watcher:
    """Return a bar in a terminal and in Jupyter, silence elsewhere; `wanted` decides otherwise."""
    from rich.console import Console

    console = Console(stderr=True)
    shown = console.is_terminal or console.is_jupyter
    return Bar(console, naming=naming) if (shown if wanted is None else wanted) else Watcher()


def describe(progress: Progress, naming: Naming = CUTTING) -> str:
    """Return one line on where a stage stands.

    >>> from types import SimpleNamespace as Progress
    >>> describe(Progress(stage="screen", done=5, total=12, cached=2, failed=1, last_response=120.43,
    ...                   last_condition=8.0, preparing=0.0, counts="run"))
    'Screening: 5/12 runs, 2 from earlier, 1 failed, last 120.4 N at 8 mm'
    """
    title = TITLES.get(progress.stage, progress.stage)
    if progress.preparing != 0.0:
        return f"{title}: {compiling(progress.preparing)}"
    parts = [f"{title}: {_stand(progress)}"]
    if progress.cached:
        parts.append(f"{progress.cached} from earlier")
    if progress.failed:
        parts.append(f"{progress.failed} failed")
    if progress.last_response is not None:
        parts.append(f"last {_response(progress, naming)}")
    return ", ".join(parts)


def _stand(progress: Progress) -> str:
    """Say how many rows are done, or which of them is computed where each takes several runs."""
    done, total = progress.done, progress.total
    if progress.counts == "run":
        return f"{done}/{total} runs"
    return f"{progress.counts} {done + 1} of {total}" if done < total else counted(total, progress.counts)


def _response(progress: Progress, naming: Naming) -> str:
    at = "" if progress.last_condition is None else naming.at(progress.last_condition)
    value = f"{progress.last_response:.1f}" if naming.response == FORCE else significant(progress.last_response)
    return f"{value}{naming.response.unit_suffix}{at}"


class Watcher:
    """Watches and says nothing; the others say more."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        return None

    def __call__(self, progress: Progress) -> None:
        """Take a progress report."""

    def expect(self, stages: Mapping[str, tuple[int, int]]) -> None:
        """Take what is to come: the rows of each stage and how many of them are to be computed."""

    def busy(self, what: str) -> None:
        """Take what is done now that the runs are."""

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Make room within this block for what is printed between two stages."""
        yield


class Lines(Watcher):
    """A line at a stage's start and end, where a further size begins, and one every half minute between."""

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic, naming: Naming = CUTTING) -> None:
        self.console, self.clock, self.naming = console, clock, naming
        self.stage, self.done, self.last_line, self.last_time = "", 0, "", -SPARSE_SECONDS

    def __call__(self, progress: Progress) -> None:
        """Print the line if it is new and due."""
        line = describe(progress, self.naming)
        edge = progress.stage != self.stage or progress.done >= progress.total or progress.preparing != 0.0
        edge = edge or (progress.counts != "run" and progress.done != self.done)
        due = self.clock() - self.last_time >= SPARSE_SECONDS
        if line != self.last_line and (edge or due):
            self.console.print(line, soft_wrap=True)
            self.stage, self.done, self.last_line, self.last_time = progress.stage, progress.done, line, self.clock()


@dataclass
class _Course:
    """How far the stages are, and how long the rest will take at the pace of the runs so far."""

    rows: dict[str, int] = field(default_factory=dict)
    missing: dict[str, int] = field(default_factory=dict)
    done: dict[str, int] = field(default_factory=dict)
    computed: dict[str, int] = field(default_factory=dict)
    rounds: dict[str, Progress] = field(default_factory=dict)  # the last report of each stage
    began: float | None = None

    def add(self, progress: Progress) -> None:
        """Count a report. A stage that decides its runs one by one begins anew each time: its rounds add up."""
        stage, before = progress.stage, self.rounds.get(progress.stage)
        anew = before is not None and progress.done < before.done
        base = self.done.get(stage, 0) if anew or before is None else self.done[stage] - before.done
        made = self.computed.get(stage, 0) if anew or before is None else self.computed[stage] - _made(before)
        self.done[stage], self.computed[stage] = base + progress.done, made + _made(progress)
        self.rows[stage] = base + progress.total
        self.missing[stage] = self.computed[stage] + progress.total - progress.done
        self.rounds[stage] = progress

    def left(self, now: float) -> str:
        """Say how long the runs that are still to be computed will take; nothing as long as too few are done."""
        made = sum(self.computed.values())
        if made < _ENOUGH or self.began is None:
            return ""
        rest = sum(self.missing.values()) - made
        return f"{duration((now - self.began) / made * rest)} left" if rest > 0 else ""


def _made(progress: Progress) -> int:
    return progress.done - progress.cached


class Bar(Watcher):
    """One bar for the whole command: its stage, runs done of all, time left to the end, failures, the last answer.

    A stage that is done leaves a line behind.
    """

    def __init__(self, console: Console, clock: Callable[[], float] = time.monotonic, naming: Naming = CUTTING) -> None:
        self.console, self.clock, self.naming = console, clock, naming
        self.bars = _bars(console, self._waited)
        self.task = self.bars.add_task("", total=None, runs="", tail="")
        self.course, self.stage, self.since = _Course(), "", 0.0
        self.waiting_since: float | None = None
        self.reached = 0.0  # of the bar: more runs may be decided on, and it goes back for none of them

    def __enter__(self) -> Self:
        self.bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bars.stop()
        self._leave_line()

    def __call__(self, progress: Progress) -> None:
        """Move the bar."""
        if progress.stage != self.stage:
            self._leave_line()
            self.stage, self.since = progress.stage, self.clock()
        course = self.course
        course.add(progress)
        if course.began is None or progress.preparing != 0.0 or not sum(course.computed.values()):
            course.began = self.clock()  # neither compiling nor reading records tells how long a run takes
        if progress.preparing == 0.0:
            self.waiting_since = None
        elif self.waiting_since is None:
            self.waiting_since = self.clock()
        done, total = sum(course.done.values()), sum(course.rows.values())
        self.reached = max(self.reached, done / total if total else 0.0)
        self.bars.update(
            self.task,
            description=TITLES.get(progress.stage, progress.stage),
            completed=self.reached * total,
            total=None if progress.preparing != 0.0 else total,  # without a total the bar pulses
            runs=f"{done}/{total}" if progress.counts == "run" else _stand(progress),
            tail=say("compiling, once") if progress.preparing != 0.0 else self._tail(progress),
        )

    def expect(self, stages: Mapping[str, tuple[int, int]]) -> None:
        """Take the rows of the stages to come into the bar."""
        self.course.rows |= {name: rows for name, (rows, _) in stages.items()}
        self.course.missing |= {name: missing for name, (_, missing) in stages.items()}

    def busy(self, what: str) -> None:
        """Leave the last stage's line and show what is done now."""
        self._leave_line()
        self.bars.update(self.task, description=what, total=None, completed=0, runs="", tail="")

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Take the bar away within this block."""
        self.bars.stop()
        self._leave_line()
        try:
            yield
        finally:
            self.bars.start()

    def _waited(self) -> str:
        """Say how long the present wait has lasted, if there is one."""
        return "" if self.waiting_since is None else f"({duration(self.clock() - self.waiting_since)})"

    def _tail(self, progress: Progress) -> str:
        failed = f"{progress.failed} failed" if progress.failed else ""
        last = _response(progress, self.naming) if progress.last_response is not None else ""
        return ", ".join(part for part in (self.course.left(self.clock()), failed, last) if part)

    def _leave_line(self) -> None:
        """Say what became of the stage so far, once."""
        last = self.course.rounds.get(self.stage)
        if last is None:
            return
        done, total = self.course.done[self.stage], self.course.rows[self.stage]
        cached = done - self.course.computed[self.stage]
        runs = counted(done, last.counts) if done == total else f"{done} of {total} {last.counts}s"
        parts = [f"{TITLES.get(self.stage, self.stage)}: {runs}"]
        parts += [f"{cached} from earlier"] if cached else []
        parts += [f"{last.failed} failed"] if last.failed else []
        self.console.print(f"{', '.join(parts)}, {duration(self.clock() - self.since)}", soft_wrap=True)
        self.stage = ""


def _bars(console: Console, waited: Callable[[], str]) -> Bars:
    from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    class Waited(ProgressColumn):
        """Tells how long is waited, anew each time that it is drawn."""

        def render(self, task: Task) -> Text:
            return Text(waited())

    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=12),
        TextColumn("{task.fields[runs]}", markup=False),
        TextColumn("{task.fields[tail]}", markup=False),
        Waited(),
        console=console,
        transient=True,
    )
