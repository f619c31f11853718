"""Print results on stdout, and all other messages on stderr."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from stemcal.processes.outputs import drop
from stemcal.storage.encodings import visible

if TYPE_CHECKING:
    from stemcal.drawing.table import Table


def stderr() -> _Terminal:
    """Return a console for progress, notes and errors."""
    return _Terminal(stderr=True)


def say(*parts: RenderableType) -> None:
    """Print results on stdout, one below the other."""
    console = _Terminal(stderr=False)
    for part in parts:
        console.print(part)


def say_tables(*tables: Table) -> None:
    """Print tables on stdout, one below the other."""
    from stemcal.report.terminal import table_drawn

    say(*(part for table in tables for part in table_drawn(table)))


def say_whole(*lines: str) -> None:
    """Print lines on stdout without breaking them, so that the paths in them can be copied."""
    for line in lines:
        _Terminal(stderr=False).print(line, soft_wrap=True)


def say_text(text: str) -> None:
    """Print a text on stdout without changes."""
    with suppress(BrokenPipeError):  # the reader has closed the pipe
        print(text, flush=True)


@dataclass
class _Envelope:
    """The JSON object that a command prints at its end: `{command, status, result, notes}`."""

    command: str = ""
    result: Any = None
    notes: list[dict[str, Any]] = field(default_factory=list)

    def add(self, severity: str, text: str) -> None:
        self.notes.append({"kind": severity, "severity": severity, "text": text, "remedy": None})

    def print(self, status: str) -> None:
        """Print the object on stdout, in ASCII so that every terminal can show it; NaN becomes null."""
        if not self.command:
            return
        from stemcal.storage.canonical import jsonable

        envelope = {"command": self.command, "status": status, "result": jsonable(self.result), "notes": self.notes}
        self.command = ""
        say_text(json.dumps(envelope, indent=2, ensure_ascii=True, allow_nan=False))


envelope = _Envelope()


def say_json(result: Any) -> None:
    """Store a result in the JSON envelope, which is printed when the command ends."""
    envelope.result = result


def warn(sentence: str) -> None:
    """Print a warning on stderr; in a terminal, its lines are wrapped."""
    envelope.add("warning", sentence)
    _labelled("warning", "yellow", sentence, whole=not stderr().is_terminal)


def fail(message: str) -> None:
    """Print an error message on stderr without breaking its lines, so that paths can be copied."""
    envelope.add("error", message)
    _labelled("error", "red", message, whole=True)


def await_(message: str) -> None:
    """Print on stderr which results a study waits for, without breaking lines, so that the command can be copied."""
    envelope.add("info", message)
    stderr().print(message, style="cyan", soft_wrap=True, highlight=False, markup=False)


def note(sentence: str) -> None:
    """Print a remark on stderr."""
    envelope.add("info", sentence.removeprefix("note: "))
    console = stderr()
    console.print(sentence, style="dim", soft_wrap=not console.is_terminal)


class _ToWarnings(logging.Handler):
    """Logging handler that prints messages as warnings."""

    def emit(self, record: logging.LogRecord) -> None:
        warn(record.getMessage())


def route_log() -> None:
    """Print warnings that stemcal logs on stderr, in the same form as the warnings of commands."""
    log = logging.getLogger("stemcal")
    if not any(isinstance(handler, _ToWarnings) for handler in log.handlers):
        log.addHandler(_ToWarnings(logging.WARNING))


def waiting(what: str, quiet: bool) -> AbstractContextManager[object]:
    """Show a spinner with the text `what` during a ``with`` block, if stderr is a terminal and not `quiet`."""
    console = stderr()
    return console.status(what) if console.is_terminal and not quiet else nullcontext()


def _labelled(label: str, colour: str, text: str, whole: bool) -> None:
    console = stderr()
    console.print(Text.assemble((f"{label}: ", f"bold {colour}"), text), soft_wrap=whole)


class _Terminal(Console):
    """A console of at most 80 columns that prints text without markup."""

    WIDEST = 80

    def __init__(self, stderr: bool) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)
        if self.width > self.WIDEST:
            self.width = self.WIDEST

    def on_broken_pipe(self) -> None:
        """Discard further output and continue, if the program that reads the output has closed the pipe."""
        drop(self.file)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the printed segments, with the control characters in texts escaped."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)
