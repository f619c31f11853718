"""The results of a study as far as it has come."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stemcal.errors import UsageError
from stemcal.folder.study_folder import StudyFolder
from stemcal.runs.outcome import Outcome
from stemcal.solvers import make_solver
from stemcal.stages.base import Stage, stage_called
from stemcal.stages.fresh import fresh, kind_of, require_fresh
from stemcal.stages.result import StageResult, read_result
from stemcal.study.model import Study

if TYPE_CHECKING:
    from stemcal.stages.climb import ClimbResult
    from stemcal.stages.invert.result import InvertResult
    from stemcal.stages.refine.result import RefineResult
    from stemcal.stages.screen import ScreenResult
    from stemcal.stages.surface.result import SurfaceResult
    from stemcal.stages.validate.result import ValidateResult

_FIELDS = {"screen": "screen", "climb": "climb", "rsm": "surface", "invert": "inversion", "refine": "refinement",
           "validate": "validation"}  # fmt: skip
"""Of each stage, where its result stands."""


@dataclass(frozen=True)
class Results:
    """The result of every stage that is done; None of one that is not. `stale` says why others are left out."""

    screen: ScreenResult | None = None
    climb: ClimbResult | None = None
    surface: SurfaceResult | None = None
    inversion: InvertResult | None = None
    refinement: RefineResult | None = None
    validation: ValidateResult | None = None
    stale: tuple[str, ...] = ()

    def done(self) -> Iterator[StageResult]:
        """Yield the results that are there, in the order of the stages."""
        everything = [result for field in _FIELDS.values() if (result := getattr(self, field)) is not None]
        yield from sorted(everything, key=lambda result: result is self.refined_there)

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run of every stage."""
        for result in self.done():
            yield from result.runs()

    @property
    def refined_here(self) -> RefineResult | None:
        """The refinement in the study's own model."""
        return None if self.refinement is None or self.refinement.elsewhere else self.refinement

    @property
    def refined_there(self) -> RefineResult | None:
        """The refinement in the program or on the mesh of `refine.in`."""
        return None if self.refined_here is not None else self.refinement

    @property
    def parameters(self) -> dict[str, float]:
        """The calibrated level of every factor in the study's own model, in the units of the spec.

        Raises `UsageError` if nothing is calibrated yet.
        """
        last = self.refined_here or self.inversion
        if last is None:
            raise UsageError("nothing is calibrated yet; run `stemcal run SPEC` first")
        return dict(last.parameters)


def fresh_results(study: Study, folder: StudyFolder, made: Sequence[StageResult] = ()) -> Results:
    """Return the results that fit the spec and each other, and why the others are left out; `made` are known to fit."""
    known = {result.name: result for result in made}
    reasons: list[str] = []
    solver = functools.cache(lambda: make_solver(study))  # one that is not needed is not made

    def read(stage: Stage) -> StageResult | None:
        if not folder.has_stage(stage.name):
            return None
        if (result := known.get(stage.name) or fresh(kind_of(stage), study, folder)) is not None:
            return result
        try:
            require_fresh(study, solver(), folder, stage.name)
            return read_result(folder, kind_of(stage))
        except UsageError as error:
            reasons.append(str(error))
            return None

    found: dict[str, Any] = {field: read(stage_called(name)) for name, field in _FIELDS.items()}
    return Results(**found, stale=tuple(dict.fromkeys(reasons)))
