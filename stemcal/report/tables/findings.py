"""What a stage has found, beside its tables on the terminal: verdicts, travel and work, what the forces leave open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from stemcal.report.numbers import fixed, interval, short, significant
from stemcal.report.tables.sheet import Sheet
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.result import StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.validate import ValidateResult

if TYPE_CHECKING:
    from rich.console import RenderableType

Row = tuple[str, float, float, float, str, float | None]
"""Response, diameter, measured, predicted or simulated, unit, error."""


def response_sheets(stage: StageResult) -> list[Sheet]:
    """Return travel and work of a joint fit, or of a validation."""
    rows: list[Row] = []
    foot: list[str] = []
    if isinstance(stage, InvertResult) and stage.joint is not None:
        rows = [(r.response, r.diameter, r.measured, r.predicted, r.unit, r.error_percent) for r in stage.joint.further]
    if isinstance(stage, ValidateResult):
        rows = [
            (r.response, row.compared.diameter, r.measured, r.simulated, r.unit, r.error_percent)
            for row in stage.rows
            for r in row.further
        ]
        foot = [
            f"With the mesh at another place the {r.response} at {row.compared.diameter:g} mm lies within "
            f"{interval(r.mesh_interval)} {r.unit} (95 %)."
            for row in stage.rows
            for r in row.further
            if r.mesh_interval is not None
        ]
    return (
        [responses_sheet(rows, "Predicted" if isinstance(stage, InvertResult) else "Simulated", foot)] if rows else []
    )


def responses_sheet(rows: Sequence[Row], told: str, foot: Sequence[str] = ()) -> Sheet:
    """Return travel and work at each diameter: measured beside the surface's, or beside the simulated."""
    cells = [
        (response, short(diameter), f"{short(measured)} {unit}", f"{significant(found)} {unit}", fixed(error))
        for response, diameter, measured, found, unit, error in rows
    ]
    columns = ("Response", "Diameter, mm", "Measured", told, "Error, %")
    foot = ("Travel and work of the blade from first touch to the maximum force.", *foot)
    return Sheet("Beside the force", columns, tuple(cells), foot=foot)


def spoken(stage: StageResult) -> list[RenderableType]:
    """Return what a stage says in sentences: a verdict per factor, or what the forces fix and leave open."""
    if isinstance(stage, ScreenResult):
        return _lines("Verdicts", [f"{e.symbol} {e.verdict}" for e in stage.ranked() if e.verdict])
    known = stage.known if isinstance(stage, InvertResult | MeshResult) else []
    lines = [line for part in known for line in (*part.sentences, *part.direction_sentences)]
    return _lines("What the measurements fix", lines)


def _lines(title: str, lines: Sequence[str]) -> list[RenderableType]:
    from rich.padding import Padding
    from rich.text import Text

    if not lines:
        return []
    shown = [Padding(Text(line), (0, 0, 0, 2), expand=False) for line in lines]
    return [Text(title, style="bold"), *shown, Text("")]
