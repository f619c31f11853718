"""`stemcal simulate`, with a shear test whose result is known in place of the long computation."""

import csv
import json
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from commanding import REPLAY, SMOKE, command
from rich.console import Console

from stemcal.cutting.checks import inertia_in_force
from stemcal.cutting.result import CuttingResult, ForceHistory
from stemcal.laboratory.perform import LaboratoryResult
from stemcal.report.terminal import simulation_table
from stemcal.study.reading import load_study

THREE = SMOKE.with_name("three-tests.yaml")


def known_result() -> CuttingResult:
    """Force rises as a parabola to 120 N at 0.6 mm and falls."""
    time = np.linspace(0.0, 0.5, 101)
    travel = time * 5.0 / 3.0
    force = 120.0 * (1.0 - ((travel - 0.6) / 0.6) ** 2)
    zeros = np.zeros_like(time)
    names = (
        *("kinetic", "internal", "hourglass", "eroded", "contact", "contact_edge", "contact_flanks"),
        *("contact_supports", "contact_friction", "supports", "external", "balance", "deleted", "parted", "along_edge"),
    )
    history = ForceHistory(time=time, travel=travel, force=force, force_filtered=force, **dict.fromkeys(names, zeros))
    return CuttingResult(
        peak_force=120.0, peak_force_raw=121.5, peak_time=0.36, peak_travel=0.6, elements=918,
        deleted_elements=14, steps=21000, wall_seconds=4.2, element_steps_per_second=9.5e6,
        energy_drift_percent=0.4, kinetic_ratio_percent=0.02, hourglass_ratio_percent=3.0,
        contact_energy_percent=1.5, inertia_percent=0.1,
        stroke_was_enough=True, warnings=(inertia_in_force(6.25, 0.5),), history=history, break_travel=0.8214,
    )  # fmt: skip


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """Put the known result in place of the solver; returns what it is called with."""
    from stemcal.solvers import embedded

    made: list[tuple[Any, ...]] = []

    def simulate(_study: Any, levels: Any, diameter: Any, **_: Any) -> CuttingResult:
        made.append((dict(levels), diameter))
        return known_result()

    monkeypatch.setattr(embedded, "simulate_levels", simulate)
    return made


def test_table_and_warnings(calls: list[Any]) -> None:
    result = command("simulate", SMOKE)
    assert result.exit_code == 0
    assert "120.0 N" in result.stdout
    (fracture,) = [line for line in result.stdout.splitlines() if "0.821 mm" in line]  # the stem is not cut through
    assert fracture.startswith("First fracture at") and "broke" not in result.stdout
    assert "warning: Inertia contributes 6.2 % of the peak force" in result.stderr
    assert max(map(len, result.stdout.splitlines())) <= 80


def test_levels_and_diameter_arrive(calls: list[Any]) -> None:
    command("simulate", SMOKE, "--set", "yield_stress=18", "--set", "failure_strain = 0.02",
            "--diameter", 7)  # fmt: skip
    ((levels, diameter),) = calls
    assert levels == {"elastic_modulus": 1000.0, "yield_stress": 18.0, "strain_rate_c": 90.0, "failure_strain": 0.02}
    assert diameter == 7.0


def test_json(calls: list[Any]) -> None:
    result = command("simulate", SMOKE, "--json")
    found = json.loads(result.stdout)["result"]
    assert found["peak_force"] == 120.0
    # 120 N (1 − (x − 0.6)²/0.36) up to 0.6 mm: 120·0.6·2/3 mJ
    assert found["responses"] == {"force": 120.0, "travel": 0.6, "work": pytest.approx(48.0, rel=1e-3)}
    assert {"peak_time", "peak_travel", "elements", "deleted_elements", "steps", "wall_seconds",
            "element_steps_per_second", "energy_drift_percent", "kinetic_ratio_percent"} <= set(found)  # fmt: skip


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("yeild_stress=18", "did you mean yield_stress?"),
        ("mass=3", "use elastic_modulus"),
        ("yield_stress", "FACTOR=VALUE"),
        ("yield_stress=18 mm", "yield_stress"),
        ("yield_stress=1_8", "yield_stress"),
        ("yield_stress=٣", "yield_stress"),
        ("yield_stress=1e400", "yield_stress"),
        *((level, level.partition("=")[0]) for level in ("yield_stress=0", "failure_strain=-0.1", "yield_stress=-5")),
    ],
)
def test_wrong_settings(calls: list[Any], setting: str, words: str) -> None:
    result = command("simulate", SMOKE, "--set", setting)
    assert result.exit_code == 2
    assert words in result.stderr
    assert calls == []


@pytest.mark.parametrize("given", ["0", "inf", "nan", "-3", "1e400", "٣", "8_0", "8 s"])
def test_wrong_diameters(calls: list[Any], given: str) -> None:
    result = command("simulate", SMOKE, "--diameter", given)
    assert result.exit_code == 2
    assert "--diameter" in result.stderr
    assert calls == []


def test_levels_and_diameter_may_have_their_unit(calls: list[Any]) -> None:
    assert command("simulate", SMOKE, "--set", "yield_stress=18000 kPa", "--diameter", "0.9 cm").exit_code == 0
    ((levels, diameter),) = calls
    assert levels["yield_stress"] == pytest.approx(18.0) and diameter == pytest.approx(9.0)


