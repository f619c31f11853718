"""What a stage has found, beside its tables on the terminal: verdicts, travel and work, what the forces leave open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from stemcal.naming import CUTTING, Naming
from stemcal.report.numbers import fixed, interval, short, significant
from stemcal.report.tables.sheet import Sheet, place_cell, place_head
from stemcal.report.tables.tested import further_tested_sheets
from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.result import StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.stages.validate import ValidateResult

if TYPE_CHECKING:
    from rich.console import RenderableType

Row = tuple[str, float, float, float, float | None]
"""Response, diameter, measured, predicted or simulated, error."""


def response_sheets(stage: StageResult) -> list[Sheet]:
    """Return travel and work, or a study's own further responses, of a joint fit or of a validation."""
    rows: list[Row] = []
    foot: list[str] = []
    if isinstance(stage, InvertResult) and stage.joint is not None:
        rows = [(r.response, r.condition, r.measured, r.predicted, r.error_percent) for r in stage.joint.further]
    if isinstance(stage, ValidateResult):
        rows = [
            (r.response, row.compared.condition, r.measured, r.simulated, r.error_percent)
            for row in stage.rows
            for r in row.further
        ]
        foot = [
            f"With the mesh at another place the {r.response}{stage.naming.at(row.compared.condition)} lies within "
            f"{interval(r.mesh_interval)} {r.unit} (95 %)."
            for row in stage.rows
            for r in row.further
            if r.mesh_interval is not None
        ]
    told = "Predicted" if isinstance(stage, InvertResult) else "Simulated"
    tests = further_tested_sheets(stage) if isinstance(stage, ValidateResult) else []
    return [responses_sheet(rows, told, stage.naming, foot), *tests] if rows else []


def responses_sheet(rows: Sequence[Row], told: str, naming: Naming = CUTTING, foot: Sequence[str] = ()) -> Sheet:
    """Return the further responses at each diameter: measured beside the surface's, or beside the simulated."""
    cells = []
    for name, condition, measured, found, error in rows:
        response = naming.named(name)
        values = f"{short(measured)}{response.beside}", f"{significant(found)}{response.beside}"
        cells.append((response.noun, *place_cell(naming, condition), *values, fixed(error)))
    columns = ("Response", *place_head(naming), "Measured", told, "Error, %")
    of_stems = () if naming.others else ("Travel and work of the blade from first touch to the maximum force.",)
    return Sheet(f"Beside the {naming.response.noun}", columns, tuple(cells), foot=(*of_stems, *foot))


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
