"""What the terminal says beside the tables."""

from __future__ import annotations

from typing import Any

from rich.console import Console

from stemcal.report.appendix import shape_sheets
from stemcal.report.findings import response_sheets
from stemcal.report.tables import stage_tables

JOINT = {
    "response": "travel",
    "unit": "mm",
    "diameter": 8.0,
    "measured": 1.06,
    "predicted": 1.0613,
    "error_percent": -0.12,
}


def printed(stage: dict[str, Any]) -> str:
    console = Console(width=80, record=True, file=None, quiet=False, force_terminal=False)
    with console.capture() as capture:
        console.print(*stage_tables(stage), sep="\n")
    return capture.get()


def test_a_verdict_per_factor_the_strongest_first(stages: dict[str, Any]) -> None:
    text = printed(stages["screen"]).split("Verdicts")[1]
    assert (
        text.index("X4 yield_stress matters")
        < text.index("X9 failure_strain matters")
        < text.index("X7 strain_rate_c may matter")
    )
    assert text.count("from low to high") == 9


def test_shape_and_ridge_of_the_surface(stages: dict[str, Any]) -> None:
    assert [sheet.title for sheet in shape_sheets(stages["rsm"])] == [
        "Canonical analysis",
        "Ridge of steepest ascent",
    ]
    assert max(map(len, printed(stages["rsm"]).splitlines())) <= 80


def test_a_plane_has_no_stationary_point(stages: dict[str, Any]) -> None:
    """As where every square and product was left out."""
    nowhere = dict.fromkeys(("coded", "natural", "predicted", "coded_radius"))
    plane = {**stages["rsm"]["canonical"], **nowhere, "inside": False, "kind": "plane"}
    sheet = shape_sheets({**stages["rsm"], "canonical": plane})[0]
    assert sheet.foot[0].startswith("No single stationary point")


def test_what_the_force_leaves_open(stages: dict[str, Any]) -> None:
    """The two directions of the null space of one force, in natural units."""
    text = " ".join(printed(stages["invert"]).split())
    assert "8 mm alone fixes yield_stress to 16.08 to 19.66 MPa (36 % of its range) and leaves failure_strain" in text
    assert "Not seen: yield_stress −0.409 MPa with failure_strain +0.01 changes no measured response" in text


def test_travel_and_work_stand_beside_the_force() -> None:
    (fitted,) = response_sheets({"stage": "invert", "joint": {"further": [JOINT]}})
    assert fitted.rows == (("travel", "8", "1.06 mm", "1.061 mm", "−0.12"),) and fitted.columns[3] == "Predicted"
    simulated = {**{k: v for k, v in JOINT.items() if k not in ("predicted", "diameter")}, "simulated": 1.07}
    (checked,) = response_sheets(
        {"stage": "validate", "rows": [{"diameter": 8.0, "further": [simulated]}, {"diameter": 9.0}]}
    )
    assert checked.rows[0][3] == "1.070 mm" and checked.columns[3] == "Simulated"
    assert response_sheets({"stage": "rsm"}) == []
