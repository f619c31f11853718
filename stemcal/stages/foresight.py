"""What a design can tell before it is run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from stemcal.errors import UsageError
from stemcal.stages.layout import Design

if TYPE_CHECKING:
    from stemcal.doe.power import DesignQuality


def foretell(design: Design) -> list[str]:
    """Say what the design can find and what its main effects hide."""
    from stemcal.doe.aliases import describe_aliases

    try:
        said = [f"{design.stage}, {design.kind}: {_judge(design).describe()}"]
    except UsageError as error:
        return [f"{design.stage}, {design.kind}: {error}"]
    if design.stage == "screen":
        said.append(describe_aliases(design.coded, design.names))
    return said


def quality(design: Design) -> dict[str, Any] | None:
    """Return power, leverage and efficiency as plain numbers; None if the design cannot carry its model."""
    try:
        return _judge(design).as_dict()
    except UsageError:
        return None


def _judge(design: Design) -> DesignQuality:
    from stemcal.doe.power import judge_design

    return judge_design(design.coded, design.names, quadratic=design.stage == "rsm")
