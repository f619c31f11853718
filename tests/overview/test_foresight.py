"""What a study would take is told before it begins, whatever it would take."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from fakes import ENVIRONMENT
from typer.testing import CliRunner

from stemcal.cli.app import app
from stemcal.overview.foresight import Demand, excess

CONFIGS = Path(__file__).parents[2] / "configs"
SMOKE = (CONFIGS / "smoke.yaml").read_text(encoding="utf-8")
MONSTERS = {
    "0.03 mm": ("element_size: d/10", "element_size: 0.03 mm"),
    "0.0001 mm": ("element_size: d/10", "element_size: 0.0001 mm"),
    "1e-300 mm": ("element_size: d/10", "element_size: 1e-300 mm"),
    "1000 km": ("length: 30 mm", "length: 1000000 m"),
    "1e-12 s": (
        "element_size: d/10\n  mass_scaling: 3e4",
        "element_size: d/40\n  time_step: 1e-12 s\n  time_step_safety: 0.001\n  mass_scaling: 1",
    ),
    "a year": ("targets:", "loading: {duration: 3e7 s}\ntargets:"),
}


def monster(folder: Path, name: str) -> Path:
    """Write the smoke spec with one line that asks for too much."""
    old, new = MONSTERS[name]
    assert old in SMOKE
    path = folder / "monster.yaml"
    path.write_text(SMOKE.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.fixture
def small_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine of 2 GB, wherever the test runs."""
    monkeypatch.setattr("stemcal.executors.machine.machine_memory", lambda: 2.0e9)


@pytest.mark.usefixtures("small_machine")
@pytest.mark.parametrize("name", MONSTERS)
def test_check_and_plan_warn_and_the_rest_refuses(tmp_path: Path, name: str) -> None:
    spec = monster(tmp_path, name)
    began = time.monotonic()
    for command in ("check", "plan"):
        result = CliRunner().invoke(app, [command, str(spec)])
        assert result.exit_code == 0, result.stderr
        said = " ".join(result.stderr.split())
        assert "a run needs about" in said or "than 48 h" in said, result.stderr
    for command in ("run", "screen", "rsm", "validate", "simulate"):
        result = CliRunner().invoke(app, [command, str(spec), "--out", str(tmp_path / "out")])
        assert result.exit_code == 2 and "--yes begins it all the same" in result.stderr, result.stderr
    assert time.monotonic() - began < 60.0
    assert not list((tmp_path / "out").glob("runs/*.json"))


def test_what_is_usual_is_not_refused() -> None:
    result = CliRunner().invoke(app, ["plan", str(CONFIGS / "wild-chrysanthemum.yaml"), "--json"])
    plan = json.loads(result.stdout)
    assert excess(Demand(plan["to_run"], plan["seconds"], plan["memory"]), 8, 8e9) == []


def test_fewer_workers_are_the_remedy_where_they_are() -> None:
    said = excess(Demand(20, 60.0, 3.0e9), 8, 8.0e9)
    assert said == [
        "a run needs about 3.0 GB of memory, 8 at a time 24.0 GB; this machine has 8.0 GB: take fewer workers "
        "(--workers 2)"
    ]
    assert excess(Demand(20, 60.0, 3.0e9), 2, 8.0e9) == []
    assert excess(Demand(20, 60.0, 3.0e9), 8, None) == []


@pytest.mark.parametrize("signal_", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
def test_a_simulation_without_end_can_be_stopped(tmp_path: Path, signal_: signal.Signals) -> None:
    text = SMOKE.replace("mass_scaling: 3e4", "time_step: 1e-15 s\n  time_step_safety: 0.001\n  mass_scaling: 1", 1)
    assert text != SMOKE
    spec = tmp_path / "endless.yaml"
    spec.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "stemcal", "simulate", str(spec), "--yes"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
    with pytest.raises(subprocess.TimeoutExpired):
        child.wait(6.0)
    child.send_signal(signal_)
    began = time.monotonic()
    _, said = child.communicate(timeout=60.0)
    assert child.returncode == 128 + signal_ and "Traceback" not in said, said
    assert time.monotonic() - began < 10.0
