"""What a stage has found, beside its tables on the terminal: a verdict per factor, what the forces leave open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from stemcal.stages.invert.result import InvertResult
from stemcal.stages.mesh.result import MeshResult
from stemcal.stages.result import StageResult
from stemcal.stages.screen import ScreenResult
from stemcal.text.calibration import known, unseen_changes
from stemcal.text.names import Names
from stemcal.text.screening import judgement

if TYPE_CHECKING:
    from rich.console import RenderableType


def spoken(stage: StageResult) -> list[RenderableType]:
    """Return what a stage says in sentences: a verdict per factor, or what the forces fix and leave open."""
    if isinstance(stage, ScreenResult):
        names = Names(stage.naming)
        judged = [(effect.symbol, judgement(effect, stage, names)) for effect in stage.ranked()]
        return _lines("Verdicts", [" ".join([symbol, *sentences]) for symbol, sentences in judged if sentences])
    if not isinstance(stage, InvertResult | MeshResult):
        return []
    names = Names(stage.naming)
    each = [(known(part, stage, names), unseen_changes(part, names)) for part in stage.known]
    lines = [line for keeps, changes in each for line in (" ".join(keeps), *changes)]
    return _lines("What the measurements fix", lines)


def _lines(title: str, lines: Sequence[str]) -> list[RenderableType]:
    from rich.padding import Padding
    from rich.text import Text

    if not lines:
        return []
    shown = [Padding(Text(line), (0, 0, 0, 2), expand=False) for line in lines]
    return [Text(title, style="bold"), *shown, Text("")]
