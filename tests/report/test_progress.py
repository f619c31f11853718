from __future__ import annotations

import io
import re
from dataclasses import replace
from typing import Any

from rich.console import Console

from stemcal.report.progress import Bar, Lines, Watcher, make_watch
from stemcal.runs.answer import Progress


def progress(done: int, **changes: Any) -> Progress:
    base = Progress(stage="screen", done=done, total=12, cached=0, failed=0, last_response=None)
    return replace(base, **changes)


def shown(out: io.StringIO) -> str:
    """Return what a terminal was sent, without its escape sequences."""
    return re.sub(r"\x1b\[[\d?]*[A-Za-z]", "", out.getvalue())


def bar(out: io.StringIO, *times: float) -> Bar:
    """Return a bar whose clock shows these times, the last one ever after."""
    left = list(times)
    clock = (lambda: left.pop(0) if len(left) > 1 else left[0]) if left else (lambda: 0.0)
    return Bar(Console(file=out, width=80, force_terminal=True, color_system=None), clock)


def test_lines_are_sparse() -> None:
    out, clock = io.StringIO(), iter([0.0, 0.0, 1.0, 31.0, 31.0, 32.0, 33.0, 33.0])
    with Lines(Console(file=out, width=200), clock=lambda: next(clock)) as watch:
        for done in (0, 1, 2, 3):
            watch(progress(done, last_response=100.0))
        watch(progress(12, failed=1, last_response=90.0, last_condition=7.0))
    assert out.getvalue().splitlines() == [
        "Screening: 0/12 runs, last 100.0 N",
        "Screening: 2/12 runs, last 100.0 N",
        "Screening: 12/12 runs, 1 failed, last 90.0 N at 7 mm",
    ]


def test_sizes_are_told_where_each_takes_several_runs() -> None:
    """A line for each, none for each of their runs; what the bar leaves behind has the same words."""
    out, lines = io.StringIO(), io.StringIO()
    for watch in (bar(out), Lines(Console(file=lines, width=200), clock=lambda: 0.0)):
        with watch:
            for done, force in ((0, 90.0), (0, 110.0), (1, 100.0), (1, 110.0), (2, None)):
                watch(Progress("regularise", done, 2, 0, 0, force, counts="size"))
    title = "Failure strain over element size"
    assert lines.getvalue().splitlines() == [
        f"{title}: size 1 of 2, last 90.0 N",
        f"{title}: size 2 of 2, last 100.0 N",
        f"{title}: 2 sizes",
    ]
    assert f"{title}: 2 sizes, " in shown(out)


def test_compiling_is_said_where_a_bar_would_stand_still() -> None:
    out, lines = io.StringIO(), io.StringIO()
    for watch in (bar(out), Lines(Console(file=lines, width=200))):
        with watch:
            watch(progress(0))
            watch(progress(0, preparing=31.4))
    assert "0/12 compiling, once" in shown(out)
    assert lines.getvalue().splitlines()[-1] == (
        "Screening: compiling the solver for this machine (31 s last time, once for all studies)"
    )


def test_a_wait_tells_how_long_it_has_lasted() -> None:
    out, now = io.StringIO(), [0.0]
    with Bar(Console(file=out, width=80, force_terminal=True, color_system=None), clock=lambda: now[0]) as watch:
        watch(progress(0, preparing=20.0))
        now[0] = 17.0
        watch(progress(0, preparing=20.0))
        watch.bars.refresh()
        assert "(17 s)" in shown(out)
        watch(progress(1))
        now[0] = 60.0
        watch(progress(2))
        watch.bars.refresh()
    assert "(60 s)" not in shown(out)


def test_the_bar_never_goes_back_when_more_runs_are_decided_on() -> None:
    lengths = []
    with bar(io.StringIO()) as watch:
        for stage, done, total in (
            ("screen", 12, 12),
            ("rsm", 0, 14),
            ("rsm", 7, 14),
            ("refine", 0, 5),
            ("rsm", 14, 14),
        ):
            watch(progress(done, stage=stage, total=total))
            task = watch.bars.tasks[0]
            lengths.append(task.completed / task.total)
    assert lengths == sorted(lengths) and lengths[0] == 1.0


def test_bar_shows_count_failures_and_force() -> None:
    out = io.StringIO()
    with bar(out) as watch:
        watch(progress(5, cached=2, failed=1, last_response=120.43, last_condition=8.0))
    assert "5/12" in shown(out) and "1 failed, 120.4 N at 8 mm" in shown(out)
    assert shown(out).splitlines()[-1].startswith("Screening: 5 of 12 runs, 2 from earlier, 1 failed, ")


def test_one_bar_tells_the_time_to_the_end_of_all_stages() -> None:
    """Four runs took 40 s: the 8 left of this stage, 10 to come of the next and none of the recorded take 180 s."""
    out, now = io.StringIO(), [0.0]
    watch = Bar(Console(file=out, width=80, force_terminal=True, color_system=None), clock=lambda: now[0])
    watch.expect({"screen": (12, 12), "rsm": (14, 10), "validate": (3, 0)})
    with watch:
        watch(progress(0))
        now[0] = 40.0
        watch(progress(4))
    assert "4/29 3 min left" in shown(out)


def test_rounds_of_a_stage_that_decides_them_one_by_one_add_up() -> None:
    out = io.StringIO()
    with bar(out) as watch:
        for _ in range(3):
            watch(progress(0, stage="refine", total=1))
            watch(progress(1, stage="refine", total=1))
    assert "Refinement: 3 runs, " in shown(out)


def test_a_stage_that_is_done_leaves_its_line_above_what_is_printed() -> None:
    out = io.StringIO()
    with bar(out, 0.0, 0.0, 34.0) as watch:
        watch(progress(12))
        with watch.aside():
            out.write("TABLE\n")
        watch(progress(3, stage="rsm", total=3))
    text = shown(out)
    assert text.index("Screening: 12 runs, 34 s\n") < text.index("TABLE") < text.index("Response surface: 3 runs")


def test_quiet_watches_in_silence(capsys: object) -> None:
    with make_watch(None) as watch:
        watch(progress(3))
    assert type(watch) is Watcher
