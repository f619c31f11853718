"""Studies that no machine can hold and simulations that never end: told before they begin, and always to be stopped."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest import mock

from fakes import ENVIRONMENT
from of_processes import heeding, posix
from of_specs import SPECS
from tally import Fault, each
from typer.testing import CliRunner

from stemcal.cli.app import app

SMOKE = SPECS["smoke.yaml"].decode()
SLOWLY = "time_step: 1e-15 s\n  time_step_safety: 0.001\n  mass_scaling: 1"
MONSTERS = {
    "elements of 0.03 mm": ("element_size: d/10", "element_size: 0.03 mm"),
    "elements of 0.0001 mm": ("element_size: d/10", "element_size: 0.0001 mm"),
    "elements of 1e-300 mm": ("element_size: d/10", "element_size: 1e-300 mm"),
    "elements of d/900": ("element_size: d/10", "element_size: d/900"),
    "a specimen of 1000 km": ("length: 30 mm", "length: 1000000 m"),
    "a specimen of 1e20 m": ("length: 30 mm", "length: 1e20 m"),
    "steps of 1e-12 s": ("element_size: d/10\n  mass_scaling: 3e4", f"element_size: d/40\n  {SLOWLY}"),
    "a test of a year": ("duration: 0.8 s", "duration: 3e7 s"),
}
COMMANDS = ("check", "run", "screen", "rsm", "validate", "simulate", "export deck")


def too_much(folder: Path, number: int, _rng: random.Random) -> None:
    """On a machine of 2 GB: `check` warns, what computes refuses, and all of them at once."""
    command = COMMANDS[number % len(COMMANDS)]
    old, new = list(MONSTERS.values())[(number + number // len(COMMANDS)) % len(MONSTERS)]
    folder.mkdir(parents=True, exist_ok=True)
    assert old in SMOKE
    (folder / "monster.yaml").write_text(SMOKE.replace(old, new, 1), encoding="utf-8")
    deck = [str(folder / "monster.k"), "--for", "lsdyna"]
    more = {"check": [], "simulate": [], "export deck": deck}.get(command)
    options = ["--out", str(folder / "out")] if more is None else more
    began = time.monotonic()
    with mock.patch("stemcal.executors.machine.machine_memory", lambda: 2.0e9):
        result = CliRunner().invoke(app, [*command.split(), str(folder / "monster.yaml"), *options])
    said = " ".join(result.stderr.split())
    assert time.monotonic() - began < 30.0, f"{time.monotonic() - began:.0f} s"
    assert "internal error" not in said, said
    if "are too small" in said:  # refused with the spec
        assert result.exit_code == 2 and "solver.element_size" in said, said
        return
    if command == "export deck":
        assert result.exit_code == 0 or "at most 2e+06 are written" in said, said
        return
    assert "A run needs about" in said or "than 48 h" in said, said
    assert result.exit_code == (0 if command == "check" else 2), said
    assert not list(folder.glob("out/runs/*.json"))


def endless(folder: Path, number: int, rng: random.Random) -> None:
    """A simulation without end is ended by Ctrl-C and by SIGTERM, in seconds."""
    posix()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "endless.yaml").write_text(SMOKE.replace("mass_scaling: 3e4", SLOWLY, 1), encoding="utf-8")
    command = [sys.executable, "-m", "stemcal", "simulate", str(folder / "endless.yaml")]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    child = subprocess.Popen(command, text=True, env=ENVIRONMENT, preexec_fn=heeding, **pipes)
    number_of = (signal.SIGINT, signal.SIGTERM)[number % 2]
    time.sleep(rng.uniform(4.0, 12.0))
    assert child.poll() is None, child.communicate()
    child.send_signal(number_of)
    began = time.monotonic()
    _, said = child.communicate(timeout=60.0)
    assert child.returncode == 128 + number_of and "Traceback" not in said, said
    assert time.monotonic() - began < 10.0, f"{time.monotonic() - began:.0f} s"


FAULTS = (
    Fault(
        "studies that no machine can hold",
        "elements of 0.03 to 1e-300 mm, specimens of 1000 km, steps of 1e-12 s, a test of a year, on a machine of 2 GB",
        "check warns, what computes refuses; at once, nothing internal",
        each(too_much),
        8,
        64,
    ),
    Fault(
        "a simulation without end",
        "steps of picoseconds, then Ctrl-C or SIGTERM at a random moment",
        "exit 130 or 143 within seconds",
        each(endless),
        1,
        12,
    ),
)
