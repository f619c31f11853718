"""What a screening says: its outcome, how sure it is, each factor's standing, and its notes."""

from collections.abc import Iterator
from fractions import Fraction

from stemcal.doe.designs import aliases
from stemcal.doe.designs.definitive_screening import OneSpareColumn
from stemcal.doe.regression.surface_notes import FlatResponse
from stemcal.doe.screening import notes
from stemcal.doe.screening.effect_sizes import Curvature, Effect
from stemcal.doe.screening.lenth import FoldOverPays
from stemcal.doe.screening.two_stage_analysis import ErrorSource, TwoStages
from stemcal.notes import Weight
from stemcal.stages.screen import Limit, ScreenResult, UnexpectedSign
from stemcal.text.language import all_of, say, say_number
from stemcal.text.names import Names
from stemcal.text.notes import Remark, remark, sentence, states

# Long lists of aliases are not read: so many are named, the rest is counted.
_SHOWN_FACTORS, _SHOWN_ALIASES = 6, 3


def outcome(stage: ScreenResult, names: Names) -> list[str]:
    """Say which factors move the response."""
    effects, response = {effect.factor: effect for effect in stage.effects}, names.response.long
    count = say("{factors} factors were screened in {runs} runs.", factors=len(effects), runs=len(stage.design.runs))
    chosen = sorted(stage.significant, key=lambda name: -abs(effects[name].effect))
    if not chosen and (largest := _largest_untested(stage)) is not None:
        saturated = (
            "Their effects on the {response} cannot be tested: no residual degrees of freedom are left. The largest is "
            "that of {factor:factor} ({effect:response +.4g}, {share:.1f} % of the sum of squares)."
        )
        exact = (
            "Their effects on the {response} cannot be tested: there is no error to test them with. The largest is "
            "that of {factor:factor} ({effect:response +.4g}, {share:.1f} % of the sum of squares)."
        )
        template, share = exact if stage.residual.df else saturated, largest.contribution_percent
        said = names.say(template, response=response, factor=largest.factor, effect=largest.effect, share=share)
        return [count, said]
    if not chosen:
        return [count, say("None of them moves the {response} significantly.", response=response)]
    shares = [
        names.say("{factor:factor} ({share:fixed 1} %)", factor=name, share=effects[name].contribution_percent)
        for name in chosen
    ]
    moved = "Factors that move the {response} (share of the sum of squares): {shares:all}."
    return [count, names.say(moved, response=response, shares=shares)]


def _largest_untested(stage: ScreenResult) -> Effect | None:
    """Return the largest effect where none could be tested; None where some could, or all are zero."""
    largest = max(stage.effects, key=lambda effect: abs(effect.effect), default=None)
    if largest is None or largest.effect == 0.0 or any(effect.p is not None for effect in stage.effects):
        return None
    return largest if stage.lenth is None or stage.lenth.me is None else None


def certainty(stage: ScreenResult, names: Names) -> list[str]:
    """Say which of the chosen factors Lenth's method confirms, and which may be chance."""
    chosen = [effect for effect in stage.effects if effect.factor in stage.significant]
    if stage.lenth is None or stage.lenth.me is None or not chosen:
        return []
    firm = [effect.factor for effect in chosen if abs(effect.effect) > stage.lenth.me]
    weak = [effect.factor for effect in chosen if abs(effect.effect) <= stage.lenth.me]
    lost = [e.factor for e in chosen if e.conclusion is not None and not e.conclusion.among_all]
    said = []
    if firm:
        said.append(names.say("Lenth's method, which needs no residual, confirms {factors:factors}.", factors=firm))
    if weak:
        said.append(names.say("Lenth's method does not confirm {factors:factors}: treat as doubtful.", factors=weak))
    if lost:
        template = "Tested among all {count} factors at once (Holm, Lenth), {factors:factors} may be chance."
        said.append(names.say(template, count=len(stage.effects), factors=lost))
    return said


