"""What a stage has found, beside its tables on the terminal: verdicts, travel and work, what the forces leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stemcal.report.numbers import fixed, short, significant
from stemcal.report.sheets import Sheet

if TYPE_CHECKING:
    from rich.console import RenderableType

Stage = Mapping[str, Any]


def response_sheets(stage: Stage) -> list[Sheet]:
    """Return travel and work of a joint fit, or of a validation."""
    fitted = (stage.get("joint") or {}).get("further") or []
    rows = stage.get("rows", []) if stage["stage"] == "validate" else []
    simulated = [{**entry, "diameter": row["diameter"]} for row in rows for entry in row.get("further", [])]
    return [responses_sheet(found) for found in (fitted, simulated) if found]


def responses_sheet(rows: Sequence[Mapping[str, Any]]) -> Sheet:
    """Return travel and work at each diameter: measured beside the surface's, or beside the simulated."""
    told = "predicted" if "predicted" in rows[0] else "simulated"
    cells = [
        (
            row["response"],
            short(row["diameter"]),
            f"{short(row['measured'])} {row['unit']}",
            f"{significant(row[told])} {row['unit']}",
            fixed(row["error_percent"]),
        )
        for row in rows
    ]
    columns = ("Response", "Diameter, mm", "Measured", told.capitalize(), "Error, %")
    foot = ("Travel and work of the blade from first touch to the maximum force.",)
    return Sheet("Beside the force", columns, tuple(cells), foot=foot)


def spoken(stage: Stage) -> list[RenderableType]:
    """Return what a stage says in sentences: a verdict per factor, or what the forces fix and leave open."""
    if stage["stage"] == "screen":
        ranked = sorted(stage["effects"], key=lambda effect: -(effect["contribution_percent"] or 0.0))
        return _lines("Verdicts", [f"{e['symbol']} {e['verdict']}" for e in ranked if e.get("verdict")])
    sets = [stage[name] for name in ("certainty", "certainty_alone") if name in stage]
    lines = [line for part in sets for line in (*part["sentences"], *part.get("direction_sentences", []))]
    return _lines("What the measurements fix", lines)


def _lines(title: str, lines: Sequence[str]) -> list[RenderableType]:
    from rich.padding import Padding
    from rich.text import Text

    if not lines:
        return []
    shown = [Padding(Text(line), (0, 0, 0, 2), expand=False) for line in lines]
    return [Text(title, style="bold"), *shown, Text("")]
