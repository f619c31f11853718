"""A stage as commands, plan, status, page and export see it, and the one list of stages.

What a stage is made of is imported in its methods: asking for its name, its title or its place costs nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from stemcal.errors import UsageError
from stemcal.registry import Checked, Registry
from stemcal.words import series

if TYPE_CHECKING:
    from stemcal.folder import StudyFolder
    from stemcal.note import Note
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import Asked, Later
    from stemcal.stages.result import StageResult
    from stemcal.study.model import Study, Target
    from stemcal.study.rules import Draft
    from stemcal.study.types.field_types import Frozen
    from stemcal.study.types.strict_yaml import Finding

R = TypeVar("R", bound="StageResult")


class Stage(Checked, Generic[R]):
    """One stage of a study.

    Attributes
    ----------
    name : str
        Of its command and of its files.
    title, help : str
        For people; what its command does.
    attribute : str
        Of `StudyResults` in Python that holds its result; by default its name.
    purpose : str
        What its section of the spec is for.
    by_section : bool
        Whether a study has it only where its spec has its section.
    reads : tuple of str
        The sections of the spec that it is made from.
    simulates : bool
        Whether it has its own runs.
    pictured : bool
        Whether its runs keep what pictures are made from: those at a solution do.
    one_by_one : bool
        Whether each run follows from the one before, so that the next one corrects a failed one.
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    help: ClassVar[str] = ""
    attribute: ClassVar[str] = ""
    purpose: ClassVar[str] = ""
    by_section: ClassVar[bool] = False
    reads: ClassVar[tuple[str, ...]] = ()
    simulates: ClassVar[bool] = True
    pictured: ClassVar[bool] = False
    one_by_one: ClassVar[bool] = False

    def needs(self, study: Study) -> str | None:
        """Return the name of the stage whose file it reads; None if it reads none."""
        return None

    def asked_for(self, study: Study) -> bool:
        """Whether the whole study has it."""
        section = self.section() if self.by_section else None
        return section is None or study.given(section) is not None

    def seen(self, study: Study) -> Study:
        """Return the study as the stage simulates it."""
        return study

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return what its file depends on besides factors, sections, solver and the file before."""
        return {}

    def section(self) -> type[Frozen] | None:
        """Return the model of the section of the spec with the stage's name."""
        return None

    def rules(self) -> Sequence[Callable[[Draft], Iterator[Finding]]]:
        """Return what must hold for its section, functions of a draft that yield what is wrong: `RULES` beside it."""
        found: Sequence[Callable[[Draft], Iterator[Finding]]] = self._beside_section("RULES", ())
        return found

    def doubts(self, study: Study) -> Iterator[Finding]:
        """Yield what is possible but looks like a slip, as the function `doubts` beside its section does."""
        yield from self._beside_section("doubts", lambda _study: ())(study)

    def _beside_section(self, name: str, default: object) -> Any:
        """Return a name of the module that its section is defined in."""
        section = self.section()
        return default if section is None else getattr(sys.modules[section.__module__], name, default)

    def beforehand(self, study: Study) -> Iterator[Note]:
        """Yield notes of `check` on the stage; none is a mistake."""
        yield from ()

    def calibrates(self, study: Study) -> bool:
        """Whether it sets the parameters in the study's own model; those of the last such stage hold."""
        return False

    def fits(self, study: Study) -> tuple[tuple[Target, ...], tuple[str, ...]] | None:
        """Return the targets that it fits together, none if it fits one force, and which responses of them."""
        return None

    def result(self) -> type[R]:
        """Return the class of its result."""
        raise NotImplementedError

    def making(self) -> Callable[..., R]:
        """Return the function that makes it (`stages.work.a_stage`)."""
        raise NotImplementedError

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> Asked | None:
        """Return the runs that it asks for, as far as they are known now; None where each follows from the last."""
        return None

    def later(self, study: Study) -> Later | None:
        """Return the runs that it usually decides on one by one; None if it does not."""
        return None

    def reasons(self) -> Sequence[Callable[[Any], Iterator[Note]]]:
        """Return what it adds to the verdict: functions of a `verdict.evidence.Evidence` that yield reasons."""
        return ()

    def most_there(self, study: Study) -> int:
        """Return how many runs it makes at most in the other model that it has `seen`."""
        return 0

    def showing(self) -> object:
        """Return its words, tables and figures (`report.showing.Showing`)."""
        raise NotImplementedError


STAGES: Registry[Stage[Any]] = Registry(
    Stage,
    "stemcal.stages",
    (
        "stemcal.stages.screen:Screening",
        "stemcal.stages.climb:Climbing",
        "stemcal.stages.surface:ResponseSurface",
        "stemcal.stages.invert:Calibration",
        "stemcal.stages.refine:Refinement",
        "stemcal.stages.validate:Validating",
    ),
)


def stage_called(name: str) -> Stage[Any]:
    """Return a stage by its name; raise `UsageError` if there is none."""
    if (found := STAGES.named(name)) is None:
        raise UsageError(STAGES.broken.get(name) or f"there is no stage {name!r}")
    return found


def stages_of(study: Study) -> tuple[Stage[Any], ...]:
    """Return the stages of a whole study in the order of the list, each after the one that it needs.

    Another package's stage is one of them where the spec has its section.
    """
    left = [stage for stage in STAGES.built_in if stage.asked_for(study)]
    left += [stage_called(name) for name in study.further]
    ordered: list[Stage[Any]] = []
    while left:
        waiting = {stage.name for stage in left}
        ready = next((stage for stage in left if stage.needs(study) not in waiting), None)
        if ready is None:
            raise UsageError(f"the stages {series(waiting)} need each other")
        ordered.append(ready)
        left.remove(ready)
    return tuple(ordered)


def calibrating(study: Study) -> Stage[Any]:
    """Return the stage whose parameters are those of the study: the last one that sets them in its own model."""
    return [stage for stage in STAGES.built_in if stage.calibrates(study)][-1]


def stages_known(study: Study) -> tuple[Stage[Any], ...]:
    """Return the stages of a study, and then those that it does not have."""
    return tuple(dict.fromkeys((*stages_of(study), *STAGES.built_in)))
