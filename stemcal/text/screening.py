"""What a screening shows: its outcome, how sure it is, and its notes."""

from fractions import Fraction

from stemcal.doe.designs import aliases
from stemcal.doe.regression.surface_notes import FlatResponse
from stemcal.doe.screening import notes
from stemcal.doe.screening.analysis import LEAST_DF
from stemcal.doe.screening.effects import Curvature, Effect
from stemcal.notes import Weight
from stemcal.stages.screen import Limit, ScreenResult, UnexpectedSign
from stemcal.text.language import say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence, states

# Long lists of aliases are not read: the first ones are listed, the rest is counted.
_SHOWN_FACTORS, _SHOWN_ALIASES = 6, 3


def outcome(stage: ScreenResult, names: Names) -> list[str]:
    """Return which factors are significant."""
    effects, response = {effect.factor: effect for effect in stage.effects}, names.response.long
    count = say("{factors} factors were screened in {runs} runs.", factors=len(effects), runs=len(stage.design.runs))
    chosen = sorted(stage.significant, key=lambda name: -abs(effects[name].effect))
    if chosen:
        share = "{factor:factor} ({share:fixed 1} %)"
        shares = [names.say(share, factor=name, share=effects[name].contribution_percent) for name in chosen]
        moved = "Factors that affect the {response} (share of the sum of squares): {shares:all}."
        return [count, names.say(moved, response=response, shares=shares)]
    if (largest := _largest_untested(stage)) is None:
        return [count, say("None of them affects the {response} significantly.", response=response)]
    untested = (
        "Their effects on the {response} cannot be tested: there is no error to test them with. The largest is that of "
        "{factor:factor} ({effect:response +.4g}, {share:.1f} % of the sum of squares)."
    )
    fields = {"factor": largest.factor, "effect": largest.effect, "share": largest.contribution_percent}
    return [count, names.say(untested, response=response, **fields)]


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
    by_lenth = [(effect.factor, abs(effect.effect) > me) for effect in chosen]
    by_f = [(effect.factor, effect.p is not None and effect.p < stage.alpha) for effect in chosen]
    method, other, votes = ("F test", "Lenth's method", by_lenth)
    if stage.by_lenth:
        method, other, votes = ("Lenth's method", "F test", by_f)
    said = [say("Chosen by: {method}.", method=method)]
    firm, weak = ([name for name, vote in votes if vote is wanted] for wanted in (True, False))
    if firm:
        said.append(names.say("Confirmed by the other method ({other}): {factors:factors}.", other=other, factors=firm))
    if weak:
        said.append(names.say("Not confirmed by it ({other}): {factors:factors}.", other=other, factors=weak))
    return said


def standing(effect: Effect, stage: ScreenResult) -> str:
    """Return in a word or two whether a factor is significant."""
    votes = [] if effect.p is None else [effect.p < stage.alpha]
    votes += [] if stage.lenth.me is None else [abs(effect.effect) > stage.lenth.me]
    if not votes:
        return say("not tested")
    if len(set(votes)) > 1:
        return say("methods disagree")
    return say("significant") if votes[0] else say("not significant")


def remarks(stage: ScreenResult, names: Names) -> list[Remark]:
    """Return the remarks next to the tables of a screening."""
    curvature = stage.curvature
    said = [] if curvature is None else [Remark(_curvature(curvature, names), Weight.TRUST, "curvature")]
    return [*said, *(remark(note, names) for note in stage.notes)]


def _curvature(found: Curvature, names: Names) -> str:
    means = names.say_number(
        "Curvature: the corners give {corners:response} on average, the centre {centre:response} (one run).",
        "Curvature: the corners give {corners:response} on average, the centre {centre:response} ({count} runs).",
        found.runs,
        corners=found.corners,
        centre=found.centre,
    )
    untested = "There is no error to test the difference against."
    curved = "F(1, {df}) = {f:.3g}, p {p:p}: the response is curved, a plane does not do."
    plane = "F(1, {df}) = {f:.3g}, p {p:p}: no curvature beyond the error."
    template = untested if found.p is None else curved if found.curved else plane
    return f"{means} {names.say(template, df=found.df, f=found.f, p=found.p)}"


def limit_label(limit: Limit, alpha: float) -> str:
    """Name a limit beyond which effects count."""
    labels = {"lenth": "Lenth ME", "lenth_all": "Lenth SME", "t": "t test, p = {alpha:g}"}
    return say(labels[limit.method], alpha=alpha)


states(
    notes.ScreeningRunsFailed,
    "{failed} of {runs} runs failed: the design is no longer orthogonal, and effects and sums of squares are "
    "least-squares (type III) estimates with {df} residual df that do not add up to the total; Lenth's method is "
    "approximate.",
)
states(FlatResponse, "Every run gave the same response: no factor has an effect.")
states(
    notes.LenthDecides,
    "The residual has {df} degrees of freedom, fewer than 3: Lenth's method chooses the factors.",
    otherwise="The residual is zero, so there is no F test: Lenth's method chooses the factors.",
    by=lambda note: note.df < LEAST_DF,
)
states(notes.TooFewEffects, "Lenth's method needs at least three effects: the F test chooses the factors.")
states(
    notes.InteractionOfStrongest,
    "An interaction {first:factor}:{second:factor} of the two strongest factors would show up in part as effects of "
    "{shown_by:factors}.",
)
states(
    UnexpectedSign,
    "{factor:factor} has the effect {effect:response +.4g} where the spec expects the sign {expected}: look for an "
    "alias or a wrong unit before trusting it.",
)
states(aliases.NoInteractions, "One factor has no interactions.")
states(aliases.ClearOfInteractions, "In these {runs} runs the main effects are clear of two-factor interactions.")
states(
    aliases.PartlyAliased,
    "In these {runs} runs main effects are partly aliased with two-factor interactions (weights up to {largest:.2g}).",
)
states(
    notes.MethodsDisagree,
    "The two methods disagree on {factor:factor}: p {p:p} is below {alpha:g}, but its effect {effect:response +.4g} "
    "stays within Lenth's margin of error {margin:response}.",
    otherwise="The two methods disagree on {factor:factor}: p {p:p} is not below {alpha:g}, but its effect "
    "{effect:response +.4g} exceeds Lenth's margin of error {margin:response}.",
    by=lambda note: note.p < note.alpha,
)
states(
    aliases.UniformlyAliased,
    "In these {runs} runs every main effect is aliased ±{weight} with each two-factor interaction that does not "
    "contain it.",
    weight=lambda note, _names: Fraction(note.share).limit_denominator(100),
)


@sentence.register
def _(note: aliases.FullyAliased, names: Names) -> str:
    hidden = list(note.hidden.items())
    parts = [_aliased(factor, pairs, names) for factor, pairs in hidden[:_SHOWN_FACTORS]]
    more = len(hidden) - len(parts)
    parts += [say_number("{count} more likewise", "{count} more likewise", more)] if more else []
    template = "In these {runs} runs main effects cannot be told apart from two-factor interactions: {listed}."
    return names.say(template, runs=note.runs, listed="; ".join(parts))


def _aliased(factor: str, pairs: tuple[str, ...], names: Names) -> str:
    shown, more = ", ".join(names.factor(pair) for pair in pairs[:_SHOWN_ALIASES]), len(pairs) - _SHOWN_ALIASES
    few, many = "{factor:factor} with {pairs}", "{factor:factor} with {pairs} and {count} more"
    return names.say(many if more > 0 else few, factor=factor, pairs=shown, count=more)
