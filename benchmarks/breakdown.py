"""Print tables of the time spent in the parts of a study or of a time step.

python benchmarks/breakdown.py study [SPEC]    a study from the first import to the report, smoke.yaml by default
python benchmarks/breakdown.py step            the parts of a time step of the paper's 8 mm case

The time of a part of the element loop is the difference between the loop with and without this part, which is compiled
separately. The other parts of a step are timed one by one, each repeated from compiled code in the middle of the cut.
All times are medians of CPU time.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
import types
from collections.abc import Callable
from concurrent.futures import wait
from pathlib import Path
from typing import Any

from cases import CONFIGS, paper_cases, tests_of
from numba import njit

from stemcal.cutting.build import build
from stemcal.fem.kernels import element as kernels
from stemcal.fem.kernels import march
from stemcal.fem.kernels.compile import ONE, ZERO
from stemcal.fem.kernels.nodes import clear_pushes, kick_and_drift
from stemcal.fem.state import State, start
from stemcal.fem.stepper import _Marching
from stemcal.fem.warm import warm
from stemcal.report.gallery import write_figures
from stemcal.report.page.page import page_content, write_page
from stemcal.runs.executors.local import LocalExecutor
from stemcal.runs.study_folder import StudyFolder
from stemcal.solvers import make_solver
from stemcal.stages.fresh import make_all
from stemcal.study.reading import load_study

Rows = list[tuple[str, float]]
IMPORTS = "import stemcal.cli.app, stemcal.stages.fresh, stemcal.solvers.embedded, stemcal.report.page.page"


def table(title: str, unit: str, rows: Rows) -> None:
    """Print parts with their shares of the whole, which is the first row."""
    whole = rows[0][1]
    print(f"\n{title}")
    for name, value in rows:
        print(f"  {name:34s} {value:10.2f} {unit} {100.0 * value / whole:6.1f} %")


def seconds_of(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Return how long something takes."""
    begun = clock()
    work()
    return clock() - begun


# ---- a study


def study(spec: Path = CONFIGS / "smoke.yaml") -> None:
    """Print the parts of a study, and what it takes to be shown again."""
    with tempfile.TemporaryDirectory() as place:
        rows, again = parts_of_study(spec, Path(place))
    whole = sum(seconds for _, seconds in rows)
    table(f"{spec.name}, kernels compiled, all cores, one by one", "s", [("all parts", whole), *rows])
    print(f"  the finished study run again {again:17.2f} s")


def parts_of_study(spec: Path, out: Path) -> tuple[Rows, float]:
    """Return the seconds of each part, and of the command on the finished study."""
    imports = seconds_of(lambda: subprocess.run([sys.executable, "-c", IMPORTS], check=True))
    asked, folder = load_study(spec), StudyFolder(out)
    with LocalExecutor() as executor:
        starting = seconds_of(lambda: by_each_worker(executor, make_solver(asked).get_ready))
        first = seconds_of(lambda: make_all(asked, folder, executor))
        (out / "screen.json").unlink()  # the stages are made again, from the records
        statistic = seconds_of(lambda: make_all(asked, folder, executor))
        what = page_content(asked, folder)
        plots = [plot for plot in what.plots if plot.on_page]
        drawing = seconds_of(lambda: [(plot.document, plot.pixels) for plot in plots])
    page = seconds_of(lambda: write_page(out / "report.html", what))
    writing = seconds_of(lambda: write_figures(plots, out / "figures"))
    command = [sys.executable, "-m", "stemcal", "run", str(spec), "--out", str(out), "--quiet"]
    subprocess.run(command, check=False, capture_output=True)
    again = seconds_of(lambda: subprocess.run(command, check=False, capture_output=True))
    return [
        ("import", imports),
        ("workers: start, load the kernels", starting),
        ("simulate", first - statistic),
        ("statistics", statistic),
        ("figures", drawing),
        ("page", page),
        ("files of the figures", writing),
    ], again


def by_each_worker(executor: LocalExecutor, work: Callable[[], object]) -> None:
    """Have each worker do something that takes a while, at the same time."""
    wait([executor.submit(work) for _ in range(executor.workers)])


# ---- a step


def without(function: Any, **stubs: Any) -> Any:
    """Return a kernel compiled again with some of what it calls replaced by something that does nothing."""
    names = {**function.py_func.__globals__, **stubs}
    copy = types.FunctionType(function.py_func.__code__, names, function.py_func.__name__)
    return njit(nogil=True, error_model="numpy", fastmath={"contract", "nsz"}, forceinline=function in INLINED)(copy)


INLINED = (kernels.element, kernels.run_block, kernels.hourglass_forces)


def loop_with(**of_element: Any) -> Any:
    """Return the loop over the blocks with some parts of the elements' physics replaced."""
    advance = without(kernels.advance, element=without(kernels.element, **of_element))
    return without(kernels.add_internal_forces, run_block=without(kernels.run_block, advance=advance))


@njit(forceinline=True)
def no_return(trial, back, strain, _factor, _material):
    """Leave the trial stress as it is."""
    return trial, back, strain, strain, strain + ONE


@njit(forceinline=True)
def no_hourglass(_state, _lane, _u, _v, _w, _x, _y, _z, _l, _r, dt, _alive):
    """Resist no hourglass mode."""
    none = (ZERO * dt, ZERO * dt, ZERO * dt)
    return (none, none, none, none), none[0]