def standing(effect: Effect) -> str:
    """Say in two or three words whether a factor matters; nothing where the study does not tell."""
    if effect.conclusion is None:
        return ""
    words = {
        "untested": say("not tested"),
        "none": say("no effect seen"),
        "disputed": say("methods disagree"),
        "possible": say("may matter"),
        "active": say("matters"),
    }
    unexpected = {
        "disputed": say("methods disagree, unexpected sign"),
        "possible": say("may matter, unexpected sign"),
        "active": say("matters, unexpected sign"),
    }
    chosen = words | unexpected if effect.against_expectation else words
    return chosen[effect.conclusion.standing]


def judgement(effect: Effect, stage: ScreenResult, names: Names) -> list[str]:
    """Say whether a factor matters, by p and by Lenth's method, and whether its sign is the expected one."""
    if effect.conclusion is None:
        return []
    said = [names.say(_standing_template(effect, stage), factor=effect.factor), _size(effect, names)]
    if effect.conclusion.standing in ("none", "untested"):
        return said
    return [*said, *_tests(effect, names), *_expectation(effect)]


def _standing_template(effect: Effect, stage: ScreenResult) -> str:
    assert effect.conclusion is not None
    if effect.conclusion.standing == "none" and stage.error is not None and stage.error.scatter:
        return "{factor:factor} shows no effect beyond the scatter of repeated runs."
    return {
        "untested": "Whether {factor:factor} matters cannot be tested.",
        "none": "{factor:factor} shows no effect beyond what aliased interactions can imitate.",
        "disputed": "{factor:factor} may matter, but the methods disagree.",
        "possible": "{factor:factor} may matter.",
        "active": "{factor:factor} matters.",
    }[effect.conclusion.standing]


def _size(effect: Effect, names: Names) -> str:
    raises = "From low to high it raises the response by {change:response} ({share:.1f} % of the variation)."
    lowers = "From low to high it lowers the response by {change:response} ({share:.1f} % of the variation)."
    template = raises if effect.effect > 0.0 else lowers
    return names.say(template, change=abs(effect.effect), share=effect.contribution_percent)


def _tests(effect: Effect, names: Names) -> Iterator[str]:
    found = effect.conclusion
    assert found is not None
    if effect.p is not None:
        yield names.say("By itself it has p {p:p}.", p=effect.p)
    if found.by_lenth is not None:
        beyond, inside = "It is beyond Lenth's margin of error.", "It is within Lenth's margin of error."
        yield say(beyond if found.by_lenth else inside)
    if not found.among_all:
        with_p = "Among all factors at once it does not stand out (Holm p {p:p})."
        yield names.say(with_p if effect.p_holm is not None else "Among all factors at once it does not stand out.",
                        p=effect.p_holm)  # fmt: skip


def _expectation(effect: Effect) -> list[str]:
    assert effect.conclusion is not None
    expected = effect.conclusion.expected_sign
    if expected is None:
        return []
    if effect.against_expectation:
        return [say("Its sign is not the expected {sign}.", sign=expected)]
    return [say("Its sign is as expected.")]


def remarks(stage: ScreenResult, names: Names) -> list[Remark]:
    """Return what a screening says beside its tables."""
    said = []
    if stage.two_stages is not None:
        text = _two_stages(stage.two_stages, len(stage.effects), names)
        said.append(Remark(text, Weight.TRUST, "two_stages"))
    if stage.curvature is not None:
        said.append(Remark(_curvature(stage.curvature, names), Weight.TRUST, "curvature"))
    return [*said, *(remark(note, names) for note in stage.notes)]


def _two_stages(found: TwoStages, factors: int, names: Names) -> str:
    none = "In two stages: none of {factors} main effects stands out from the error ({error})."
    plain = "In two stages: {active:factors} above the error ({error}); no square or interaction of them is needed."
    bent = "In two stages: {active:factors} above the error ({error}); beside them {second:factors}."
    open_ = (
        "In two stages: {active:factors} above the error ({error}); beside them {second:factors}, the best of {sets} "
        "sets of as many that explain the runs: which terms it is stays open."
    )
    first, second = found.first, found.second_order
    template = none if not first.active else plain if not second else open_ if found.equals else bent
    error = names.say(
        "{size:response .3g} with {df} degrees of freedom, from {source}",
        size=first.mean_square**0.5,
        df=first.df,
        source=_source(first.source),
    )
    fields = {"factors": factors, "active": first.active, "second": second, "sets": found.equals + 1}
    return names.say(template, error=error, **fields)


