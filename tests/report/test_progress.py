import io
import re
from dataclasses import replace
from typing import Any

from rich.console import Console

from stemcal.report.progress import Watcher, _Bar, _Lines, make_watch
from stemcal.runs.answer import Progress


def progress(done: int, **changes: Any) -> Progress:
    base = Progress(stage="screen", done=done, total=12, cached=0, failed=0, last_response=None)
    return replace(base, **changes)


def shown(out: io.StringIO) -> str:
    """Return what a terminal was sent, without its escape sequences."""
    return re.sub(r"\x1b\[[\d?]*[A-Za-z]", "", out.getvalue())


def bar(out: io.StringIO) -> _Bar:
    return _Bar(Console(file=out, width=100, force_terminal=True, color_system=None))


def test_lines_are_sparse() -> None:
    out, clock = io.StringIO(), iter([0.0, 0.0, 1.0, 31.0, 31.0, 32.0, 33.0, 33.0])
    with _Lines(Console(file=out, width=200), clock=lambda: next(clock)) as watch:
        for done in (0, 1, 2, 3):
            watch(progress(done, last_response=100.0))
        watch(progress(12, failed=1, last_response=90.0, last_condition=7.0))
    assert out.getvalue().splitlines() == [
        "Screening: 0/12 runs, last 100.0 N",
        "Screening: 2/12 runs, last 100.0 N",
        "Screening: 12/12 runs, 1 failed, last 90.00 N at 7 mm",
    ]


def test_compiling_is_said_where_a_bar_would_stand_still() -> None:
    out, lines = io.StringIO(), io.StringIO()
    for watch in (bar(out), _Lines(Console(file=lines, width=200))):
        with watch:
            watch(progress(0))
            watch(progress(0, preparing=True))
    assert "compiling, once" in shown(out)
    assert lines.getvalue().splitlines()[-1] == (
        "Screening: compiling the solver for this machine (required only once, about half a minute)"
    )


def test_bar_shows_count_failures_and_force() -> None:
    out = io.StringIO()
    with bar(out) as watch:
        watch(progress(5, cached=2, failed=1, last_response=120.43, last_condition=8.0))
    assert "5/12" in shown(out) and "2 from earlier, 1 failed, last 120.4 N at 8 mm" in shown(out)


def test_quiet_watches_in_silence(capsys: object) -> None:
    with make_watch(None) as watch:
        watch(progress(3))
    assert type(watch) is Watcher