def middle_of_the_cut() -> State:
    """Return the state of the paper's 8 mm case, quarter model, at 0.15 s: the blade is in, nothing has broken."""
    state = start(build(tests_of(paper_cases(["rsm"])[:1])[0]))
    _Marching(state, 1)(0.15, state)
    return state


def step() -> None:
    """Print the parts of a step."""
    warm()
    state = middle_of_the_cut()
    whole = march_seconds(state)
    loops = {
        "all": loop_with(),
        "stress": loop_with(radial_return=no_return),
        "hourglass": loop_with(hourglass_forces=no_hourglass),
    }
    taken = in_turns({name: loop_of(loop, state) for name, loop in loops.items()})
    parts = {name: taken["all"] - taken[name] for name in loops if name != "all"}
    pieces = in_turns({name: piece_of(function, state) for name, function in PIECES.items()})
    moves = {name: pieces.pop(name) for name in ("elements: gather", "elements: scatter")}
    rows = [
        ("a step", whole),
        *moves.items(),
        ("elements: radial return", parts["stress"]),
        ("elements: hourglass", parts["hourglass"]),
        ("elements: strain, forces, the rest", taken["all"] - sum(parts.values()) - sum(moves.values())),
        *pieces.items(),
    ]
    count = len(state.topology.hexes)
    table(f"one step of {count} elements", "µs", [(name, 1e6 * seconds) for name, seconds in rows])


def march_seconds(state: State, steps: int = 400) -> float:
    """Return the seconds of a step, the median of several stretches."""

    def on() -> None:
        _Marching(state, 1)(float(state.clock.time[0] + (steps - 0.5) * state.clock.step[0]), state)

    return statistics.median(seconds_of(on, time.process_time) for _ in range(7)) / steps


def in_turns(works: dict[str, Callable[[], None]], turns: int = 9, each: int = 200) -> dict[str, float]:
    """Return the median seconds of one repetition of each work; the works take turns, `each` repetitions at a time."""
    taken: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(turns + 1):  # the first compiles
        for name, work in works.items():
            taken[name].append(seconds_of(work, time.process_time) / each)
    return {name: statistics.median(times[1:]) for name, times in taken.items()}


def loop_of(loop: Any, state: State, each: int = 200) -> Callable[[], None]:
    """Return what advances the elements so many times by nothing, so that every variant meets the same state."""
    body = state.body
    own, forces = body.state.copy(), body.f.copy("K")

    def work() -> None:
        for _ in range(each):
            loop(body.scratch, body.runs, body.targets, body.seen, own, forces, 1e-12, state.material)

    return work


@njit
def gather(n, body, _topology, _tools, _edge, _spread, _cand, _exchange, _clock, _ledger, _friction, _s, _material):
    """Gather positions and velocities of all blocks."""
    for _ in range(n):
        for b in range(body.runs.shape[0]):
            kernels.fetch(body.scratch, body.runs[b], body.seen)


@njit
def scatter(n, body, _topology, _tools, _edge, _spread, _cand, _exchange, _clock, _ledger, _friction, _s, _material):
    """Add nothing to the forces of all nodes, block by block."""
    body.scratch[:] = 0.0
    for _ in range(n):
        for b in range(body.runs.shape[0]):
            kernels.scatter(body.scratch, body.targets[b], body.f)


@njit
def contact(
    n, body, topology, tools, edge, spread, candidates, _exchange, clock, ledger, friction, settings, _material
):
    """Meet the tools."""
    for _ in range(n):
        march.meet_tools(False, body, topology, tools, edge, spread, candidates, clock, ledger, friction, settings)
        clear_pushes(body, 0.0, tools, ledger.held)
        clock.steps[0] += 1


@njit
def means(n, body, topology, _tools, _edge, _spread, _candidates, exchange, clock, _ledger, _friction, _s, _material):
    """Look what has failed by its mean strain."""
    for _ in range(n):
        march.fail_in_the_mean(body, topology, exchange, clock)
        clock.steps[0] += 1


@njit
def time_step(
    n, body, topology, _tools, _edge, _spread, _cand, _exchange, clock, _ledger, _friction, settings, material
):
    """Renew the time step."""
    for _ in range(n):
        march.renew_time_step(body, clock, settings)
        clock.steps[0] += 1


@njit
def nodes(n, body, _topology, tools, _edge, _spread, _cand, _exchange, clock, ledger, _friction, _settings, _material):
    """Move nodes and tools."""
    for _ in range(n):
        kick_and_drift(body, 1e-15, 1e-15, ledger.node_sums, 0, len(ledger.node_sums))
        march.finish_step(body, tools, clock, ledger)


PIECES = {
    "elements: gather": gather, "elements: scatter": scatter, "contact": contact, "mean strains": means,
    "time step": time_step, "nodes, tools, books": nodes,
}  # fmt: skip


def piece_of(function: Any, state: State, each: int = 200) -> Callable[[], None]:
    """Return what repeats a piece of a step."""
    s = state
    arguments = (
        s.body, s.topology, s.tools, s.edge, s.spread, s.candidates, s.exchange, s.clock, s.ledger, s.friction,
        s.settings, s.material,
    )  # fmt: skip
    return lambda: function(each, *arguments)


if __name__ == "__main__":
    topic, *rest = sys.argv[1:] or ["step"]
    {"study": study, "step": step}[topic](*map(Path, rest))
