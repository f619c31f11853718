"""Kinds of stages: what a spec asks of a stage, and the list of stages.

A stage is a `stages.stage.Stage`, which adds its runs, its result and what shows it. The parts of a stage are in
modules of its package and are found by their names there, so that its name, title and position are available without
cost.
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
    """What a study asks of a stage.

    The class of its section has the stage's name, for example `ScreenOptions`, in the module `options` of its package.

    name         name of its command, its files and its section in the spec
    title        title of the stage
    purpose      purpose of its section in the spec
    by_section   whether a study has it only if its spec has its section
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    purpose: ClassVar[str] = ""
    by_section: ClassVar[bool] = False

    def section(self) -> type[Frozen] | None:
        """Return the model of its section in the spec."""
        return self._part("options", self._class("Options"))  # type: ignore[no-any-return]

    def rules(self) -> Sequence[Callable[[Any], Iterator[Any]]]:
        """Return the rules of its section: functions of a draft that yield mistakes."""
        section = self.section()
        return () if section is None else section.rules

    def doubts(self, study: Any) -> Iterator[Any]:
        """Yield values that are possible but probably mistakes."""
        section = self.section()
        yield from () if section is None else section.doubts(study)

    def completed(self, own: Any, data: Any, folder: Any) -> Any:
        """Return sections with the material of another study, by the function of this name of its `material`."""
        completed = self._part("material", "completed")
        return None if completed is None else completed(own, data, folder)

    def seen(self, study: Any) -> Any:
        """Return the study that the stage simulates, by the function `seen` of its `options` if there is one."""
        seen = self._part("options", "seen")
        return study if seen is None else seen(study)

    def fits(self, study: Any) -> tuple[tuple[Any, ...], tuple[str, ...]] | None:
        """Return the targets that it fits together (none if it fits one force) and the fitted responses."""
        return None

    def options(self, study: Any) -> Any:
        """Return its section in the spec of a study."""
        return study.of(self.section())

    def _class(self, part: str) -> str:
        """Return the name of the class of a part, for example `ScreenOptions`."""
        return "".join(word.capitalize() for word in self.name.replace("-", "_").split("_")) + part

    def _part(self, module: str, name: str) -> Any:
        """Return the object with this name in a module of the stage's package, or in its only module, or None."""
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
