from __future__ import annotations

import io
from dataclasses import replace

from rich.console import Console

from stemcal.report.progress import Bar, Lines, Watcher, make_watch
from stemcal.runs.answer import Progress


def progress(done: int, **changes: object) -> Progress:
    base = Progress(stage="screen", done=done, total=12, cached=0, failed=0, last_force=None)
    return replace(base, **changes)  # type: ignore[arg-type]


def test_lines_are_sparse() -> None:
    out, clock = io.StringIO(), iter([0.0, 0.0, 1.0, 31.0, 31.0, 32.0, 33.0, 33.0])
    with Lines(Console(file=out, width=200), clock=lambda: next(clock)) as watch:
        for done in (0, 1, 2, 3):
            watch(progress(done, last_force=100.0))
        watch(progress(12, failed=1, last_force=90.0))
    assert out.getvalue().splitlines() == [
        "Screening: 0/12 runs, last 100.0 N",
        "Screening: 2/12 runs, last 100.0 N",
        "Screening: 12/12 runs, 1 failed, last 90.0 N",
    ]


def test_bar_shows_count_failures_and_force() -> None:
    out = io.StringIO()
    console = Console(file=out, width=80, force_terminal=True, color_system=None)
    with Bar(console) as watch:
        watch(progress(5, cached=2, failed=1, last_force=120.43))
    assert "5/12" in out.getvalue()
    assert "2 from earlier, 1 failed, last 120.4 N" in out.getvalue()


def test_quiet_watches_in_silence(capsys: object) -> None:
    with make_watch(None) as watch:
        watch(progress(3))
    assert type(watch) is Watcher
