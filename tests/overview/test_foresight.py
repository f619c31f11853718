"""Runs, time and memory of a study are stated before it begins; extreme cases are in tests/faults/test_hostile.py."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from stemcal.cli.app import app
from stemcal.errors import UsageError
from stemcal.overview.foresight import Demand, demand_of, demand_of_one, excess, warnings_before
from stemcal.solvers.protocol import Solver
from stemcal.study.reading import load_study

CONFIGS = Path(__file__).parents[2] / "configs"


def test_what_is_usual_is_not_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # without the runs of a finished study in the current folder
    result = CliRunner().invoke(app, ["check", str(CONFIGS / "wild-chrysanthemum.yaml"), "--json"])
    plan = json.loads(result.stdout)["result"]["plan"]
    assert list(excess(Demand(plan["to_run"], plan["seconds"], plan["memory"]), 8, 8e9)) == []


def test_fewer_workers_are_the_remedy_where_they_are() -> None:
    (said,) = excess(Demand(20, 60.0, 3.0e9), 8, 8.0e9)
    assert (said.kind, said.severity) == ("too_much_memory", "error")
    assert all(number in said.text for number in ("3.0 GB", "24.0 GB", "8.0 GB"))
    assert said.remedy is not None and "--workers 2" in said.remedy.text
    assert list(excess(Demand(20, 60.0, 3.0e9), 2, 8.0e9)) == []
    assert list(excess(Demand(20, 60.0, 3.0e9), 8, None)) == []


def test_too_much_memory_is_refused_where_this_machine_computes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stemcal.overview.foresight.machine_memory", lambda: 1e9)
    with pytest.raises(UsageError, match=r"has only 1.0 GB"):
        warnings_before(Demand(4, 60.0, 2e9), 1)
    assert warnings_before(Demand(4, 60.0, 2e9), 1, here=False) == [] == warnings_before(Demand(4, 60.0, 0.5e9), 1)
    (warning,) = warnings_before(Demand(4, 4 * 49 * 3600.0, 0.5e9), 1)
    assert "196 h" in warning or "8 days" in warning


def test_no_runs_demand_nothing() -> None:
    assert demand_of([], Solver()) == Demand(0, 0.0, 0.0)


def test_a_test_of_another_program_demands_nothing() -> None:
    """Of the embedded solver the largest of some diameters counts."""
    replay, smoke = (load_study(CONFIGS / f"{name}.yaml") for name in ("paper-replay", "smoke"))
    assert demand_of_one(replay, [8.0]) == Demand(0, 0.0, 0.0)
    small, large, both = (demand_of_one(smoke, diameters) for diameters in ([7.0], [9.0], [7.0, 9.0]))
    assert small != large and small.runs == large.runs == 1
    assert both == Demand(1, max(small.seconds, large.seconds), max(small.memory, large.memory))
