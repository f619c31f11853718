"""What the terminal says beside the tables."""

from dataclasses import replace
from typing import Any

from rich.console import Console

from stemcal.report.outcome import tables_of
from stemcal.report.terminal import stage_tables
from stemcal.stages.invert.result import JointFitted, JointRow
from stemcal.stages.validate.result import FurtherRow
from stemcal.storage.rows import Rows


def printed(stage: Any) -> str:
    console = Console(width=80, record=True, file=None, quiet=False, force_terminal=False)
    with console.capture() as capture:
        console.print(*stage_tables(stage), sep="\n")
    return capture.get()


def test_the_last_table_of_the_surface_has_its_shape(stages: dict[str, Any]) -> None:
    assert [table.title for table in tables_of(stages["rsm"])][3:] == ["Canonical analysis"]
    assert max(map(len, printed(stages["rsm"]).splitlines())) <= 80


def test_a_plane_has_no_stationary_point(stages: dict[str, Any], edited: Any) -> None:
    """As where every square and product was left out."""
    nowhere = dict.fromkeys(("coded", "natural", "predicted", "coded_radius"))
    plane = edited(stages["rsm"], lambda content: content["canonical"].update(nowhere, inside=False, kind="plane"))
    table = tables_of(plane)[3]
    assert table.foot[0].startswith("The response surface has no unique stationary point")


def test_what_the_force_leaves_open(stages: dict[str, Any]) -> None:
    """The two directions of the null space of one force, in natural units."""
    text = " ".join(printed(stages["invert"]).split())
    assert "constrains yield_stress to between ≤ 15.35 and ≥ 19.96 MPa (46 % of the factor range)" in text
    assert "hardly changes if yield_stress decreases by 0.483 MPa and failure_strain increases by 0.01." in text


def test_travel_and_work_stand_beside_the_force(stages: dict[str, Any]) -> None:
    row = JointRow(8.0, "travel", "mm", 1.06, None, None, 1.0613, -0.12, None)
    joint = JointFitted(Rows(), Rows([row]), "measured", None, 0, None, 0.0, None)
    fitted = tables_of(replace(stages["invert"], joint=joint))[-1]
    assert fitted.cells == (("travel", "8", "1.06", "1.061", "mm", "0.12 too high"),) and fitted.heads[3] == "Surface"
    further = Rows([FurtherRow("travel", "mm", 1.06, None, 1.07, -0.9)])
    rows = stages["validate"].rows
    beside = Rows([rows[0], replace(rows[1], further=further), *rows[2:]])
    checked = tables_of(replace(stages["validate"], rows=beside))[1]
    assert checked.cells[0][1:5] == ("8", "1.06", "1.070", "mm") and checked.heads[3] == "Simulated"
