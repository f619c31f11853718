"""Rules of the verdict on an optimum: limits, failed runs, a gain within its interval, an end of a range."""

from collections.abc import Iterator

from stemcal.formats import outwards, series
from stemcal.notes import Note, Remedy
from stemcal.stages.optimise.analysis import problem_of
from stemcal.stages.optimise.result import OptimiseResult
from stemcal.stages.optimise.search import NoneAllowed
from stemcal.stages.rsm.result import RsmResult
from stemcal.stages.verdict import advice
from stemcal.stages.verdict.verdict_rules import Evidence, Rank, ranked

_WIDER = 0.5  # of the range


@ranked(Rank.REACH)
def limits_exclude_all(evidence: Evidence) -> Iterator[Note]:
    """Yield limits that no point of the surfaces satisfies."""
    surface = evidence.of(RsmResult)
    if surface is None or evidence.study.goal is None or evidence.of(OptimiseResult) is not None:
        return
    try:
        problem_of(evidence.study, surface).cloud  # noqa: B018
    except NoneAllowed as error:
        yield Note("limits_exclude_all", "error", str(error))


@ranked(Rank.DATA)
def optimum_failed(evidence: Evidence) -> Iterator[Note]:
    """Yield a failed simulation of the optimum or of the present cutter."""
    found = evidence.of(OptimiseResult)
    for one in found.cutters[:2] if found is not None else ():
        if not one.outcome.ok:
            text = f"The simulation of the {one.cutter} cutter failed ({one.outcome.reason})."
            yield Note("optimum_failed", "error", text, Remedy("Run `stemcal run SPEC --retry`."))


@ranked(Rank.REACH)
def limit_exceeded(evidence: Evidence) -> Iterator[Note]:
    """Yield a limit that the simulated optimum exceeds."""
    found = evidence.of(OptimiseResult)
    for name, limit in found.limits.items() if found is not None else ():
        value = found.simulated[name] if found is not None else None
        if found is not None and value is not None and value > limit:
            named = found.named(name)
            text = (
                f"The simulated {named.long} of the optimum ({named.text(value, '.4g')}) exceeds the limit of "
                f"{named.text(limit)}; the response surface predicts {named.text(found.predicted[name], '.4g')}."
            )
            lower = outwards(limit * limit / value, up=False)
            edit = f"goal: {{at_most: {{{name}: {lower:g} {named.unit}}}}}".replace(" 1}", "}")
            yield Note("limit_exceeded", "error", text, Remedy(f"Lower the limit to {named.text(lower)}.", edit))


@ranked(Rank.VALIDATION)
def indistinguishable(evidence: Evidence) -> Iterator[Note]:
    """Yield responses whose gain is not distinguishable from 0, or is a loss."""
    if (found := evidence.of(OptimiseResult)) is None:
        return
    surface, known = evidence.of(RsmResult), {n: gain for n, gain in found.gain_percent.items() if gain is not None}
    better = [name for name, (value, low, _) in known.items() if value > 0.0 and (low is None or low > 0.0)]
    worse = [name for name, (value, _, high) in known.items() if value <= 0.0 and (high is None or high < 0.0)]
    equal = [name for name in known if name not in (*better, *worse)]
    remedy = None if surface is None else advice.more_runs(surface)
    if better and found.front:
        remedy = Remedy("Choose another point of the Pareto front, or limit the response with `goal.at_most`.")
    for names, kind, what in (
        (equal, "not_distinguishable", "is not distinguishable from that of the present cutter"),
        (worse, "present_is_better", "is worse than that of the present cutter"),
    ):
        if names:
            text = f"The {series(found.named(name).long for name in names)} of the optimum {what}."
            yield Note(kind, "warning" if better else "error", text, remedy)


@ranked(Rank.MODEL)
def prediction_missed(evidence: Evidence) -> Iterator[Note]:
    """Yield a simulated optimum outside the prediction interval of its surface."""
    if (found := evidence.of(OptimiseResult)) is None:
        return
    surface, optimum = evidence.of(RsmResult), found.cutters[0]
    for name, ends in optimum.prediction_interval.items():
        value, named = found.simulated[name], found.named(name)
        if value is not None and ends is not None and not ends[0] <= value <= ends[1]:
            text = (
                f"The simulated {named.long} of the optimum ({named.text(value, '.4g')}) is outside the 95 % "
                f"prediction interval of the response surface ({ends[0]:.4g} to {named.text(ends[1], '.4g')})."
            )
            yield Note("prediction_missed", "warning", text, None if surface is None else advice.more_runs(surface))


@ranked(Rank.IDENTIFICATION)
def at_edge(evidence: Evidence) -> Iterator[Note]:
    """Yield an optimum at an end of a range."""
    found = evidence.of(OptimiseResult)
    for name, end in found.edges.items() if found is not None else ():
        factor, up = evidence.study.factor(name), end == "high"
        wider = getattr(factor, end) + (1.0 if up else -1.0) * _WIDER * (factor.high - factor.low)
        if factor.low >= 0.0:
            wider = max(wider, 0.1 * factor.low)
        unit = f" {factor.unit}".removesuffix(" 1")
        value = outwards(wider, up)
        text = f"The optimum is at the edge of the range of {name} ({getattr(factor, end):g}{unit})."
        change = Remedy(f"Set `{end}` of {name} to {value:g}{unit}.", f"factors: [{{name: {name}, {end}: {value:g}}}]")
        yield Note("at_edge", "warning", text, change)


RULES = (limits_exclude_all, optimum_failed, limit_exceeded, indistinguishable, prediction_missed, at_edge)
