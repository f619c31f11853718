"""The result of the stage screen: the effect of every factor with its tests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from stemcal.doe.effects import Curvature, Effect, Lenth, Residual
from stemcal.doe.regression.least_squares import t_quantile
from stemcal.drawing.table import Table
from stemcal.notes import Note
from stemcal.runs.record import Outcome
from stemcal.stages.result import DesignRuns, Head, StageResult
from stemcal.storage.rows import Rows
from stemcal.storage.typed import absent, inline

LEAST_DF = 3
"""Residual degrees of freedom from which the F test selects the factors."""


@dataclass(frozen=True, kw_only=True)
class Screening:
    """The effects on one response in the order of the factors, the residual, and the significant factors."""

    effects: Rows[Effect]
    significant: tuple[str, ...]
    lenth: Lenth
    residual: Residual
    total_sum_of_squares: float
    curvature: Curvature | None = absent()
    runs_used: int
    runs_failed: int
    notes: tuple[Note, ...]


@dataclass(frozen=True, kw_only=True, repr=False)
class ScreenResult(StageResult, Screening):
    """The screening of the first response, and the screenings of further `responses` (see `screening_of`)."""

    name: ClassVar[str] = "screen"
    shown = ("significant",)

    head: Head = inline()
    design: DesignRuns
    alpha: float = 0.05
    responses: dict[str, Screening] | None = absent()
    notes: tuple[Note, ...] = ()

    @property
    def all_responses(self) -> list[ScreenResult]:
        """Screenings of all responses, beginning with the first."""
        return [self, *(self.screening_of(name) for name in self.responses or {})]

    def screening_of(self, response: str) -> ScreenResult:
        """Return the screening of a further response as a separate `ScreenResult`."""
        further = (self.responses or {})[response]
        head = replace(self.head, naming=self.naming.with_primary(response))
        return replace(self, head=head, **vars(further), responses=None)

    @property
    def active_factors(self) -> tuple[str, ...]:
        """Factors with a significant effect on any response, in their order."""
        moved = {name for screening in self.all_responses for name in screening.significant}
        return tuple(effect.factor for effect in self.effects if effect.factor in moved)

    @property
    def shares(self) -> dict[str, float]:
        """Largest contribution of each factor to any response, %."""
        each = self.all_responses
        return {
            effect.factor: max(screening.effect(effect.factor).contribution_percent or 0.0 for screening in each)
            for effect in self.effects
        }

    def effect(self, factor: str) -> Effect:
        return next(effect for effect in self.effects if effect.factor == factor)

    def sign_of(self, factor: str) -> Literal["+", "-"] | None:
        effect = self.effect(factor).effect if factor in self.significant else 0.0
        return "+" if effect > 0.0 else "-" if effect < 0.0 else None

    @property
    def limit(self) -> float | None:
        """Smallest size of a significant effect: Lenth's margin of error, or Student's t times its standard error."""
        if self.by_lenth:
            return self.lenth.me
        errors = [abs(effect.effect) / effect.f**0.5 for effect in self.effects if effect.f]
        return t_quantile(1.0 - self.alpha, self.residual.df) * max(errors) if errors else None

    @property
    def by_lenth(self) -> bool:
        """Whether Lenth's method selected the factors, because the residual is zero or has too few df."""
        tested = self.residual.df >= LEAST_DF and any(effect.f is not None for effect in self.effects)
        return self.lenth.me is not None and not tested

    def _tables(self) -> dict[str, Table]:
        return {"screen": Table.of_rows(self.effects), "screen_runs": self.design.table()}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        for run in self.design.runs:
            yield f"screen {run.run}", run.outcome
