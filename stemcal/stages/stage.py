"""The base class of stages, through which commands, plan, status and report use them; the stages of a study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from stemcal.errors import UsageError
from stemcal.formats import series
from stemcal.registry import Checked, Registry
from stemcal.study.types import stage_kind
from stemcal.study.types.stage_kind import StageKind

if TYPE_CHECKING:
    from stemcal.drawing.showing import Showing
    from stemcal.notes import Note
    from stemcal.runs.study_folder import StudyFolder
    from stemcal.solvers.protocol import Solver
    from stemcal.stages.design import AdaptiveRuns, StageRuns
    from stemcal.stages.result import StageResult
    from stemcal.study.model.study import Study

R = TypeVar("R", bound="StageResult")


class Stage(StageKind, Checked, Generic[R]):
    """One stage of a study.

    Its parts are in the modules of its package and are found there by their names. A stage named ``screen`` has

    =============  =========================================
    options        `ScreenOptions`
    result         `ScreenResult`
    analysis       `screen`, and `foresee` or `later`
    showing        `ScreenShowing`
    verdict_rules  `RULES`
    =============  =========================================

    A stage that is a single module has them in that module. A stage whose parts have other names overrides the methods.
    """

    help: ClassVar[str] = ""  # description of its command
    attribute: ClassVar[str] = ""  # attribute of `StudyResults` with its result; by default its name
    reads: ClassVar[tuple[str, ...]] = ()  # sections of the spec on which its result depends
    simulates: ClassVar[bool] = True  # whether it has its own runs
    pictured: ClassVar[bool] = False  # whether its runs store the data for pictures
    of_surface: ClassVar[bool] = False  # whether only studies with a response surface have this stage
    one_by_one: ClassVar[bool] = False  # whether each run depends on the last; a failed run may then be replaced

    def needs(self, study: Study) -> str | None:
        """Return the name of the stage whose file this stage reads, or None."""
        return None

    def asked_for(self, study: Study) -> bool:
        """Check that this stage is part of the whole study, as `stemcal run` computes it."""
        if study.goal is not None and "targets" in self.reads:
            return False
        section = self.section() if self.by_section else None
        return (section is None or study.section(section) is not None) and (has_surface(study) or not self.of_surface)

    def inputs(self, study: Study) -> Mapping[str, object]:
        """Return further inputs of the stage file, in addition to factors, sections, solver and the previous file."""
        return {}

    def calibrates(self, study: Study) -> bool:
        """Check that this stage calibrates the parameters; the study uses the parameters of the last such stage."""
        return False

    def makes_surface(self, study: Study) -> bool:
        """Check that this stage fits the response surface of the study."""
        return False

    def tolerance_percent(self, study: Study) -> float | None:
        """Return the percentage within which measured and simulated values count as equal, if this stage sets it."""
        return None

    def result(self) -> type[R]:
        """Return the class of the stage's result."""
        return self._needed("result", self._class("Result"))  # type: ignore[no-any-return]

    def making(self) -> Callable[..., R]:
        """Return the function that computes the result (decorated with `stages.work.a_stage`)."""
        return self._needed("analysis", self.name.replace("-", "_"))  # type: ignore[no-any-return]

    def foresee(self, study: Study, solver: Solver, folder: StudyFolder | None) -> StageRuns | None:
        """Return the runs that the stage needs, as far as they are known; None if each run depends on the last one."""
        foresee = self._part("analysis", "foresee") if self.asked_for(study) else None
        return None if foresee is None else foresee(study, solver, folder)

    def later(self, study: Study) -> AdaptiveRuns | None:
        """Return the usual rounds of runs of a stage that chooses its runs one by one; None for other stages."""
        later = self._part("analysis", "later")
        return None if later is None else later(study)

    def reasons(self) -> Sequence[Callable[[Any], Iterator[Note]]]:
        """Return the rules of the verdict: functions of `verdict.verdict_rules.Evidence` that yield reasons."""
        return self._part("verdict_rules", "RULES") or ()

    def showing(self) -> Showing[Any]:
        """Return the object that creates the stage's sentences, tables and figures."""
        return self._needed("showing", self._class("Showing"))()  # type: ignore[no-any-return]

    def _needed(self, module: str, name: str) -> Any:
        if (part := self._part(module, name)) is None:
            raise NotImplementedError(f"The stage {self.name!r} has no {name} in its module {module}.")
        return part


STAGES: Registry[Stage[Any]] = stage_kind.STAGES


def stage_called(name: str) -> Stage[Any]:
    """Return a stage by its name; raise `UsageError` if there is none."""
    if (stage := STAGES.named(name)) is None:
        raise UsageError(STAGES.broken.get(name) or f"The stage {name!r} does not exist.")
    return stage


def stages_of(study: Study) -> tuple[Stage[Any], ...]:
    """Return a study's stages, each after the one that it needs; other packages' stages only with their section."""
    left = [stage for stage in STAGES.built_in if stage.asked_for(study)]
    left += [stage_called(name) for name in study.further]
    ordered: list[Stage[Any]] = []
    while left:
        waiting = {stage.name for stage in left}
        ready = next((stage for stage in left if stage.needs(study) not in waiting), None)
        if ready is None:
            raise UsageError(f"The stages {series(waiting)} depend on each other.")
        ordered.append(ready)
        left.remove(ready)
    return tuple(ordered)


def has_surface(study: Study) -> bool:
    """Check that the study calibrates with a response surface, and not by the refinement alone."""
    return any(stage.makes_surface(study) for stage in STAGES.built_in)


def calibrating(study: Study) -> Stage[Any]:
    """Return the stage whose parameters the study uses: the last one that calibrates its own model."""
    return [stage for stage in STAGES.built_in if stage.calibrates(study)][-1]


def stages_known(study: Study) -> tuple[Stage[Any], ...]:
    """Return the stages of a study, followed by the other built-in stages."""
    return tuple(dict.fromkeys((*stages_of(study), *STAGES.built_in)))
