"""The screening: design rows → responses → effects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar, Literal

from stemcal.doe.regression.least_squares import t_quantile
from stemcal.doe.screening.analysis import Screening, analyse_screening
from stemcal.doe.screening.effects import Curvature, Effect, Residual
from stemcal.doe.screening.lenth import Lenth
from stemcal.doe.screening.notes import LEAST_DF
from stemcal.files.rows import Rows, Table
from stemcal.files.typed import absent, inline
from stemcal.names import Names
from stemcal.naming import FIRST
from stemcal.note import Note, Remedy
from stemcal.numbers import fixed
from stemcal.runs.answer import reasons_given
from stemcal.runs.outcome import Outcome, lower_bound_notes
from stemcal.stages.design import runs_of, screening_design
from stemcal.stages.result import DesignRuns, Entries, Head, StageResult
from stemcal.stages.work import Work, a_stage
from stemcal.study.model import Study
from stemcal.words import series


@dataclass(frozen=True)
class Limit:
    """The size from which an effect counts, by which method: Lenth's margin, also for all effects, or the t test."""

    value: float
    method: Literal["lenth", "lenth_all", "t"]


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
    significant: tuple[str, ...]
    lenth: Lenth
    residual: Residual
    total_sum_of_squares: float
    alpha: float = 0.05
    curvature: Curvature | None = absent()
    runs_used: int
    runs_failed: int
    responses: dict[str, Screening] | None = absent()
    notes: tuple[Note, ...] = ()

    @property
    def all_responses(self) -> list[ScreenResult]:
        """The screening of every response, the first one's first."""
        return [self, *(self.seen_by(name) for name in self.responses or {})]

    def seen_by(self, response: str) -> ScreenResult:
        """Return the screening of a further response as if it were the only one."""
        further = (self.responses or {})[response]
        head = replace(self.head, naming=self.naming.with_primary(response))
        return replace(self, head=head, **_fields(further), responses=None)

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
        limits = [Limit(self.lenth.me, "lenth")] if self.lenth.me is not None else []
        limits += [Limit(self.lenth.sme, "lenth_all")] if self.lenth.sme is not None else []
        errors = [abs(effect.effect) / effect.f**0.5 for effect in self.effects if effect.f]
        return limits + ([Limit(t_quantile(1.0 - self.alpha, self.residual.df) * max(errors), "t")] if errors else [])

    @property
    def by_lenth(self) -> bool:
        """Whether Lenth's method chose the factors, because the residual has too few degrees of freedom or is zero."""
        tested = self.residual.df >= LEAST_DF and any(effect.f is not None for effect in self.effects)
        return self.lenth.me is not None and not tested

    def _tables(self) -> dict[str, Table]:
        """Return effects and runs."""
        return {"screen": self.effects.table(), "screen_runs": self.design.table()}

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
    symbols = [factor.symbol for factor in study.factors]
    requests = design.requests(study.targets.calibrate_at)
    answers = work.answers(requests)
    with reasons_given(requests, answers):
        runs = runs_of(design, requests, answers, work.solver)
        first, *others = (
            analyse_screening(
                design.coded,
                [run.number(name) for run in runs.runs],
                design.names,
                symbols,
                study.screen.alpha,
                Names(study.naming.with_primary(name)),
            )
            for name in (FIRST, *study.own_further)
        )
    notes = (*first.notes, *lower_bound_notes(answers), *unexpected_signs(study, first))
    further = dict(zip(study.own_further, others, strict=True)) or None
    found = _fields(first) | {"notes": notes, "responses": further}
    return ScreenResult(head=head, design=runs, alpha=study.screen.alpha, **found)


def _fields(found: Screening) -> dict[str, Any]:
    """Return an analysis field by field, as a result has them too."""
    return {field.name: getattr(found, field.name) for field in fields(found)}


def unexpected_signs(study: Study, found: Screening) -> list[Note]:
    """Return a note on each significant effect whose sign is not the one that the spec expects."""
    expected = {factor.name: factor.expected_sign for factor in study.factors}
    effects = [effect for effect in found.effects if effect.factor in found.significant]
    return [
        _unexpected(study, effect, sign)
        for effect in effects
        if (sign := expected[effect.factor]) and sign != ("+" if effect.effect > 0.0 else "-")
    ]


def _unexpected(study: Study, effect: Effect, expected: str) -> Note:
    size = Names(study.naming).quantity(effect.effect, "+.4g")
    text = f"{effect.factor} has the effect {size}, but the spec expects the sign {expected}."
    return Note(
        "unexpected_sign", "warning", text, Remedy("Check the unit of the factor, and the aliases of its effect.")
    )


def outcome(stage: ScreenResult, names: Names) -> list[str]:
    """Return which factors are significant."""
    effects, response = {effect.factor: effect for effect in stage.effects}, names.response.long
    count = f"{len(effects)} factors were screened in {len(stage.design.runs)} runs."
    chosen = sorted(stage.significant, key=lambda name: -abs(effects[name].effect))
    if chosen:
        shares = series(f"{names.factor(name)} ({fixed(effects[name].contribution_percent, 1)} %)" for name in chosen)
        return [count, f"Factors that affect the {response} (share of the sum of squares): {shares}."]
    if (largest := _largest_untested(stage)) is None:
        return [count, f"None of them affects the {response} significantly."]
    effect = names.quantity(largest.effect, "+.4g")
    return [
        count,
        f"Their effects on the {response} cannot be tested: there is no error to test them with. The largest is that "
        f"of {names.factor(largest.factor)} ({effect}, {largest.contribution_percent:.1f} % of the sum of squares).",
    ]


def _largest_untested(stage: ScreenResult) -> Effect | None:
    """Return the largest effect where none could be tested; None where some could, or all are zero."""
    largest = max(stage.effects, key=lambda effect: abs(effect.effect), default=None)
    if largest is None or largest.effect == 0.0 or any(effect.p is not None for effect in stage.effects):
        return None
    return largest if stage.lenth.me is None else None


def certainty(stage: ScreenResult, names: Names) -> list[str]:
    """Return which of the significant factors the other method confirms."""
    me = stage.lenth.me
    chosen = [effect for effect in stage.effects if effect.factor in stage.significant]
    if me is None or not chosen:
        return []
    if stage.by_lenth:
        method, other = "Lenth's method", "F test"
        votes = [(effect.factor, effect.p is not None and effect.p < stage.alpha) for effect in chosen]
    else:
        method, other = "F test", "Lenth's method"
        votes = [(effect.factor, abs(effect.effect) > me) for effect in chosen]
    found = [f"Chosen by: {method}."]
    firm, weak = ([name for name, vote in votes if vote is wanted] for wanted in (True, False))
    if firm:
        found.append(f"Confirmed by the other method ({other}): {names.factors(firm)}.")
    if weak:
        found.append(f"Not confirmed by the other method ({other}): {names.factors(weak)}.")
    return found


def standing(effect: Effect, stage: ScreenResult) -> str:
    """Return in a word or two whether a factor is significant."""
    votes = [] if effect.p is None else [effect.p < stage.alpha]
    votes += [] if stage.lenth.me is None else [abs(effect.effect) > stage.lenth.me]
    if not votes:
        return "not tested"
    if len(set(votes)) > 1:
        return "methods disagree"
    return "significant" if votes[0] else "not significant"


def limit_label(limit: Limit, alpha: float) -> str:
    """Name a limit beyond which effects count."""
    return {"lenth": "Lenth ME", "lenth_all": "Lenth SME", "t": f"t test, p = {alpha:g}"}[limit.method]
