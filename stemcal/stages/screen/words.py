"""The outcome of a screening, and how sure it is, in sentences."""

from stemcal.doe.effects import Effect
from stemcal.naming import Names
from stemcal.numbers import fixed
from stemcal.stages.screen.result import Limit, ScreenResult
from stemcal.words import series


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
        f"Without an estimate of error, effects on the {response} cannot be tested. The largest is that of "
        f"{names.factor(largest.factor)} ({effect}, {largest.contribution_percent:.1f} % of the sum of squares).",
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
    found = [f"Selected by: {method}."]
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
    """Name a limit beyond which effects are significant."""
    return {"lenth": "Lenth ME", "lenth_all": "Lenth SME", "t": f"t test, p = {alpha:g}"}[limit.method]