def test_history_and_figures(calls: list[Any], tmp_path: Path) -> None:
    table, picture, png = tmp_path / "history.csv", tmp_path / "force.svg", tmp_path / "force.png"
    assert command("simulate", SMOKE, "--csv", table, "--figure", picture).exit_code == 0
    assert command("simulate", SMOKE, "--figure", png).exit_code == 0
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 101
    assert float(rows[-1]["travel"]) == pytest.approx(0.8333, abs=1e-4)
    assert max(float(row["force"]) for row in rows) == pytest.approx(120.0, rel=1e-3)
    assert ElementTree.parse(picture).getroot().tag.endswith("svg")
    assert png.read_bytes().startswith(b"\x89PNG")


def test_refused_before_the_computation(calls: list[Any], tmp_path: Path) -> None:
    assert "ends in" not in command("simulate", SMOKE, "--figure", tmp_path / "a.svg").stderr
    calls.clear()
    assert "must end in" in command("simulate", SMOKE, "--figure", tmp_path / "a.bmp").stderr
    assert "does not exist" in command("simulate", SMOKE, "--csv", tmp_path / "none" / "a.csv").stderr
    assert "kind: embedded" in command("simulate", REPLAY).stderr
    assert calls == []


@pytest.fixture
def bent(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a known bending test, which ends before its maximum, in place of the solver."""
    from dataclasses import replace

    from stemcal.cutting.checks import maximum_not_passed
    from stemcal.laboratory.perform import LaboratoryResult
    from stemcal.solvers import embedded

    curve = replace(
        known_result(), stroke_was_enough=False, warnings=(maximum_not_passed(0.83), inertia_in_force(6.25, 0.5))
    )
    responses = {"slope": 41.5, "force": 120.0, "travel": 0.6, "work": 60.0}
    monkeypatch.setattr(
        embedded.laboratory_runs,
        "perform_or_fail",
        lambda *_: LaboratoryResult(**{**vars(curve), "responses": responses}),
    )
    monkeypatch.setattr(embedded, "warm", lambda *_: None)


def test_a_test_shows_its_responses_beside_what_was_measured(bent: None) -> None:
    """Of the bending only the slope is measured, at 8 mm: that its maximum was not passed is no matter."""
    shown = command("simulate", THREE, "--test", "bending")
    assert shown.exit_code == 0, shown.stderr
    rows = [line.strip() for line in shown.stdout.splitlines()[:4]]
    assert [" ".join(row.split()) for row in rows] == [
        "Slope 41.50 N/mm, measured 48.7 ± 2.9 N/mm",
        "Maximum force at least 120.0 N",
        "Travel at least 0.6000 mm",
        "Work at least 60.00 mJ",
    ]
    assert "Inertia" in shown.stderr and "Increase loading.stroke" not in shown.stderr
    assert "measured" not in command("simulate", THREE, "--test", "bending", "--diameter", 9).stdout


def test_a_measured_response_that_no_curve_has_is_named() -> None:
    """The slope of the bending is measured; force, travel and work are neither measured nor on this curve."""
    bending, _ = load_study(THREE).tests
    out = StringIO()
    Console(file=out, width=80).print(simulation_table(known_result(), bending, 8.0))
    lines = [line.rstrip() for line in out.getvalue().splitlines()]
    assert lines[0].split(maxsplit=1) == ["Slope", "not on this curve, measured 48.7 ± 2.9 N/mm"]
    assert lines[1].startswith("First fracture at") and lines[2].startswith("Elements")


def test_where_the_maximum_is_measured_it_must_be_passed(bent: None) -> None:
    shown = command("simulate", THREE, "--test", "pull")
    assert "Work at least 60.00 mJ, measured 216 ± 13 mJ" in " ".join(shown.stdout.split())
    assert "Increase the stroke of the test" in shown.stderr


def test_only_a_blade_is_called_one(
    bent: None, calls: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from stemcal.drawing import style

    drawn: list[str] = []
    monkeypatch.setattr(style, "save", lambda figure, _: drawn.append(figure.axes[0].get_xlabel()))
    for test in ("bending", "cutting"):
        command("simulate", THREE, "--test", test, "--figure", tmp_path / "a.svg")
    assert drawn == ["travel, mm", "blade travel, mm"]


def test_a_response_after_the_maximum_is_a_bound_only_of_a_short_stroke() -> None:
    bending, _ = load_study(THREE).tests
    for enough, shown in ((True, "120.0 N"), (False, "at least 120.0 N")):
        curve = {**vars(known_result()), "stroke_was_enough": enough}
        out = StringIO()
        result = LaboratoryResult(**curve, responses={"slope": 41.5, "force": 120.0})
        Console(file=out, width=80).print(simulation_table(result, bending, 8.0))
        slope, force = (line.split(maxsplit=1) for line in out.getvalue().splitlines()[:2])
        assert slope[1].strip() == "41.50 N/mm, measured 48.7 ± 2.9 N/mm"
        assert force[1].split(maxsplit=1)[1].strip() == shown
