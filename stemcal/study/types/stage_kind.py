"""Kinds of stages: the section of a stage in the spec, and the registry of stages.

The subclass `stages.stage.Stage` adds the runs, the result and its display. The parts of a stage are in modules of its
package, which are imported when a part is needed: the names, titles and order of the stages are available without
these imports.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

from stemcal.registry import Checked, Registry

if TYPE_CHECKING:
    from stemcal.study.types.field_types import Frozen


class StageKind(Checked):
    """A stage as the spec describes it.

    The class of its section has the stage's name, for example `ScreenOptions`, in the module `options` of its package.

    name         name of the command, the files and the section of the stage
    title        title of the stage
    purpose      purpose of its section in the spec
    by_section   whether the stage runs only if the spec has its section
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    purpose: ClassVar[str] = ""
    by_section: ClassVar[bool] = False

    def section(self) -> type[Frozen] | None:
        """Return the class of the stage's section in the spec, None if it has no section."""
        return self._part("options", self._class("Options"))  # type: ignore[no-any-return]

    def rules(self) -> Sequence[Callable[[Any], Iterator[Any]]]:
        """Return the rules of the section: functions of a `Draft` that yield mistakes."""
        section = self.section()
        return () if section is None else section.rules

    def doubts(self, study: Any) -> Iterator[Any]:
        """Yield a finding for each value that is possible but probably a mistake."""
        section = self.section()
        yield from () if section is None else section.doubts(study)

    def completed(self, own: Any, data: Any, folder: Any) -> Any:
        """Return sections completed with the material of another study; None for a stage that does not add any.

        The function `completed` in the module `material` of the stage receives the sections that were read (`own`),
        the tree of the spec (`data`) and the folder of the spec.
        """
        completed = self._part("material", "completed")
        return None if completed is None else completed(own, data, folder)

    def seen(self, study: Any) -> Any:
        """Return the study that the stage simulates: by the function `seen` in its module `options`, if any."""
        seen = self._part("options", "seen")
        return study if seen is None else seen(study)

    def fits(self, study: Any) -> tuple[tuple[Any, ...], tuple[str, ...]] | None:
        """Return the targets (none for a fit to one force) and responses that the stage fits; None without a fit."""
        return None

    def options(self, study: Any) -> Any:
        return study.of(self.section())

    def _class(self, part: str) -> str:
        return "".join(word.capitalize() for word in self.name.replace("-", "_").split("_")) + part

    def _part(self, module: str, name: str) -> Any:
        place = type(self).__module__
        if not hasattr(sys.modules[place], "__path__"):
            return getattr(sys.modules[place], name, None)
        try:
            return getattr(import_module(f"{place}.{module}"), name, None)
        except ModuleNotFoundError as error:
            if error.name != f"{place}.{module}":
                raise
            return None


STAGES: Registry[Any] = Registry(
    StageKind,
    "stemcal.stages",
    (
        "stemcal.stages.screen:Screen",
        "stemcal.stages.climb:Climb",
        "stemcal.stages.rsm:Rsm",
        "stemcal.stages.invert:Invert",
        "stemcal.stages.refine:Refine",
        "stemcal.stages.validate:Validate",
        "stemcal.stages.optimise:Optimise",
    ),
)