def _source(source: ErrorSource) -> str:
    if source.lenth:
        return say("the effects within Lenth's margin")
    columns, runs = source.fake_columns, source.centre_runs
    parts = (
        [say_number("{count} column without a factor", "{count} columns without a factor", columns)] if columns else []
    )
    return all_of(
        parts + ([say_number("{count} run at the centre", "{count} runs at the centre", runs)] if runs else [])
    )


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
states(notes.LenthError, "As chosen, p-values are those of Lenth's method; they hold if most factors have no effect.")
states(
    notes.NoResidual,
    "Every column carries a factor, so there is no residual and no p-value: only Lenth's method can decide.",
)
states(notes.ExactResidual, "The residual is exactly zero, so no F can be formed: only Lenth's method can decide.")
states(
    notes.WeakError,
    "The error has only {df} residual df (the unused columns), so the F tests are weak: read p beside Lenth's method "
    "and the adjusted p-values. Without repeated runs these columns hold no scatter: what is in them is interactions, "
    "aliased.",
)
states(notes.TooFewEffects, "Fewer than three effects: Lenth's method has nothing to take as noise.")
states(
    notes.NotAfterHolm,
    "{factors:factors} has p below {alpha:g} alone, not after Holm's correction: of {tested} factors without effect at "
    "least one would with a probability of up to {by_chance_percent:.0f} %.",
    "{factors:factors} have p below {alpha:g} alone, not after Holm's correction: of {tested} factors without effect "
    "at least one would with a probability of up to {by_chance_percent:.0f} %.",
    by="factors",
)
states(
    notes.InteractionOfStrongest,
    "An interaction {first:factor}:{second:factor} of the two strongest factors would show up in part as effects of "
    "{shown_by:factors}.",
)
states(
    FoldOverPays,
    "A fold-over (`stemcal augment SPEC --fold-over`, {runs} runs more) frees the main effects of interactions: an "
    "effect of {effect:response .3g} beside those found is missed in {missed:.0%} of cases now and in "
    "{missed_folded:.0%} then, where interactions are half their parents.",
)
states(
    UnexpectedSign,
    "{factor:factor} has the effect {effect:response +.4g} where the spec expects the sign {expected}: look for an "
    "alias or a wrong unit before trusting it.",
)
states(
    OneSpareColumn,
    "A definitive screening of {factors} factors in {runs} runs tests main effects against one degree of freedom: of "
    "studies in which nothing matters, about three of ten end with a square or an interaction. Where repeated runs "
    "differ, `screen.runs: {with_centre}` adds two centre runs; of a deterministic solver `screen.runs: "
    "{with_columns}` adds two columns without a factor. Either leaves about one of ten.",
)
states(aliases.NoInteractions, "One factor has no interactions.")
states(aliases.ClearOfInteractions, "In these {runs} runs the main effects are clear of two-factor interactions.")
states(
    aliases.PartlyAliased,
    "In these {runs} runs main effects are partly aliased with two-factor interactions (weights up to {largest:.2g}).",
)
states(
    notes.PooledError,
    "As chosen, the error pools the unused columns and {pooled:factors} ({df} df): effects that are small by chance "
    "make it small, so p-values look better than they are.",
    otherwise="As chosen, the error pools the unused columns ({df} df).",
    by="pooled",
)
states(
    notes.ReplicateError,
    "The error is the scatter of repeated runs ({df} df).",
    otherwise="The error was to come from repeated runs, but no run is repeated, or all repeats agree exactly.",
    by="df",
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
    notes.UnusedContrasts,
    "Lenth's margin is that of {count} contrasts, the unused columns' ({listed:all}) among them. It decides which "
    "factors count, since F rests on these columns alone.",
    otherwise="Lenth's margin is that of {count} contrasts, the unused columns' ({listed:all}) among them.",
    by="decides",
    listed=lambda note, names: [names.quantity(value, "+.3g") for value in note.contrasts],
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
