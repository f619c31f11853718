"""The screening: design rows → responses → effects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Literal

from stemcal.doe.screening.analysis import Screening, analyse_screening
from stemcal.doe.screening.effect_sizes import AliasMatrix, Curvature, Effect, HalfNormalPoint, Pareto
from stemcal.doe.screening.two_stage_analysis import TwoStages
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import absent, inline
from stemcal.naming import FIRST
from stemcal.notes import Note, Weight
from stemcal.runs.answer import reasons_given
from stemcal.runs.outcome import Outcome, lower_bounds
from stemcal.stages.design import runs_of, screening_design
from stemcal.stages.result import DesignRuns, Entries, Head, StageResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study

_COLUMNS = ("factor", "symbol", "effect", "contribution_percent", "sum_of_squares", "f", "p", "stars", "lenth_t",
            "p_holm", "p_bh")  # fmt: skip


class UnexpectedSign(Note, weight=Weight.USE):
    """A significant effect has not the sign that the spec expects."""

    factor: str
    effect: float
    expected: str


@dataclass(frozen=True)
class TestedAgainst:
    """What effects are tested against; `mean_square` is None where there is nothing.

    `scatter` tells whether repeated runs that differ are in it; other errors are what aliased interactions leave.
    """

    source: str
    sum_of_squares: float
    df: int
    mean_square: float | None
    scatter: bool = False


@dataclass(frozen=True)
class Residual:
    """What the effects leave unexplained."""

    sum_of_squares: float
    df: int


@dataclass(frozen=True)
class LenthMargins:
    """Pseudo standard error, margin of error, simultaneous margin of error, in the unit of the response."""

    pse: float | None
    me: float | None
    sme: float | None


@dataclass(frozen=True)
class Limit:
    """The size from which an effect counts, by which method: Lenth's margin, also for all effects, or the t test."""

    value: float
    method: Literal["lenth", "lenth_all", "t"]


