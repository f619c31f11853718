"""Simulations that fail: their state is no longer physical, their program hangs, their result is not there."""

from __future__ import annotations

import json
import math
import random
import time
from pathlib import Path
from typing import Any

import numpy as np
import test_command
from fakes import FakeSolver, lines, make_study
from tally import Fault, Missing, each

from stemcal import workflow
from stemcal.errors import RunsFailed, SimulationFailed
from stemcal.executors.inline import InlineExecutor
from stemcal.fem.material import Material
from stemcal.fem.mesh import brick
from stemcal.fem.model import Integration, Model
from stemcal.fem.stepper import simulate
from stemcal.folder.study_folder import StudyFolder
from stemcal.solvers.options import ResultReader
from stemcal.solvers.programs.readers import read_number

# ---- physics


def unphysical(_folder: Path, number: int, rng: random.Random) -> None:
    """A cube whose loads are no numbers, which is squeezed flat, or whose face passes through the other."""
    kind = ("nan", "flat", "through")[number % 3]
    mesh = brick((1.0, 1.0, 1.0), (2, 2, 2) if kind == "nan" else (1, 1, 1))
    held = np.full(mesh.nodes.shape, kind != "nan")
    velocity, loads = np.zeros_like(mesh.nodes), np.zeros_like(mesh.nodes)
    if kind == "nan":
        loads[rng.randrange(len(loads)), rng.randrange(3)] = rng.choice([math.nan, math.inf, -math.inf, 1e300])
    else:
        speed = rng.uniform(5e2, 2e3) if kind == "flat" else rng.uniform(5e4, 2e5)
        velocity[:, 0] = np.where(mesh.nodes[:, 0] > 0.5, -speed, 0.0)
    model = Model(
        mesh,
        Material(1e-9, 100.0, 0.3),
        # type: ignore[arg-type]
        loads=loads,
        held=held,
        velocity=velocity,
        integration=Integration(outputs=2),
    )
    try:
        simulate(model, 4e-3)
    except SimulationFailed as failure:
        allowed = {"nan": {"nan"}, "flat": {"time_step", "inverted"}, "through": {"inverted"}}[kind]
        assert failure.reason in allowed, f"{kind}: {failure.reason}"
        assert "t = " in str(failure), str(failure)
        assert kind == "nan" or "element 0" in str(failure) or failure.reason == "time_step", str(failure)
    else:
        raise AssertionError(f"{kind}: no failure")


TROUBLES = ("nan", "failed", "simulation", "raise")


def failed_in_a_design(folder: Path, _number: int, rng: random.Random) -> None:
    """Some of the twelve runs of a screening fail: refitted with the degrees of freedom left, or refused."""
    rows = rng.sample(range(12), rng.randint(1, 5))
    trouble = {row: rng.choice(TROUBLES) for row in rows}
    study = make_study(folder)
    found = StudyFolder(folder / "out")
    try:
        stage = workflow.screen(study, found, InlineExecutor(), solver=FakeSolver(trouble=trouble)).to_json()
    except RunsFailed as refused:
        assert len(rows) >= 2 and f"{len(rows)} of 12 runs failed" in str(refused), str(refused)
        assert not found.has_stage("screen")
        return
    runs = stage["design"]["runs"]
    assert [run["response"] for run in runs if run["run"] - 1 in rows] == [None] * len(rows), "a failed run has a force"
    assert stage["residual"]["df"] == 12 - len(rows) - 10, f"{stage['residual']['df']} df after {len(rows)} failures"
    assert any(f"{len(rows)} of 12 runs failed" in note for note in stage["notes"]), stage["notes"]
    good = [run for run in runs if run["response"] is not None]
    coded = np.array([[1.0, *(run["coded"][name] for name in study.names)] for run in good])
    solution = np.linalg.lstsq(coded, np.array([run["response"] for run in good]), rcond=None)[0]
    effects = [effect["effect"] for effect in stage["effects"]]
    assert np.allclose(effects, 2.0 * solution[1:], rtol=1e-9, atol=1e-9), "effects are not those of the runs left"
    text = (found.path / "screen.json").read_text(encoding="utf-8")
    assert "NaN" not in text and "Infinity" not in text


# ---- programs


def hung_program(folder: Path, _number: int, rng: random.Random) -> None:
    """It ignores SIGTERM, and so do its child, a shell, and its grandchild."""
    if not Path("/proc/self/stat").exists():
        raise Missing("looks for processes in /proc")
    limit, pids = rng.uniform(0.5, 1.5), folder / "pids"
    begun = time.monotonic()
    answer = test_command.solved(folder, test_command.STUBBORN.format(pids=pids), limit=f"{limit:.3f} s")
    took = time.monotonic() - begun
    assert answer.reason == "timeout", answer.reason
    assert limit <= took < limit + 5.0, f"gone after {took:.1f} s, limit {limit:.1f} s"
    left = [pid for pid in test_command.pids_of(pids) if test_command.alive(pid)]
    assert not left, f"still there: {left}"


