"""Kinds of stages: what a spec asks of a stage, and the list of stages.

A stage is a `stages.stage.Stage`, which adds its runs, its result and what shows it. Methods import the parts of a
stage, so that its name, title and position are available without cost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from stemcal.registry import Checked, Registry

if TYPE_CHECKING:
    from stemcal.study.types.field_types import Frozen


class StageKind(Checked):
    """What a study asks of a stage.

    Attributes
    ----------
    name : str
        Name of its command, its files and its section in the spec.
    title : str
        Title of the stage.
    purpose : str
        Purpose of its section in the spec.
    by_section : bool
        Whether a study has it only if its spec has its section.
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    purpose: ClassVar[str] = ""
    by_section: ClassVar[bool] = False

    def section(self) -> type[Frozen] | None:
        """Return the model of its section in the spec."""
        return None

    def rules(self) -> Sequence[Callable[[Any], Iterator[Any]]]:
        """Return the rules of its section: functions of a draft that yield mistakes."""
        section = self.section()
        return () if section is None else section.rules

    def doubts(self, study: Any) -> Iterator[Any]:
        """Yield values that are possible but probably mistakes."""
        section = self.section()
        yield from () if section is None else section.doubts(study)

    def seen(self, study: Any) -> Any:
        """Return the study that the stage simulates."""
        return study

    def fits(self, study: Any) -> tuple[tuple[Any, ...], tuple[str, ...]] | None:
        """Return the targets that it fits together (none if it fits one force) and the fitted responses."""
        return None


STAGES: Registry[Any] = Registry(
    StageKind,
    "stemcal.stages",
    (
        "stemcal.stages.screen:Screening",
        "stemcal.stages.climb:Climbing",
        "stemcal.stages.rsm:ResponseSurface",
        "stemcal.stages.invert:Calibration",
        "stemcal.stages.refine:Refinement",
        "stemcal.stages.validate:Validating",
    ),
)
