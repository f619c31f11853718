"""Speed of the solver: rates and ratios, each the median of several runs.

python benchmarks/speed.py kernel     the blocked element kernel versus the kernel for one element at a time
python benchmarks/speed.py solver     the whole solver on the paper's 8 mm case, full model
python benchmarks/speed.py scaling    time and memory for 1,000 to 1,000,000 elements
python benchmarks/speed.py threads    two threads versus one on 200,000 elements
python benchmarks/speed.py steps      fewer steps: added mass and the stop at the break
python benchmarks/speed.py plan [SPEC ...]    time estimated by `check` and time taken by studies
python benchmarks/speed.py study      the shipped study: with compilation, without, and with 4 mesh positions
"""

from __future__ import annotations

import json
import multiprocessing
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing.synchronize import Barrier
from pathlib import Path
from typing import Any

import numpy as np
from cases import SPEC, paper_cases, tests_of
from numba import njit

from stemcal.cutting.build import build
from stemcal.cutting.parts import ShearTest
from stemcal.cutting.simulate import shear
from stemcal.fem.kernels import block
from stemcal.fem.kernels.block import LANES, states_of
from stemcal.fem.kernels.compile import RUN
from stemcal.fem.kernels.element import _follow_rates, add_internal_forces, element
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model, Precision
from stemcal.fem.state import State, start
from stemcal.fem.stepper import _Marching
from stemcal.fem.warm import warm

STEEL_FREE_FALL = Material(1.1e-5, 1000.0, 0.3, 15.0, 0.5, 0.05, 90.0, 8.0, 1e9, "paper")


def median_seconds(work: Callable[[], object], runs: int = 7) -> float:
    """Return the median time of several runs after one that is not counted."""
    work()
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