RESULTS: dict[str, tuple[Any, bytes]] = {
    "json": (
        ResultReader(file="out", path="F", along="x", reduction="max"),
        json.dumps({"F": [0.5 * i for i in range(40)], "x": list(range(40))}).encode(),
    ),
    "csv": (
        ResultReader(file="out", column="F", along="t", reduction="max"),
        b"t,F\n" + b"".join(b"%d,%d.25\n" % (i, 2 * i) for i in range(40)),
    ),
    "regex": (
        ResultReader(file="out", pattern=r"^force\s+(\S+)\s*;$"),
        b"".join(b"step %d\nforce  %d.5D+00 ;\n" % (i, i) for i in range(40)),
    ),
}
WORDS = (b"nan", b"-inf", b"1e999", b"********", b"\0", b"\xff\xfe", b"9" * 400, b'"', b"{", b",,,,", b"\r", b"null")


def broken_result(folder: Path, number: int, rng: random.Random) -> None:
    """Missing, empty, cut short, not a number, binary, huge: each has its word; nothing else comes out."""
    kind = sorted(RESULTS)[number % 3]
    result, content = RESULTS[kind]
    path, how = folder / "out", rng.randrange(7)
    if how == 6:
        with path.open("wb") as file:
            file.truncate(10**12)  # sparse
    elif how:
        path.write_bytes(_spoiled(content, how, rng))
    try:
        force = read_number(result, folder)
    except SimulationFailed as failure:
        assert failure.reason in {"no_result", "bad_result", "nan"} and len(str(failure)) < 500, str(failure)
        assert how != 0 or failure.reason == "no_result"
        assert how != 6 or "larger than" in str(failure)
    else:
        assert math.isfinite(force), f"{kind}: {force}"
        assert how in (1, 2, 3), f"{kind}: a number from what is none"
        assert not (kind == "json" and how == 1), "half a JSON file gave a number"


def _spoiled(content: bytes, how: int, rng: random.Random) -> bytes:
    at = rng.randrange(len(content))
    match how:
        case 1:
            return content[:at]
        case 2:
            word = rng.choice(WORDS)
            return content[:at] + word + content[at + len(word) :]
        case 3:
            changed = bytearray(content)
            changed[at] = rng.randrange(256)
            return bytes(changed)
        case 4:
            return rng.randbytes(2000)
    return b" \n" * rng.randrange(100)


def instant_limit(folder: Path, _number: int, rng: random.Random) -> None:
    """A run that hangs in a study: it alone is failed, as `timeout`; its clock starts when it starts."""
    from stemcal.executors.local import LocalExecutor

    row, witness = rng.randrange(12), folder / "witness"
    study = make_study(folder, "solver: {kind: embedded, time_limit: 1 s}\n")
    solver = FakeSolver(witness, seconds=0.15, trouble={row: "hang"})
    with LocalExecutor(1, time_limit=1.0) as executor:
        stage = workflow.screen(study, StudyFolder(folder / "out"), executor, solver=solver).to_json()
    found = {run["run"] - 1: (run["status"], run["reason"]) for run in stage["design"]["runs"]}
    assert found.pop(row) == ("failed", "timeout"), "the hung run"
    assert set(found.values()) == {("ok", "")}, "a run that waited 1.5 s for its turn lost its time to the queue"
    assert lines(witness).count(f"screen {row}") == 1


FAULTS = (
    Fault(
        "physics goes wrong",
        "NaN, infinite or huge loads, an element squeezed flat or turned inside out",
        "stopped, with reason, time and element",
        each(unphysical),
        6,
        300,
    ),
    Fault(
        "runs of a design fail",
        "1 to 5 of the 12 runs of a screening, in four ways",
        "refitted from the runs left, with their degrees of freedom, or refused; never a number",
        each(failed_in_a_design),
        10,
        300,
    ),
    Fault(
        "a run hangs",
        "one of twelve, the others queue behind it for longer than the limit",
        "it alone is failed: the clock of a run starts with the run",
        each(instant_limit),
        1,
        6,
    ),
    Fault(
        "an external program hangs",
        "it, a shell below it and a grandchild ignore SIGTERM",
        "all gone within the limit and 5 s",
        each(hung_program),
        1,
        12,
    ),
    Fault(
        "results missing, partial, NaN, huge, binary",
        "JSON, CSV and text, seven ways",
        "each named; a number only if the file still holds one",
        each(broken_result),
        200,
        10_000,
    ),
)