@dataclass(frozen=True, kw_only=True)
class FurtherScreening:
    """Which factors move a further response: the same runs, its own effects and tests."""

    effects: Rows[Effect]
    error: TestedAgainst | None
    half_normal: Rows[HalfNormalPoint]
    pareto: Pareto | None
    two_stages: TwoStages | None = absent()
    curvature: Curvature | None = absent()
    residual: Residual
    total_sum_of_squares: float
    significant: tuple[str, ...]
    lenth: LenthMargins | None
    runs_used: int
    runs_failed: int
    notes: tuple[Note, ...]

    @classmethod
    def of(cls, found: Screening) -> FurtherScreening:
        """Return what is kept of an analysis."""
        error, lenth = found.error, found.lenth
        return cls(
            effects=Rows(found.effects),
            error=TestedAgainst(error.source, error.sum_of_squares, error.df, error.mean_square, error.scatter),
            half_normal=Rows(found.half_normal()),
            pareto=found.pareto(),
            two_stages=found.two_stages,
            curvature=found.curvature,
            residual=Residual(found.residual_sum_of_squares, found.residual_df),
            total_sum_of_squares=found.total_sum_of_squares,
            significant=found.significant,
            lenth=LenthMargins(lenth.pse, lenth.me, lenth.sme),
            runs_used=found.runs_used,
            runs_failed=found.runs_failed,
            notes=found.notes,
        )

    def as_record(self) -> dict[str, Any]:
        """Return it field by field, as a whole result has them too."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


@dataclass(frozen=True, kw_only=True, repr=False)
class ScreenResult(StageResult):
    """Which factors move the response: effects in the order of the factors, with every test of them.

    `responses` has the same of further responses; `seen_by` shows each as a result of its own.
    """

    name: ClassVar[str] = "screen"
    shown = ("significant",)

    head: Head = inline()
    design: DesignRuns
    effects: Rows[Effect]
    error: TestedAgainst | None = None
    half_normal: Rows[HalfNormalPoint] = Rows()
    pareto: Pareto | None = None
    two_stages: TwoStages | None = absent()
    curvature: Curvature | None = absent()
    aliases: AliasMatrix | None = None
    residual: Residual
    total_sum_of_squares: float
    significant: tuple[str, ...]
    lenth: LenthMargins | None = None
    alpha: float = 0.05
    runs_used: int
    runs_failed: int
    responses: dict[str, FurtherScreening] | None = absent()
    notes: tuple[Note, ...] = ()

    @property
    def all_responses(self) -> list[ScreenResult]:
        """The screening of every response, the first one's first."""
        return [self, *(self.seen_by(name) for name in self.responses or {})]

    def seen_by(self, response: str) -> ScreenResult:
        """Return the screening of a further response as if it were the only one."""
        further = (self.responses or {})[response]
        head = replace(self.head, naming=self.naming.with_primary(response))
        return replace(self, head=head, **further.as_record(), responses=None, aliases=None)

    @property
    def active_factors(self) -> tuple[str, ...]:
        """The factors that move any response, in the order of the factors."""
        moved = {name for one in self.all_responses for name in one.significant}
        return tuple(effect.factor for effect in self.effects if effect.factor in moved)

    @property
    def shares(self) -> dict[str, float]:
        """The largest contribution of each factor to any response, per cent."""
        each = self.all_responses
        return {
            effect.factor: max(one.effect(effect.factor).contribution_percent or 0.0 for one in each)
            for effect in self.effects
        }

    def effect(self, factor: str) -> Effect:
        """Return the effect of a factor."""
        return next(effect for effect in self.effects if effect.factor == factor)

    def ranked(self) -> list[Effect]:
        """Return the effects by contribution, the largest first."""
        return sorted(self.effects, key=lambda effect: -(effect.contribution_percent or 0.0))

    def limits(self) -> list[Limit]:
        """Return the sizes from which an effect counts: Lenth's margins, and t₀·s of the t test.

        The standard error s of an effect is its size over its t.
        """
        margins = self.lenth or LenthMargins(None, None, None)
        limits = [Limit(margins.me, "lenth")] if margins.me is not None else []
        limits += [Limit(margins.sme, "lenth_all")] if margins.sme is not None else []
        if self.pareto is not None and self.pareto.t_limit:
            errors = [abs(self.effect(row.factor).effect) / row.t for row in self.pareto.rows if row.t]
            limits += [Limit(self.pareto.t_limit * max(errors), "t")] if errors else []
        return limits

    def _tables(self) -> dict[str, Table]:
        """Return effects and runs."""
        return {"screen": Table.of(_COLUMNS, self.effects), "screen_runs": self.design.table()}

    def runs(self) -> Iterator[tuple[str, Outcome]]:
        """Yield label and outcome of every run."""
        for run in self.design.runs:
            yield f"screen {run.run}", run.outcome

    def entries(self) -> Iterator[Entries]:
        """Yield what every run must tell, and the effects that are called significant."""
        yield from self.design.entries(self.design.varied)
        yield "effects", [effect.factor for effect in self.effects], self.significant


@a_stage(ScreenResult)
def screen(work: Work, head: Head) -> ScreenResult:
    """Run the screening design and find the factors that move the response."""
    study, design = work.study, screening_design(work.study, work.solver)
    error, factors = error_asked(study), study.factors
    symbols = [factor.symbol for factor in factors]
    expected = {factor.name: factor.expected_sign for factor in factors if factor.expected_sign}
    requests = design.requests(study.targets.calibrate_at)
    answers = work.answers(requests)
    bounds = lower_bounds(answers)
    with reasons_given(requests, answers):
        runs = runs_of(design, requests, answers, work.solver)
        first, *others = (
            analyse_screening(design.coded, numbers, design.names, symbols, study.screen.alpha, error, expected)
            for numbers in ([run.number(name) for run in runs.runs] for name in (FIRST, *study.own_further))
        )
    further = dict(zip(study.own_further, map(FurtherScreening.of, others), strict=True))
    notes = (*first.notes, *bounds, *unexpected_signs(first))
    fields = FurtherScreening.of(first).as_record() | {"notes": notes, "responses": further or None}
    return ScreenResult(head=head, design=runs, aliases=first.aliases(), alpha=first.alpha, **fields)


def error_asked(study: Study) -> str:
    """Return what effects are tested against: as the spec says, else the scatter of repeated runs where all are."""
    said = "error" in study.screen.model_fields_set
    return study.screen.error if said or study.replicates < 2 else "replicates"


def unexpected_signs(found: Screening) -> list[Note]:
    """Point out significant effects whose sign is not the one the spec expects."""
    return [
        UnexpectedSign(effect.factor, effect.effect, effect.conclusion.expected_sign)
        for effect in found.effects
        if effect.factor in found.significant
        and effect.conclusion is not None
        and effect.conclusion.expected_sign is not None
        and effect.against_expectation
    ]