@njit(error_model="numpy", fastmath={"contract", "nsz"})
def one_by_one(scratch, runs, targets, seen, state, f, dt, material):
    """Do the same one element at a time: gather it, advance it, scatter it."""
    x, v, states = seen.x, seen.v, states_of(state)
    for b in range(runs.shape[0]):
        for lane in range(LANES):
            first = runs[b, 0, lane // RUN] + lane % RUN
            for a in range(8):
                n = runs[b, a, lane // RUN] + lane % RUN
                for i in range(3):
                    scratch[(block.COORDINATES + 8 * i + a) * LANES + lane] = x[n, i] - x[first, i]
                    scratch[(block.VELOCITIES + 8 * i + a) * LANES + lane] = v[n, i] - v[first, i]
            element(scratch, states[b], lane, dt, material)
            for a in range(8):
                n = targets[b, a, lane // RUN] + lane % RUN
                for i in range(3):
                    f[n, i] -= scratch[(block.FORCES + 8 * i + a) * LANES + lane]
        _follow_rates(states[b], dt, material)


def moving_block(counts: tuple[int, int, int], precision: Precision = "mixed") -> Model:
    """Return a block of elements that move at random, so that some yield."""
    mesh = brick(tuple(float(n) for n in counts), counts)
    velocity = np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    how = Integration(precision=precision)
    return Model(mesh=mesh, material=STEEL_FREE_FALL, velocity=velocity, integration=how)


def kernel() -> None:
    """Print the rate of the element kernel and its ratio to the element-by-element form."""
    rates, steps = {}, 200
    forms: tuple[tuple[str, Callable[..., Any], Precision], ...] = (
        ("mixed precision", add_internal_forces, "mixed"),
        ("double precision", add_internal_forces, "double"),
        ("element by element", one_by_one, "double"),
    )
    for name, function, precision in forms:
        model = moving_block((3, 24, 51), precision)  # the long way last, as stems are meshed
        state = start(model)

        def work(state: State = state, function: Callable[..., Any] = function) -> None:
            body = state.body
            for _ in range(steps):
                function(body.scratch, body.runs, body.targets, body.seen, body.state, body.f, 1e-7, state.material)

        rates[name] = steps * len(model.mesh.hexes) / median_seconds(work) / 1e6
        print(f"{name}: {rates[name]:.1f} million element-steps per second and core, {len(model.mesh.hexes)} elements")
    for name in ("mixed precision", "double precision"):
        print(f"{name}: {rates[name] / rates['element by element']:.1f} times element by element")


def solver() -> None:
    """Print the rate of the whole solver: contact, erosion, integration and output included."""
    test = tests_of(paper_cases(["rsm"])[:1])[0]
    test = replace(test, discretisation=replace(test.discretisation, symmetry="none"))
    warm()
    rates = [shear(test).element_steps_per_second / 1e6 for _ in range(5)]
    print(f"paper's 8 mm case, full model: {np.median(rates):.1f} million element-steps per second and core")


def steps() -> None:
    """Print what longer steps and the end at the break do to the paper's 8 mm case, quarter model."""
    test = tests_of(paper_cases(["rsm"])[:1])[0]
    warm()
    print("step wanted  ends at the break  steps  CPU seconds  peak force  kinetic energy  added mass")
    for wanted in (None, 20e-6, 40e-6, 60e-6, 80e-6):
        for stops in (True, False):
            how = test.discretisation
            integration = replace(how.integration, time_step=wanted)
            changed = replace(test, discretisation=replace(how, integration=integration, stop_after_peak=stops))
            begun = time.process_time()
            found = shear(changed)
            spent, added = time.process_time() - begun, added_mass_percent(changed)
            print(
                f"{'none' if wanted is None else f'{1e6 * wanted:.0f} us':>11s}  {stops!s:>17s}  {found.steps:5d}  "
                f"{spent:11.2f}  {found.peak_force:8.3f} N  {found.kinetic_ratio_percent:12.2f} %  {added:8.1f} %"
            )


def added_mass_percent(test: ShearTest) -> float:
    """Return by how much the step wanted adds to the mass of the stem."""
    model = build(test)
    plain = replace(model, integration=replace(model.integration, time_step=None))
    return float(100.0 * (start(model).body.mass.sum() / start(plain).body.mass.sum() - 1.0))


def plan() -> None:
    """Print what `check` estimates of each study with an empty folder, what it then takes, and the ratio."""
    specs = [Path(name) for name in sys.argv[2:]] or [SPEC.parent / "smoke.yaml", SPEC]
    for spec in specs:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out"
            line = [sys.executable, "-m", "stemcal", "check", str(spec), "--out", str(out), "--json"]
            checked = json.loads(subprocess.run(line, check=True, capture_output=True, text=True).stdout)
            foretold = checked["result"]["plan"]["elapsed"]
            run = [sys.executable, "-m", "stemcal", "run", str(spec), "--out", str(out), "--quiet"]
            taken = seconds_of(lambda run=run: subprocess.run(run, check=False, capture_output=True))
        print(f"{spec.name}: {foretold:.0f} s foretold, {taken:.0f} s taken, ratio {foretold / taken:.2f}", flush=True)


def scaling() -> None:
    """Print cost per element-step and memory per element over the size of the model, each in a process of its own."""
    warm()
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context, max_tasks_per_child=1) as pool:
        for line in pool.map(cost_of_size, ((10, 10, 10), (25, 20, 20), (50, 50, 40), (100, 100, 100))):
            print(line, flush=True)


def cost_of_size(counts: tuple[int, int, int]) -> str:
    """Return a line on the cost of a block of so many elements."""
    march_on(start(moving_block((2, 2, 2))), 1)  # load the kernels before memory is counted
    before = resident_bytes()
    state = start(moving_block(counts))
    elements = len(state.topology.hexes)
    steps = max(20, 2_000_000 // elements)
    march_on(state, 1)
    used = resident_bytes() - before
    nanoseconds = 1e9 * median_seconds(lambda: march_on(state, steps), 5) / (elements * steps)
    return f"{elements:9,d} elements: {nanoseconds:6.1f} ns per element-step, {used / elements:6.0f} bytes per element"


def march_on(state: State, steps: int) -> None:
    """Integrate so many steps more, give or take one."""
    _Marching(state, 1)(in_steps(state, steps), state)


def in_steps(state: State, steps: int) -> float:
    """Return the time that so many steps from now will reach."""
    return state.clock.time[0] + (steps - 0.5) * state.settings.penalty_step * state.settings.safety


def resident_bytes() -> int:
    """Return the memory this process holds now (Linux)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def threads() -> None:
    """Print how much faster two threads are than one on a large model, and what two processes of one thread reach."""
    alone, shared = start(moving_block((100, 50, 40))), start(moving_block((100, 50, 40)))
    ratios = []
    with _Marching(shared, 2) as two_threads:
        for _ in range(7):
            one = seconds_of(lambda: march_on(alone, 60))
            two = seconds_of(lambda: two_threads(in_steps(shared, 60), shared))
            ratios.append(one / two)
    elements = len(alone.topology.hexes)
    print(f"{elements:,d} elements: two threads are {np.median(ratios[1:]):.2f} times as fast as one", flush=True)
    print(f"two processes of one thread each do {2 * at_once(1) / at_once(2):.2f} times the work of one")


def seconds_of(work: Callable[[], object]) -> float:
    """Return how long something takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def at_once(count: int) -> float:
    """Return the seconds of 60 steps on 200,000 elements when so many processes do them at the same time."""
    context = multiprocessing.get_context("spawn")
    together = context.Barrier(count)
    with ProcessPoolExecutor(count, mp_context=context, initializer=meet_at, initargs=(together,)) as pool:
        return float(np.median([seconds for run in pool.map(timed_steps, range(count)) for seconds in run]))


def meet_at(together: Barrier) -> None:
    """Keep the barrier at which the processes of `at_once` wait for each other."""
    timed_steps.together = together  # type: ignore[attr-defined]


def timed_steps(_: int) -> list[float]:
    """Return the seconds of 60 steps, five times, each begun together with the other processes."""
    state, seconds = start(moving_block((100, 50, 40))), []
    march_on(state, 1)
    for _ in range(5):
        timed_steps.together.wait()  # type: ignore[attr-defined]
        seconds.append(seconds_of(lambda: march_on(state, 60)))
    return seconds


def study() -> None:
    """Print the time of the shipped study, its kernels compiled or not, and of its designs with 4 mesh positions.

    With replicates only the designs are timed: the mean does not reach the measured force within the paper's
    ranges, and `invert` says so.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        cold = study_seconds(SPEC, place / "cold", place / "cache", ["run"])
        warmed = study_seconds(SPEC, place / "warm", place / "cache", ["run"])
        print(f"study: {cold:.0f} s with kernels to be compiled, {warmed:.0f} s with kernels compiled", flush=True)
        one = study_seconds(SPEC, place / "one", place / "cache", ["screen", "rsm"])
        four = study_seconds(with_replicates(place), place / "four", place / "cache", ["screen", "rsm"])
        print(f"its 26 design runs: {one:.0f} s, with 4 mesh positions {four:.0f} s, {four / one:.1f} times")


def with_replicates(place: Path) -> Path:
    """Write the shipped study with 4 mesh positions, which need the half model, to a folder; return the spec."""
    half = SPEC.read_text(encoding="utf-8")
    spec = place / "phases.yaml"
    spec.write_text(re.sub("(?m)^solver:$", "solver:\n  replicates: 4", half), encoding="utf-8")
    shutil.copytree(SPEC.parent / "data", place / "data")
    return spec


def study_seconds(spec: Path, out: Path, cache: Path, commands: list[str]) -> float:
    """Return how long some commands on a study take, each in a process of its own."""
    environment = {**os.environ, "STEMCAL_CACHE_DIR": str(cache)}

    def work() -> None:
        for command in commands:
            line = [sys.executable, "-m", "stemcal", command, str(spec), "--out", str(out)]
            subprocess.run(line, env=environment, check=True, capture_output=True)

    return seconds_of(work)


TOPICS = {
    "kernel": kernel, "solver": solver, "scaling": scaling, "threads": threads, "steps": steps, "plan": plan,
    "study": study,
}  # fmt: skip

if __name__ == "__main__":
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    for name in [name for name in sys.argv[1:] if name in TOPICS] or TOPICS:
        TOPICS[name]()
